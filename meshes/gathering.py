"""Cells with their own node positions to a scikit-fem mesh, checked."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Numbers = NDArray[np.int64]


@dataclass(frozen=True)
class Kind:
    """A complete quadratic cell.

    Parameters
    ----------
    name
        meshio's name of it.
    dimension
        Of its reference cell; a surface in space has 2.
    corners, facet_corners
        Of the cell, and of each of its facets.
    element, linear, quadratic
        scikit-fem's names of the element and of the meshes with straight and with curved edges.
    """

    name: str
    dimension: int
    corners: int
    facet_corners: int
    element: str
    linear: str
    quadratic: str

    @cached_property
    def reference(self) -> Array:
        """Reference coordinates of the nodes in scikit-fem's order (nodes, dimension)."""
        import skfem

        return np.asarray(getattr(skfem, self.element).doflocs, dtype=float)


HEXAHEDRON = Kind("hexahedron27", 3, 8, 4, "ElementHex2", "MeshHex", "MeshHex2")
TETRAHEDRON = Kind("tetra10", 3, 4, 3, "ElementTetP2", "MeshTet", "MeshTet2")
QUADRILATERAL = Kind("quad9", 2, 4, 2, "ElementQuad2", "MeshQuad", "MeshQuad2")
KINDS = (HEXAHEDRON, TETRAHEDRON, QUADRILATERAL)


class MeshError(ValueError):
    """A mesh that the engine cannot take; says which element or group, and what to do."""


def gathered(
    kind: Kind, corners: Numbers, places: Array,
    boundaries: Mapping[str, Numbers] | None = None, subdomains: Mapping[str, Numbers] | None = None,
) -> Any:  # fmt: skip
    """Mesh of cells that say where all their nodes lie.

    Parameters
    ----------
    kind
        Kind of all cells.
    corners
        Numbers of the corners (cells, corners), in scikit-fem's order; equal numbers join cells.
    places
        Positions of the nodes (cells, nodes, 3), in scikit-fem's order; m.
    boundaries
        Named facets by their corner numbers (facets, facet corners), any order.
    subdomains
        Named cells by number.

    Returns
    -------
    MeshHex2, MeshTet2 or MeshQuad2
        The last with positions in space.

    Raises
    ------
    MeshError
        Folded or turned-over cells, neighbours that do not fit, facets without a cell.
    """
    import skfem
    from skfem.assembly import Dofs

    used, cells = np.unique(corners, return_inverse=True)
    cells = np.ascontiguousarray(cells.reshape(corners.shape).T, dtype=np.int32)
    straight = np.empty((3, len(used)))
    straight[:, cells] = places[:, : kind.corners].T
    _check_shapes(kind, places)
    _check_edges(kind, cells)
    numbers = Dofs(getattr(skfem, kind.linear)(straight, cells), getattr(skfem, kind.element)()).element_dofs
    points = np.empty((3, int(numbers.max()) + 1))
    points[:, numbers] = places.transpose(2, 1, 0)
    _check_fit(points[:, numbers].transpose(2, 1, 0), places)
    mesh = getattr(skfem, kind.quadratic)(points, cells)
    named = {name: _facets(mesh, np.searchsorted(used, facets), name) for name, facets in (boundaries or {}).items()}
    return mesh.with_boundaries(named).with_subdomains(dict(subdomains or {}))


def _facets(mesh: Any, wanted: Numbers, name: str) -> Numbers:
    """Numbers of the facets with the given corners."""
    known = np.sort(mesh.facets, axis=0).T
    both = np.vstack([known, np.sort(wanted, axis=1)])
    _, first, place = np.unique(both, axis=0, return_index=True, return_inverse=True)
    found = first[place.ravel()[len(known) :]]
    if (found >= len(known)).any():
        raise MeshError(f"group {name!r} holds facets that belong to no element of the body")
    return np.unique(found).astype(np.int64)


def jacobians(kind: Kind, places: Array, order: int = 5) -> Array:
    """Volume (area) of the cell over that of its reference at quadrature points (cells, points), m^3 (m^2).

    Negative where a solid cell is turned over, or where a surface cell is folded against its centre.
    """
    import skfem
    from skfem.quadrature import get_quadrature

    element = getattr(skfem, kind.element)()
    local, _ = get_quadrature(element.refdom, order)
    local = np.column_stack([np.full(kind.dimension, 1 / (4 if kind is TETRAHEDRON else 2)), local, kind.reference.T])
    slopes = np.stack([np.asarray(element.lbasis(local, n)[1]) for n in range(len(kind.reference))])
    frames = np.einsum("njq,enc->eqjc", slopes, places)
    if kind.dimension == 3:
        return np.linalg.det(frames)
    normals = np.cross(frames[:, :, 0], frames[:, :, 1])
    sense = np.sign(np.einsum("eqc,ec->eq", normals, normals[:, 0]))
    return sense * np.linalg.norm(normals, axis=2)


def _check_shapes(kind: Kind, places: Array) -> None:
    if not np.isfinite(places).all():
        raise MeshError(f"element {int(np.argwhere(~np.isfinite(places))[0, 0])} has a node that is nowhere")
    worst = jacobians(kind, places).min(axis=1)
    if (worst <= 0).any():
        bad = np.flatnonzero(worst <= 0)
        centre = ", ".join(f"{x:.4g}" for x in places[bad[0]].mean(axis=0))
        raise MeshError(
            f"{len(bad)} of {len(places)} elements are inverted or folded, the first is element {bad[0]} "
            f"(from 0) about ({centre}) m: mesh more finely where the boundary is curved, or turn its node order round"
        )


def _check_edges(kind: Kind, cells: NDArray[np.integer[Any]]) -> None:
    if kind.dimension == 3:
        return
    edges = np.sort(np.stack([cells, np.roll(cells, -1, axis=0)]).reshape(2, -1), axis=0)
    _, counts = np.unique(edges, axis=1, return_counts=True)
    if counts.max() > 2:
        raise MeshError(
            "more than two surface elements meet at an edge: make each smooth sheet a part of its own and tie them"
        )


def _check_fit(joined: Array, places: Array) -> None:
    size = np.ptp(places, axis=1).max(axis=1)
    gap = np.abs(joined - places).max(axis=(1, 2)) / size
    if (gap > 1e-6).any():
        raise MeshError(
            f"element {int(np.argmax(gap))} (from 0) and a neighbour place the nodes of their common edge or face "
            f"{gap.max():.2g} of its size apart"
        )


def element_places(mesh: Any) -> Array:
    """Positions of the nodes of every cell (cells, nodes, 3), m, in scikit-fem's order."""
    return np.ascontiguousarray(mesh.doflocs[:, mesh.dofs.element_dofs].transpose(2, 1, 0))
