"""Compiled LDL' factorisation and solution of symmetric banded systems, for small problems solved very often.

Rows are stored from left to right and end at the diagonal: ``rows[i, width + j - i]`` is the entry (i, j),
``first[i]`` the first column of row i that is not zero.  Single precision will do where the solution is only a
step of an iteration: it halves the memory that passes through the processor.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

_SUMS = {"reassoc", "contract", "nsz"}


def envelope(rows: Ints, columns: Ints, size: int) -> tuple[Ints, int]:
    """First column of every row (size,), and the largest distance from the diagonal, of a symmetric pattern."""
    first = np.arange(size)
    np.minimum.at(first, np.maximum(rows, columns), np.minimum(rows, columns))
    return first, int((np.arange(size) - first).max(initial=0))


@njit(cache=True, fastmath=_SUMS)
def factorise(rows: NDArray[np.float32], first: Ints, pivots: NDArray[np.float32]) -> bool:
    """Replace ``rows`` by L, ``pivots`` (n,) by 1/D; False where a pivot vanishes or is not finite."""
    width = rows.shape[1] - 1
    for i in range(len(rows)):
        row, start = rows[i], first[i]
        for j in range(start, i):
            low = max(start, first[j])
            mine, other = row[width - i + low : width - i + j], rows[j, width - j + low : width]
            total = row[width] * 0
            for k in range(len(mine)):
                total += mine[k] * other[k]
            row[width - i + j] -= total
        diagonal = row[width]
        for j in range(start, i):
            scaled = row[width - i + j] * pivots[j]
            diagonal -= row[width - i + j] * scaled
            row[width - i + j] = scaled
        if not np.isfinite(diagonal) or diagonal == 0:
            return False
        pivots[i] = 1 / diagonal
    return True


@njit(cache=True, fastmath=_SUMS)
def solve(rows: NDArray[np.float32], first: Ints, pivots: NDArray[np.float32], right: NDArray[np.float32]) -> None:
    """Replace ``right`` (n,) by the solution."""
    width = rows.shape[1] - 1
    for i in range(len(rows)):
        row, known = rows[i, width - i + first[i] : width], right[first[i] : i]
        total = right[i] * 0
        for k in range(len(row)):
            total += row[k] * known[k]
        right[i] -= total
    for i in range(len(rows)):
        right[i] *= pivots[i]
    for i in range(len(rows) - 1, -1, -1):
        row, others, here = rows[i, width - i + first[i] : width], right[first[i] : i], right[i]
        for k in range(len(row)):
            others[k] -= row[k] * here
