"""A rigid mass on a boundary by a distributing coupling, which does not stiffen what carries it."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from fea.affine import affine_shares
from fea.pattern import Pattern

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

#: Moment off the boundary's plane, as a share of the moments, that counts as none.
_FLAT = 1e-6


class Bounded(Protocol):
    """What a coupled mass needs of a part; see ``fea.shell.Shell`` and ``fea.body.Body``."""

    @property
    def points(self) -> Array:
        """Nodes (nodes, 3), m."""

    @property
    def pattern(self) -> Pattern:
        """Sparsity of the mass."""

    def boundary(self, name: str) -> Ints:
        """Nodes of a named boundary."""

    def shares(self, name: str) -> Array:
        """Area that every node carries of a named boundary."""


@dataclass(frozen=True)
class CoupledMass:
    """Mass in the plane of a flat boundary, riding on the boundary's mean affine motion.

    A point at r from the boundary's centre moves as the nodes' shares H (1, r) say (``affine_shares``), so that the
    mass is the constant matrix H S H' whatever turns, with S the ``moments``.  Where the boundary moves as a rigid
    body, so does the mass; where it is strained, the mass is strained with it and does not resist.  Sums of rows
    are the first moments: its weight and the inertia forces of a moving clamp act where its centre of mass is.

    Parameters
    ----------
    boundary
        Name.
    moments
        Integral of (1, x, y, z)(1, x, y, z)' over the mass (4, 4), kg, kg m, kg m^2, from the boundary's centre.
    """

    boundary: str
    moments: Array

    def between(self, part: Bounded) -> tuple[Ints, Array]:
        """Nodes (n,), ascending, and the mass between them along each axis (n, n), kg.

        Raises
        ------
        ValueError
            When some of the mass lies off the boundary's plane.
        """
        nodes = part.boundary(self.boundary)
        weights, points = part.shares(self.boundary)[nodes], part.points[nodes]
        arms = points - weights @ points / weights.sum()
        shares = affine_shares(arms, weights)
        known = np.eye(4)
        known[1:, 1:] = shares[:, 1:].T @ arms
        size = np.sqrt(np.abs(np.outer(np.diag(self.moments), np.diag(self.moments)))).max()
        if np.abs(known @ self.moments @ known.T - self.moments).max() > _FLAT * size:
            raise ValueError(f"a mass on the boundary {self.boundary!r} must lie in its plane")
        return nodes, shares @ self.moments @ shares.T

    def add_to(self, data: Array, part: Bounded) -> None:
        """Add the mass to values (stored,), kg, on the part's pattern."""
        nodes, matrix = self.between(part)
        first, second = np.triu_indices(len(nodes))
        for axis in range(3):
            data[part.pattern.places(3 * nodes[first] + axis, 3 * nodes[second] + axis)] += matrix[first, second]
