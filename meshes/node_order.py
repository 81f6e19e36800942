"""Node orders of the complete quadratic hexahedron, told apart by their reference coordinates."""

from functools import cache

import numpy as np
from numpy.typing import NDArray

#: VTK cell type of the complete quadratic hexahedron (``VTK_TRIQUADRATIC_HEXAHEDRON``).
VTK_CELL_TYPE = 29

# Nodes of vtkTriQuadraticHexahedron as "xyz" on the grid 0, 1, 2 (VTK file formats, cell 29):
# corners, edges of the lower, upper and upright sides, faces -x +x -y +y -z +z, centre.
_VTK_GRID = (
    "000 200 220 020 002 202 222 022 100 210 120 010 102 212 122 012 001 201 221 021 011 211 101 121 110 112 111"
)


def vtk_reference() -> NDArray[np.float64]:
    """Coordinates of the 27 nodes in VTK order on the unit cube, (27, 3)."""
    return np.array([[int(c) for c in node] for node in _VTK_GRID.split()]) / 2.0


@cache
def _permutation(to_skfem: bool) -> tuple[int, ...]:
    from skfem import ElementHex2

    vtk, skfem = vtk_reference(), ElementHex2.doflocs
    source, target = (vtk, skfem) if to_skfem else (skfem, vtk)
    return tuple(int(np.flatnonzero((source == node).all(axis=1))[0]) for node in target)


def vtk_to_skfem() -> NDArray[np.int64]:
    """Rows of a VTK connectivity in scikit-fem's order, (27,): ``skfem_cells = vtk_cells[rows]``.

    meshio hands back VTK's order, also from gmsh files.
    """
    return np.array(_permutation(True))


def skfem_to_vtk() -> NDArray[np.int64]:
    """Rows of a scikit-fem connectivity in VTK's order, (27,): ``vtk_cells = skfem_cells[rows]``."""
    return np.array(_permutation(False))
