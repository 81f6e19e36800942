"""Mesh files, and meshio's meshes, to scikit-fem meshes."""

from collections.abc import Iterator
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from meshes.gathering import HEXAHEDRON, QUADRILATERAL, TETRAHEDRON, Kind, MeshError, gathered
from meshes.node_order import vtk_reference
from meshes.orienting import oriented

if TYPE_CHECKING:
    from skfem import MeshHex2, MeshQuad2, MeshTet2

Numbers = NDArray[np.int64]

#: Cells that are taken as they are, by meshio's name.
_COMPLETE = {kind.name: kind for kind in (HEXAHEDRON, TETRAHEDRON, QUADRILATERAL)}
#: Cells whose shape a complete quadratic cell repeats exactly, when asked.
_POORER = {
    "hexahedron": HEXAHEDRON, "hexahedron20": HEXAHEDRON, "tetra": TETRAHEDRON,
    "quad": QUADRILATERAL, "quad8": QUADRILATERAL,
}  # fmt: skip
_FACETS = {
    "hexahedron27": ("quad", "quad8", "quad9"),
    "tetra10": ("triangle", "triangle6"),
    "quad9": ("line", "line3"),
}
_VOLUMES = ("hexahedron", "tetra", "wedge", "pyramid")
_SURFACES = ("quad", "triangle")


def read_mesh(path: Path, promote: bool = False, group: str | None = None) -> "MeshHex2 | MeshTet2 | MeshQuad2":
    """Mesh of a file that gmsh wrote (``.msh``) or that meshio can read, as in ``from_meshio``."""
    import meshio

    data = meshio.read(path, file_format="gmsh" if path.suffix == ".msh" else None)
    try:
        return from_meshio(data, promote, group)
    except MeshError as error:
        raise MeshError(f"{path}: {error}") from None


def from_meshio(data: Any, promote: bool = False, group: str | None = None) -> "MeshHex2 | MeshTet2 | MeshQuad2":
    """Mesh of 27-node hexahedra, 10-node tetrahedra or, where there are no solids, 9-node quadrilaterals.

    Parameters
    ----------
    data
        ``meshio.Mesh``; m.
    promote
        Take linear and serendipity cells: the same shape, with the missing nodes put in.  What is
        curved in truth and straight in the file stays straight.
    group
        Take only the cells of this group: one part of several.

    Returns
    -------
    MeshHex2, MeshTet2 or MeshQuad2
        ``boundaries`` holds the groups of surfaces (of lines for quadrilaterals): gmsh's physical groups,
        meshio's cell sets, and node sets that hold whole facets; ``subdomains`` the groups of cells.

    Raises
    ------
    MeshError
        Says how to make the mesh that is missing.
    """
    name, kind = _cell_type(data, promote)
    cells = np.concatenate([block.data for block in data.cells if block.type == name]).astype(np.int64)
    subdomains = {label: np.concatenate(found) for label, found in _groups(data, (name,), kind.dimension).items()}
    facets = _groups(data, _FACETS[kind.name], kind.dimension - 1, kind.facet_corners)
    kept = np.arange(len(cells))
    if group is not None:
        if group not in subdomains:
            raise MeshError(f"no group {group!r} of {name} cells; there is {', '.join(sorted(subdomains)) or 'none'}")
        kept = np.unique(subdomains.pop(group))
    points = np.zeros((len(data.points), 3))
    points[:, : data.points.shape[1]] = data.points
    corners = cells[kept][:, _corner_order(kind)]
    places = np.einsum("ks,esc->ekc", _filling(kind, cells.shape[1]), points[cells[kept]])
    if kind is QUADRILATERAL:
        corners, places = oriented(corners, places)
    boundaries = {label: np.concatenate(rows) for label, rows in facets.items()}
    if group is not None:
        inside = {label: rows[np.isin(rows, corners).all(axis=1)] for label, rows in boundaries.items()}
        boundaries = {label: rows for label, rows in inside.items() if len(rows)}
    subdomains = {label: np.flatnonzero(np.isin(kept, found)) for label, found in subdomains.items()}
    mesh = gathered(kind, corners, places, boundaries, subdomains)
    return mesh.with_boundaries(_node_sets(data, mesh, np.unique(corners)))


def _cell_type(data: Any, promote: bool) -> tuple[str, Kind]:
    types = {block.type for block in data.cells if len(block.data)}
    found = sorted(t for t in types if t.startswith(_VOLUMES)) or sorted(t for t in types if t.startswith(_SURFACES))
    wanted = "27-node hexahedra, 10-node tetrahedra or, for a shell, 9-node quadrilaterals"
    if not found:
        raise MeshError(f"the mesh holds {', '.join(sorted(types)) or 'no cells'}; {wanted} are needed")
    if len(found) > 1:
        raise MeshError(
            f"the mesh mixes {', '.join(found)}; a part takes one kind of cell: read each kind from a file of its own "
            "and tie the parts, or remesh with one kind"
        )
    (name,) = found
    if name in _COMPLETE:
        return name, _COMPLETE[name]
    if name in _POORER and promote:
        return name, _POORER[name]
    if name in _POORER:
        raise MeshError(
            f"the mesh holds {name} cells; {wanted} are needed: in gmsh set Mesh.ElementOrder = 2 and "
            "Mesh.SecondOrderIncomplete = 0, or read with promote=True, which puts the missing nodes in and keeps "
            "the shape that the file has, straight edges included"
        )
    how = "recombine triangles (Mesh.RecombineAll = 1)" if name.startswith("triangle") else "mesh the body anew"
    raise MeshError(f"the mesh holds {name} cells, for which there is no element; {wanted} are needed: {how}")


def _groups(data: Any, types: tuple[str, ...], dimension: int, rows: int = 0) -> dict[str, list[Numbers]]:
    """Named groups of cells of some types: their numbers among those cells, or their first ``rows`` nodes."""
    result: dict[str, list[Numbers]] = {}
    for name, per_block in _named(data, dimension):
        before = 0
        for block, members in zip(data.cells, per_block, strict=True):
            if block.type in types:
                if members is not None and len(members):
                    found = block.data[members, :rows] if rows else before + np.asarray(members)
                    result.setdefault(name, []).append(np.asarray(found, dtype=np.int64))
                before += len(block.data)
    return result


def _named(data: Any, dimension: int) -> Iterator[tuple[str, list[Any]]]:
    tags = data.cell_data.get("gmsh:physical")
    for name, (tag, of) in data.field_data.items():
        if tags is not None and of == dimension:
            yield name, [np.flatnonzero(np.asarray(block) == tag) for block in tags]
    for name, per_block in data.cell_sets.items():
        if not name.startswith("gmsh:") and name not in data.field_data:
            yield name, per_block


def _node_sets(data: Any, mesh: Any, used: Numbers) -> dict[str, Numbers]:
    """Outer facets whose corners all lie in a node set."""
    outer = mesh.boundary_facets()
    result = {}
    for name, nodes in data.point_sets.items():
        inside = np.isin(used[mesh.facets[:, outer]], nodes).all(axis=0)
        if inside.any() and name not in (mesh.boundaries or {}):
            result[name] = outer[inside].astype(np.int64)
    return result


def _exponents(kind: Kind, nodes: int) -> list[tuple[int, ...]]:
    """Monomials that ``nodes`` nodes span: linear, serendipity or complete quadratic."""
    every = list(product(range(3), repeat=kind.dimension))
    if kind is TETRAHEDRON:
        return [e for e in every if sum(e) <= (1 if nodes == kind.corners else 2)]
    if nodes == kind.corners:
        return [e for e in every if max(e) <= 1]
    # Serendipity: superlinear degree at most two (Arnold & Awanou 2011).
    return [e for e in every if nodes == len(every) or sum(n for n in e if n > 1) <= 2]


def _file_reference(kind: Kind) -> NDArray[np.float64]:
    """Reference coordinates of the nodes in meshio's (VTK's) order."""
    # The quadratic tetrahedron and quadrilateral of scikit-fem have VTK's order.
    return vtk_reference() if kind is HEXAHEDRON else kind.reference


def _filling(kind: Kind, nodes: int) -> NDArray[np.float64]:
    """Weights of a file's ``nodes`` at the nodes of the complete cell (complete, nodes)."""
    exponents = np.array(_exponents(kind, nodes))

    def monomials(at: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray((at[:, None, :] ** exponents).prod(axis=2))

    source = _file_reference(kind)[:nodes]
    # All weights are multiples of 1/8.
    return np.round(8 * np.linalg.solve(monomials(source).T, monomials(kind.reference).T).T) / 8


def _corner_order(kind: Kind) -> Numbers:
    """Places of scikit-fem's corners among a file's."""
    corners = _file_reference(kind)[: kind.corners]
    return np.array([int(np.flatnonzero((corners == at).all(axis=1))[0]) for at in kind.reference[: kind.corners]])
