"""gmsh file to scikit-fem mesh."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from meshes.node_order import vtk_to_skfem

if TYPE_CHECKING:
    from skfem import MeshHex2


def read_mesh(path: Path) -> "MeshHex2":
    """Mesh of complete quadratic hexahedra with its surface groups as named boundaries.

    Parameters
    ----------
    path
        gmsh file with 27-node hexahedra and, on surface groups, nine-node quadrilaterals; m.

    Returns
    -------
    MeshHex2
        ``boundaries`` holds the facets of each surface group (``root``, ``tip``, ``sides``).
    """
    import meshio
    from skfem import MeshHex2

    data = meshio.read(path, file_format="gmsh")
    cells = data.cells_dict.get("hexahedron27")
    if cells is None:
        raise ValueError(f"{path} holds no 27-node hexahedra; make it with Mesh.SecondOrderIncomplete = 0")
    mesh = MeshHex2(data.points.T, cells.T[vtk_to_skfem()])
    return mesh.with_boundaries(_surface_groups(data, mesh))


def _surface_groups(data: Any, mesh: "MeshHex2") -> dict[str, NDArray[np.int64]]:
    """Facets of every surface group, found by their four corners."""
    # scikit-fem numbers the corners in the order of their numbers in the file.
    corners = np.unique(data.cells_dict["hexahedron27"][:, :8])
    names = {int(tag): name for name, (tag, dim) in data.field_data.items() if dim == 2}
    quads = np.searchsorted(corners, data.cells_dict["quad9"][:, :4])
    groups = data.cell_data_dict["gmsh:physical"]["quad9"]
    facet_of = {tuple(nodes): number for number, nodes in enumerate(np.sort(mesh.facets, axis=0).T.tolist())}
    facets = np.array([facet_of[tuple(nodes)] for nodes in np.sort(quads, axis=1).tolist()])
    return {name: facets[groups == tag] for tag, name in names.items()}
