"""Fixed sparsity of a symmetric matrix with three unknowns a node: upper triangle, row by row."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

Array = NDArray[np.float64]
Indices = NDArray[np.int32]


@dataclass(frozen=True)
class Pattern:
    """Upper triangle in compressed rows, columns ascending, diagonal first.

    Parameters
    ----------
    indptr, indices
        Row starts (n + 1,) and columns (stored,).
    """

    indptr: Indices
    indices: Indices

    @property
    def size(self) -> int:
        """Number of rows."""
        return len(self.indptr) - 1

    @property
    def rows(self) -> Indices:
        """Row of every stored entry, (stored,)."""
        return np.repeat(np.arange(self.size, dtype=np.int32), np.diff(self.indptr))

    def restrict(self, kept: NDArray[np.int64]) -> tuple["Pattern", NDArray[np.int64]]:
        """Pattern of the rows and columns ``kept`` (ascending), and which stored entries it takes."""
        number = np.full(self.size, -1, dtype=np.int32)
        number[kept] = np.arange(len(kept), dtype=np.int32)
        rows, columns = number[self.rows], number[self.indices]
        taken = np.flatnonzero((rows >= 0) & (columns >= 0))
        counts = np.bincount(rows[taken], minlength=len(kept))
        indptr = np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)
        return Pattern(indptr, columns[taken]), taken

    def full(self, data: Array) -> csr_array:
        """The whole symmetric matrix whose upper triangle holds ``data`` (stored,)."""
        upper = csr_array((data, self.indices, self.indptr), shape=(self.size, self.size))
        strict = upper.copy()
        strict.data[strict.indptr[:-1]] = 0.0
        return csr_array(upper + strict.T)

    def times(self, data: Array, columns: Array) -> Array:
        """Product of the symmetric matrix with ``columns`` (n,) or (n, m)."""
        upper = csr_array((data, self.indices, self.indptr), shape=(self.size, self.size))
        diagonal = data[self.indptr[:-1]]
        scaled = diagonal * columns if columns.ndim == 1 else diagonal[:, None] * columns
        return upper @ columns + upper.T @ columns - scaled


def element_pattern(cells: NDArray[np.int64], nodes: int) -> tuple[Pattern, NDArray[np.int32]]:
    """Pattern of an assembled matrix, and the stored entry of every element entry.

    Parameters
    ----------
    cells
        Nodes of every element, (elements, k).
    nodes
        Number of nodes.

    Returns
    -------
    pattern, slots
        ``slots`` is (elements, 3k, 3k); -1 below the diagonal.
    """
    first = np.repeat(cells[:, :, None], cells.shape[1], axis=2)
    second = first.transpose(0, 2, 1)
    upper = first <= second
    keys, place = np.unique(first[upper].astype(np.int64) * nodes + second[upper], return_inverse=True)
    row, column = keys // nodes, keys % nodes
    count = np.bincount(row, minlength=nodes)
    before = np.concatenate([[0], np.cumsum(count)])[:-1]
    start = np.concatenate([[0], np.cumsum(9 * count - 3)])
    # The three rows of a node hold 3 count, 3 count - 1 and 3 count - 2 entries.
    offset = np.stack([0 * count, 3 * count, 6 * count - 1], axis=1)
    component = np.arange(3)
    block = 3 * (np.arange(len(keys)) - before[row])
    base = start[row][:, None, None] + offset[row][:, :, None] + block[:, None, None]
    slot = base + component[None, None, :] - component[None, :, None]
    below = (row == column)[:, None, None] & (component[None, :, None] > component[None, None, :])
    slot = np.where(below, -1, slot).astype(np.int32)

    indices = np.empty(start[-1], dtype=np.int32)
    values = np.broadcast_to(3 * column[:, None, None] + component[None, None, :], slot.shape)
    indices[slot[slot >= 0]] = values[slot >= 0]
    lengths = (3 * count[:, None] - component[None, :]).ravel()
    indptr = np.concatenate([[0], np.cumsum(lengths)]).astype(np.int32)

    elements, k = cells.shape
    slots = np.full((elements, k, k, 3, 3), -1, dtype=np.int32)
    slots[upper] = slot[place]
    return Pattern(indptr, indices), slots.transpose(0, 1, 3, 2, 4).reshape(elements, 3 * k, 3 * k).copy()
