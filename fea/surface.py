"""Oriented surfaces of parts: what pressure acts on and what touches."""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from skfem import ElementQuad2, ElementTriP2
from skfem.quadrature import get_quadrature

Array = NDArray[np.float64]

#: ElementQuad2 with r and s exchanged: the same facet seen from the other side.
FROM_BELOW = np.array([0, 3, 2, 1, 7, 6, 5, 4, 8])
_ELEMENTS = {"quad9": ElementQuad2, "tri6": ElementTriP2}


@dataclass(frozen=True)
class Shapes:
    """Shape functions of one facet at its quadrature points.

    Parameters
    ----------
    values
        (points, k).
    slopes
        Derivatives by the two reference coordinates, (points, 2, k).
    weights
        Quadrature weights on the reference facet, (points,).
    """

    values: Array
    slopes: Array
    weights: Array


@dataclass(frozen=True)
class Surface:
    """Facets of one kind whose normal, d/dr x d/ds, points out of the body.

    Parameters
    ----------
    facets
        Node numbers (facets, k), in the order of ``ElementQuad2.doflocs`` or ``ElementTriP2.doflocs``.
    shape
        Kind of facet.
    """

    facets: NDArray[np.int64]
    shape: Literal["quad9", "tri6"] = "quad9"

    @cached_property
    def nodes(self) -> NDArray[np.int64]:
        """Nodes of the surface, ascending."""
        return np.unique(self.facets)

    def shifted(self, by: int) -> "Surface":
        """The same surface where the part's first node has the number ``by``."""
        return Surface(self.facets + by, self.shape)

    def shapes(self, order: int = 5) -> Shapes:
        """Shape functions at the points of a rule that is exact for polynomials of ``order``."""
        element = _ELEMENTS[self.shape]()
        places, weights = get_quadrature(element.refdom, order)
        return Shapes(*shape_functions(self.shape, places), weights)

    def areas(self, points: Array, order: int = 5) -> Array:
        """Area per node (all nodes,), m^2: integral of its shape function; ``points`` (all nodes, 3), m."""
        shapes = self.shapes(order)
        tangents = np.einsum("qjk,fkc->fqjc", shapes.slopes, points[self.facets])
        area = np.linalg.norm(np.cross(tangents[:, :, 0], tangents[:, :, 1]), axis=2) * shapes.weights
        return np.bincount(self.facets.ravel(), (area @ shapes.values).ravel(), len(points)).astype(np.float64)


def shape_functions(shape: str, places: Array) -> tuple[Array, Array]:
    """Shape functions (points, k) and their slopes (points, 2, k) at reference ``places`` (2, points)."""
    element = _ELEMENTS[shape]()
    pairs = [element.lbasis(places, i) for i in range(len(element.doflocs))]
    values = np.stack([np.broadcast_to(value, places.shape[1]) for value, _ in pairs], axis=1)
    slopes = np.stack([np.broadcast_to(np.asarray(slope), places.shape) for _, slope in pairs], axis=2)
    return np.ascontiguousarray(values), np.ascontiguousarray(slopes.transpose(1, 0, 2))
