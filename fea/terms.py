"""What adds to the equations of equilibrium beyond parts and dead loads: contact, pressure, springs."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Term(Protocol):
    """Forces that depend on the displacements of some nodes.

    ``x`` are the displacements of all nodes (N, 3), m; ``t`` is the problem's parameter.
    """

    @property
    def cells(self) -> NDArray[np.int64]:
        """Nodes that each of its small matrices couples (m, k); -1 where a row has fewer."""

    def prepare(self, x: Array) -> bool:
        """Get ready for an increment that starts at ``x``; True when ``cells`` has changed."""

    def force(self, x: Array, t: float) -> Array:
        """Nodal forces (N, 3), N, that resist, with the sign of internal forces."""

    def tangent(self, x: Array, t: float) -> Array:
        """Symmetric matrices (m, 3k, 3k), N/m."""

    def energy(self, x: Array, t: float) -> float:
        """Stored energy, J; 0 where there is none."""

    def augment(self, x: Array) -> bool:
        """Improve multipliers at an equilibrium; True when equilibrium must be sought again."""

    def accept(self, x: Array) -> None:
        """Take ``x`` over as the end of an increment."""

    def reject(self) -> None:
        """Go back to the last accepted increment."""

    def report(self, x: Array) -> dict[str, float]:
        """What a reader wants to know, by name with unit (``force [N]``)."""


class Steady:
    """The part of ``Term`` that only contact needs; for terms that have no history and couple the same nodes always."""

    def prepare(self, x: Array) -> bool:
        """Nothing to look for."""
        return False

    def energy(self, x: Array, t: float) -> float:
        """None stored."""
        return 0.0

    def augment(self, x: Array) -> bool:
        """No multipliers."""
        return False

    def accept(self, x: Array) -> None:
        """No history."""

    def reject(self) -> None:
        """No history."""

    def report(self, x: Array) -> dict[str, float]:
        """Nothing to tell."""
        return {}
