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

    def places(self, rows: NDArray[np.int64], columns: NDArray[np.int64]) -> NDArray[np.int64]:
        """Stored entry of every pair of a row and a column that is not before it.

        Raises
        ------
        ValueError
            Where the pattern does not have a pair.
        """
        stored = self.rows.astype(np.int64) * self.size + self.indices
        wanted = rows * self.size + columns
        found = np.minimum(np.searchsorted(stored, wanted), len(stored) - 1)
        if (stored[found] != wanted).any():
            raise ValueError("the pattern has no room for some of the entries")
        return found

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
