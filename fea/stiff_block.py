"""A mesh with a prismatic block put on one of its flat boundaries, to hold what is rigid there."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from meshes.gathering import HEXAHEDRON, QUADRILATERAL, element_places, gathered

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

#: Corners of a facet in order around it, by their reference coordinates.
_AROUND = {2: np.array([[0], [1]]), 3: np.array([[0, 0], [1, 0], [1, 1], [0, 1]])}


def with_block(mesh: Any, boundary: str, along: Array, name: str) -> Any:
    """The mesh with one element more on every facet of a boundary, straight along ``along``.

    Parameters
    ----------
    mesh
        ``MeshHex2``, or ``MeshQuad2`` in space; its elements keep their numbers, its boundaries their names.
    boundary
        Flat and crossed by ``along``; it stays where it is, between the elements.
    along
        From the boundary to the end of the block (3,), m.
    name
        Of the subdomain that holds the new elements.
    """
    kind = QUADRILATERAL if mesh.elem.refdom.dim() == 2 else HEXAHEDRON
    corners, places = mesh.t[: kind.corners].T.astype(np.int64), element_places(mesh)
    facets = np.array([_around(mesh, kind.dimension, int(f), along) for f in mesh.boundaries[boundary]])
    # Reference coordinates of a new element: from the facet to the end first, then those of the facet.
    off, on = kind.reference[:, :1], kind.reference[:, 1:]
    shapes = np.stack([np.prod(np.where(corner, on, 1.0 - on), axis=1) for corner in _AROUND[kind.dimension]], axis=1)
    new_places = shapes @ mesh.doflocs[:, facets].transpose(1, 2, 0) + off * along
    nearest = np.argmax(shapes[: kind.corners], axis=1)
    ahead = mesh.doflocs.shape[1] * (off[: kind.corners, 0] > 0.5).astype(np.int64)
    new_corners = facets[:, nearest] + ahead
    named = {key: mesh.facets[:, found].T.astype(np.int64) for key, found in mesh.boundaries.items()}
    added = np.arange(len(corners), len(corners) + len(facets))
    return gathered(kind, np.vstack([corners, new_corners]), np.concatenate([places, new_places]), named, {name: added})


def _around(mesh: Any, dimension: int, facet: int, along: Array) -> Ints:
    """Corners of a facet such that the new element has the orientation of its neighbour."""
    corners = mesh.facets[:, facet].astype(np.int64)
    if dimension == 2:
        cell = mesh.t[:4, mesh.f2t[0, facet]].tolist()
        first = next(i for i in range(4) if {cell[i], cell[(i + 1) % 4]} == set(corners.tolist()))
        return np.array([cell[first], cell[(first + 1) % 4]], dtype=np.int64)
    arms = mesh.doflocs[:, corners].T - mesh.doflocs[:, corners].mean(axis=1)
    angles = np.arctan2(np.cross(arms[0], arms) @ along / np.linalg.norm(along), arms @ arms[0])
    return np.asarray(corners[np.argsort(angles)])
