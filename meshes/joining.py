"""Several meshes made one where their nodes coincide."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from meshes.gathering import KINDS, Kind, MeshError, element_places, gathered

Array = NDArray[np.float64]
Numbers = NDArray[np.int64]


def joined(meshes: Mapping[str, Any], near: float = 1e-6) -> Any:
    """Meshes of one kind merged where corners of different meshes coincide.

    Faces (edges of surfaces) that are to be merged must carry the same mesh on both sides.

    Parameters
    ----------
    meshes
        By name; each becomes a subdomain of that name.  Boundaries of the same name are united, those
        that are merged away inside keep their name.
    near
        Corners closer than this share of the shortest corner distance in a cell are one.

    Returns
    -------
    MeshHex2, MeshTet2 or MeshQuad2

    Raises
    ------
    MeshError
        Different kinds of cells, faces that do not fit, or nothing to merge.
    """
    kind = _common_kind(meshes)
    numbers = _merged_corners(list(meshes.values()), near)
    corners: list[Numbers] = []
    boundaries: dict[str, list[Numbers]] = {}
    subdomains: dict[str, list[Numbers]] = {}
    before = 0
    for (name, mesh), mine in zip(meshes.items(), numbers, strict=True):
        corners.append(mine[mesh.t.T])
        for boundary, facets in (mesh.boundaries or {}).items():
            boundaries.setdefault(boundary, []).append(mine[mesh.facets[:, facets].T])
        for part, cells in [*(mesh.subdomains or {}).items(), (name, np.arange(mesh.t.shape[1]))]:
            subdomains.setdefault(part, []).append(before + np.asarray(cells))
        before += mesh.t.shape[1]
    return gathered(
        kind, np.concatenate(corners), np.concatenate([element_places(mesh) for mesh in meshes.values()]),
        {name: np.concatenate(found) for name, found in boundaries.items()},
        {name: np.unique(np.concatenate(found)) for name, found in subdomains.items()},
    )  # fmt: skip


def _common_kind(meshes: Mapping[str, Any]) -> Kind:
    names = {type(mesh).__name__ for mesh in meshes.values()}
    kinds = [kind for kind in KINDS if kind.quadratic in names]
    if len(names) != 1 or not kinds:
        raise MeshError(f"meshes of {', '.join(sorted(names))} cannot be merged; one quadratic kind can: tie parts")
    return kinds[0]


def _merged_corners(meshes: list[Any], near: float) -> list[Numbers]:
    """Common number of every corner of every mesh."""
    points = [mesh.p[:, : int(mesh.t.max()) + 1].T for mesh in meshes]
    owner = np.repeat(np.arange(len(meshes)), [len(p) for p in points])
    every = np.concatenate(points)
    shortest = min(
        float(np.linalg.norm(mesh.p[:, mesh.facets[0]] - mesh.p[:, mesh.facets[1]], axis=0).min()) for mesh in meshes
    )
    pairs = cKDTree(every).query_pairs(near * shortest, output_type="ndarray")
    pairs = pairs[owner[pairs[:, 0]] != owner[pairs[:, 1]]]
    if len(meshes) > 1 and not len(pairs):
        raise MeshError("the meshes have no corner in common")
    links = coo_array((np.ones(len(pairs)), pairs.T), (len(every), len(every)))
    labels = connected_components(links, directed=False)[1].astype(np.int64)
    return np.split(labels, np.cumsum([len(p) for p in points])[:-1])
