"""Assembly with room for couplings between nodes that share no element."""

import numpy as np
from numpy.typing import NDArray

from fea.scatter import Scatter, make_scatter

Cells = NDArray[np.int64]


def coupled_scatter(cells: Cells, nodes: int, coupled: Cells) -> Scatter:
    """Scatter of ``cells`` (elements, k) over ``nodes`` nodes, with entries between all of the nodes ``coupled``.

    The elements write the same entries as without; what couples the nodes is for others to add.
    """
    alone = make_scatter(cells, nodes)
    if not len(coupled):
        return alone
    whole = make_scatter(np.concatenate([cells, _covering(coupled, cells.shape[1])]), nodes)
    return Scatter(whole.pattern, whole.starts[: len(cells)], whole.widths, alone.order, alone.ends)


def _covering(nodes: Cells, size: int) -> Cells:
    """Rows of ``size`` nodes such that any two of ``nodes`` share a row; some stand in a row twice."""
    half = size // 2
    blocks = np.resize(nodes, (-(-len(nodes) // half), half))
    first, second = np.triu_indices(len(blocks))
    # Rows of an odd length end with a node that they have already.
    return np.hstack([blocks[first], blocks[second], blocks[second][:, : size - 2 * half]])
