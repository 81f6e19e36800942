"""Sheets: one body of a mesh of middle surfaces, and the same made solid."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from meshes.gathering import HEXAHEDRON, QUADRILATERAL, element_places, gathered

if TYPE_CHECKING:
    from skfem import MeshHex2, MeshQuad2

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


def body_alone(mesh: "MeshQuad2", body: str) -> "MeshQuad2":
    """The subdomain ``body`` as a mesh of its own, with what it has of the named edges."""
    cells = np.asarray((mesh.subdomains or {})[body], dtype=np.int64)
    own = np.zeros(mesh.t.shape[1], dtype=bool)
    own[cells] = True
    edges = {}
    for name, facets in (mesh.boundaries or {}).items():
        facets = np.asarray(facets)[own[mesh.f2t[0, np.asarray(facets)]]]
        if len(facets):
            edges[name] = mesh.facets[:, facets].T.astype(np.int64)
    return gathered(QUADRILATERAL, mesh.t[:, cells].T.astype(np.int64), element_places(mesh)[cells], edges)


def edge_nodes(mesh: "MeshQuad2", name: str) -> Ints:
    """Nodes on a named edge, ascending."""
    return np.unique(mesh.dofs.get_facet_dofs((mesh.boundaries or {})[name]).flatten()).astype(np.int64)


def layered(mesh: "MeshQuad2", half: Array, middle: Array | None = None) -> tuple["MeshHex2", Ints]:
    """27-node hexahedra between the faces of a middle surface.

    Parameters
    ----------
    mesh
        The middle surface.
    half
        Vectors from its nodes to the upper face (n, 3), m.
    middle
        Nodes between the faces, m, where they lie beside the middle surface (n, 3).

    Returns
    -------
    mesh, nodes
        The solid, and its nodes at the lower face, in the middle and at the upper face of every node (n, 3).

    Raises
    ------
    MeshError
        Where faces fold.
    """
    cells = mesh.dofs.element_dofs.T
    flat, solid = QUADRILATERAL.reference, HEXAHEDRON.reference
    below = np.abs(flat[None] - solid[:, None, :2]).sum(axis=2).argmin(axis=1)
    layer = np.round(2 * solid[:, 2]).astype(np.int64)
    points = mesh.doflocs.T
    layers = np.stack([points - half, points if middle is None else middle, points + half], axis=1)
    numbers = 3 * cells[:, below].astype(np.int64) + layer
    made = gathered(HEXAHEDRON, numbers[:, : HEXAHEDRON.corners], layers[cells[:, below], layer])
    nodes = np.empty((len(half), 3), dtype=np.int64)
    nodes[cells[:, below], layer] = made.dofs.element_dofs.T
    return made, nodes
