"""Strains on the faces of thin parts, where bending makes them largest."""

from functools import cache

import numpy as np
from numpy.typing import NDArray
from skfem import ElementHex2

from fea import shell_geometry as geometry
from fea.parts import Deformable
from fea.shell import Shell

Array = NDArray[np.float64]


def face_strains(part: Deformable, x: Array, cells: NDArray[np.bool_] | None = None) -> Array:
    """Green-Lagrange strains (elements, 8, 3, 3) at 2 x 2 Gauss places of either face.

    Parameters
    ----------
    part
        Shell, or hexahedra whose third direction is the thickness, as ``meshes.layered`` makes them.
    x
        Displacements of the part's nodes (n, 3), m.
    cells
        Which elements (elements,); None: all.
    """
    which = slice(None) if cells is None else cells
    if isinstance(part, Shell):
        ends = (part.points + x)[part.cells].reshape(-1, 9, 2, 3)
        after = ends.mean(axis=2), 0.5 * (ends[:, :, 1] - ends[:, :, 0])
        old, new = (geometry.jacobians(middle[which], half[which], _FACES) for middle, half in (part._nodal, after))
    else:
        slopes = _solid_slopes()
        old, new = (np.einsum("qjk,ekc->eqjc", slopes, at[part.cells[which]]) for at in (part.points, part.points + x))
    gradient = np.linalg.solve(old, new)
    return np.asarray(0.5 * (gradient @ np.swapaxes(gradient, -1, -2) - np.eye(3)))


@cache
def _solid_slopes() -> Array:
    """Slopes of a hexahedron's shape functions at the places of ``_FACES`` (8, 3, 27)."""
    element, places = ElementHex2(), 0.5 * (1.0 + _FACES.T)
    return np.stack([np.asarray(element.lbasis(places, i)[1]) for i in range(27)], axis=2).transpose(1, 0, 2)


def _faces() -> Array:
    """Places on the lower and upper face of a shell's elements (8, 3): 2 x 2 Gauss, where strains are best."""
    g = 1 / np.sqrt(3)
    return np.array([[r, s, z] for r in (-g, g) for s in (-g, g) for z in (-1.0, 1.0)])


_FACES = _faces()
