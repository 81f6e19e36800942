"""Contact of a deformable surface with a rigid plane."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fea.contact.facets import PLANE
from fea.contact.law import ContactLaw
from fea.contact.term import FacetContact
from fea.surface import Surface

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class Plane:
    """A plane by one of its points and the normal that points at the deformable body.

    Parameters
    ----------
    point, normal
        (3,), m, and (3,) of any length.
    offset
        How far the plane has moved along its normal, m, as a function of t.
    """

    point: Array
    normal: Array
    offset: Callable[[float], float] | None = None

    def corners(self, t: float) -> Array:
        """Three points of the plane (3, 3), m, anticlockwise as seen from the body."""
        normal, corners = self._frame
        return corners if self.offset is None else corners + self.offset(t) * normal

    @cached_property
    def _frame(self) -> tuple[Array, Array]:
        """Unit normal (3,) and the corners before any motion (3, 3), m."""
        size = float(np.linalg.norm(self.normal))
        if not 0.0 < size < np.inf:
            raise ValueError(f"a plane needs a normal of finite length, not {self.normal}")
        normal, start = np.asarray(self.normal, dtype=float) / size, np.asarray(self.point, dtype=float)
        first = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
        first /= np.linalg.norm(first)
        return normal, np.stack([start, start + first, start + np.cross(normal, first)])


@dataclass(frozen=True)
class CarriedPlane:
    """The plane through the present positions of three nodes, as of a rigid part; it takes its forces there.

    Parameters
    ----------
    nodes
        (3,), anticlockwise as seen from the deformable body, not in line.
    """

    nodes: tuple[int, int, int]


class PlaneContact(FacetContact):
    """Points of a surface that may not pass through a rigid plane: a ``fea.terms.Term``.

    The plane has no end, and every point behind it is pushed out, however deep.

    Parameters
    ----------
    surface
        Deformable surface; leave out what lies behind the plane by intent.
    points
        Reference coordinates of all nodes (N, 3), m.
    plane
        Fixed, moving with t, or carried by nodes.
    law
        Stiffness, friction, tolerance.
    order
        Polynomial order that the quadrature is exact for.
    """

    def __init__(
        self, surface: Surface, points: Array, plane: Plane | CarriedPlane, law: ContactLaw, order: int = 5
    ) -> None:
        super().__init__(surface, points, law, PLANE, order=order)
        self.plane = plane
        nodes = plane.nodes if isinstance(plane, CarriedPlane) else len(points) + np.arange(3)
        self._masters = np.array([nodes], dtype=np.int64)
        if isinstance(plane, CarriedPlane):
            a, b, c = points[self._masters[0]]
            if np.linalg.norm(np.cross(b - a, c - a)) <= 1e-9 * np.linalg.norm(b - a) * np.linalg.norm(c - a):
                raise ValueError(f"the nodes {plane.nodes} of a plane lie in one line")
        facets = np.arange(len(self._slaves))
        self._set_pairs(np.stack([facets, np.zeros_like(facets)], axis=1))

    @property
    def _coupled(self) -> Ints:
        return self._masters if isinstance(self.plane, CarriedPlane) else self._masters[:, :0]

    def _positions(self, x: Array, t: float) -> Array:
        here = super()._positions(x, t)
        return here if isinstance(self.plane, CarriedPlane) else np.concatenate([here, self.plane.corners(t)])
