"""One side of a surface of quadrilaterals made the upper one everywhere."""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import breadth_first_order, connected_components

from meshes.gathering import MeshError

Array = NDArray[np.float64]
Numbers = NDArray[np.int64]

#: A nine-node quadrilateral seen from below.
_TURNED = np.array([0, 3, 2, 1, 7, 6, 5, 4, 8])


def oriented(corners: Numbers, places: Array) -> tuple[Numbers, Array]:
    """Corners (cells, 4) and places (cells, 9, 3) with normals that agree across edges.

    The first cell of each connected sheet keeps its normal.

    Raises
    ------
    MeshError
        A surface with one side only, as a Moebius strip.
    """
    first, second, opposed = _neighbours(corners)
    count = len(corners)
    graph = coo_array((np.ones(2 * len(first)), (np.r_[first, second], np.r_[second, first])), (count, count)).tocsr()
    agree = {(int(a), int(b)): bool(o) for a, b, o in zip(first, second, opposed, strict=True)}
    turned = np.zeros(count, dtype=bool)
    _, labels = connected_components(graph)
    for start in np.unique(labels, return_index=True)[1]:
        order, parent = breadth_first_order(graph, int(start))
        for cell in order[1:]:
            pair = (int(parent[cell]), int(cell))
            same = agree[pair] if pair in agree else agree[pair[::-1]]
            turned[cell] = turned[parent[cell]] ^ (not same)
    if (turned[first] ^ turned[second] == opposed).any():
        raise MeshError("the surface has one side only; a shell needs an upper and a lower one")
    corners, places = corners.copy(), places.copy()
    corners[turned] = corners[turned][:, _TURNED[:4]]
    places[turned] = places[turned][:, _TURNED]
    return corners, places


def _neighbours(corners: Numbers) -> tuple[Numbers, Numbers, NDArray[np.bool_]]:
    """Pairs of cells with a common edge, and whether they run through it in opposite senses, as they should."""
    ends = np.stack([corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 2)
    owner = np.repeat(np.arange(len(corners)), 4)
    upward = ends[:, 0] < ends[:, 1]
    ends = np.sort(ends, axis=1)
    order = np.lexsort(ends.T)
    same = np.flatnonzero((ends[order[1:]] == ends[order[:-1]]).all(axis=1))
    one, other = order[same], order[same + 1]
    return owner[one], owner[other], upward[one] != upward[other]
