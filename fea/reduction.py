"""Stiffness of parts and terms, reduced to the unknowns: J'KJ on a fixed pattern."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array

from fea.links import Links
from fea.pattern import Pattern

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


class Reduction:
    """Upper triangle of J'KJ for K made of parts' patterns and of small matrices on nodes.

    Parameters
    ----------
    links
        Displacements as functions of the unknowns.
    patterns
        One for each part; parts follow one another in the numbering of the nodes.
    cells
        Nodes (m, k) of the small matrices of every term; -1 where there is none.
    """

    def __init__(self, links: Links, patterns: Sequence[Pattern], cells: Sequence[Ints] = ()) -> None:
        self._links = links
        self._number = np.full(links.size, -1, dtype=np.int64)
        self._number[links.free] = np.arange(len(links.free))
        linked = np.zeros(links.size, dtype=bool)
        linked[links.linked] = True
        self._linked = linked
        self._base = _joined(patterns, links.size)
        pattern, self._taken = self._base.restrict(links.free)
        self._extra: csr_array | None = None
        if linked.any():
            rows, columns = self._base.rows, self._base.indices
            known = self._number >= 0
            self._through = np.flatnonzero(
                (linked[rows] | linked[columns]) & (linked | known)[rows] & (linked | known)[columns]
            )
            self._ends = rows[self._through], columns[self._through]
        self._terms = [_TermPlaces(c, self._number, linked) for c in cells]
        self._settle(pattern)

    def _settle(self, pattern: Pattern) -> None:
        """Final pattern: the parts' own, with what links and terms add."""
        n, links = self._links.unknowns, self._links
        poses = np.arange(len(links.free), n)
        wanted = [poses * n + poses]
        for number in range(len(links.rigid)):
            place = np.arange(n)[links.pose_place(number)]
            first, second = np.meshgrid(place, place, indexing="ij")
            wanted.append((first * n + second)[first <= second])
        if self._linked.any():
            jacobian = abs(links.jacobian(np.full(n, 0.1), 0.5))
            jacobian.data = 1.0 + np.abs(np.sin(np.arange(len(jacobian.data))))
            ones = [np.ones(len(self._through))] if len(self._through) else []
            matrix = self._spread(ones[0] if ones else np.zeros(0), [t.ones() for t in self._terms])
            wanted.append(_keys(jacobian.T @ matrix @ jacobian, n)[0])
        wanted += [t.first * n + t.second for t in self._terms]
        extra = np.unique(np.concatenate(wanted))
        base = pattern.rows.astype(np.int64) * n + pattern.indices
        missing = extra[base[np.minimum(np.searchsorted(base, extra), len(base) - 1)] != extra] if len(base) else extra
        self._place: Ints | None = None
        if len(missing) or pattern.size != n:
            self._place = np.arange(len(base)) + np.searchsorted(missing, base)
            keys = np.insert(base, np.searchsorted(base, missing), missing)
            counts = np.bincount(keys // n, minlength=n)
            indptr = np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)
            pattern = Pattern(indptr, (keys % n).astype(np.int32))
            self._keys = keys
        else:
            self._keys = base if len(extra) else np.zeros(0, dtype=np.int64)
        self.pattern = pattern
        for term in self._terms:
            term.place = np.searchsorted(self._keys, term.first * n + term.second)

    def _spread(self, part_values: Array, terms: list[Array]) -> csr_array:
        """Symmetric matrix (3 N, 3 N) of the entries that touch linked displacements."""
        rows, columns = ([self._ends[0]], [self._ends[1]]) if self._linked.any() else ([], [])
        off = self._ends[0] != self._ends[1]
        rows, columns = [*rows, self._ends[1][off]], [*columns, self._ends[0][off]]
        values = [part_values, part_values[off]]
        for term, matrices in zip(self._terms, terms, strict=True):
            rows.append(term.through_rows)
            columns.append(term.through_columns)
            values.append(matrices.reshape(-1)[term.through])
        place = (np.concatenate(rows), np.concatenate(columns))
        return csr_array(coo_array((np.concatenate(values), place), shape=(self._links.size,) * 2))

    def reduce(
        self, data: Sequence[Array], matrices: Sequence[Array], jacobian: csr_array | None,
        blocks: Sequence[tuple[slice, Array]] = (),
    ) -> Array:  # fmt: skip
        """Values on ``pattern`` (stored,).

        Parameters
        ----------
        data
            Values on each part's pattern.
        matrices
            Of every term (m, 3k, 3k).
        jacobian
            J; None where nothing is linked.
        blocks
            Square matrices to add to some of the unknowns.
        """
        whole = data[0] if len(data) == 1 else np.concatenate(data)
        if self._place is None and not self._terms and not self._linked.any():
            return whole[self._taken]
        result = np.zeros(len(self.pattern.indices))
        result[slice(None) if self._place is None else self._place] = whole[self._taken]
        for term, matrix in zip(self._terms, matrices, strict=True):
            result += np.bincount(term.place, matrix.reshape(-1)[term.direct], len(result))
        n = self._links.unknowns
        if self._linked.any() and jacobian is not None:
            keys, values = _keys(jacobian.T @ self._spread(whole[self._through], list(matrices)) @ jacobian, n)
            np.add.at(result, np.searchsorted(self._keys, keys), values)
        for place, block in blocks:
            where = np.arange(n)[place]
            first, second = np.meshgrid(where, where, indexing="ij")
            upper = first <= second
            np.add.at(result, np.searchsorted(self._keys, (first * n + second)[upper]), block[upper])
        return result


class _TermPlaces:
    """Where the small matrices of a term go: ``direct`` between plain unknowns, ``through`` links."""

    def __init__(self, cells: Ints, number: Ints, linked: NDArray[np.bool_]) -> None:
        unknowns = np.where(cells[:, :, None] >= 0, 3 * cells[:, :, None] + np.arange(3), -1)
        unknowns = unknowns.reshape(len(cells), 3 * cells.shape[1])
        m, k = unknowns.shape
        self._shape = (m, k, k)
        rows = np.repeat(unknowns[:, :, None], k, axis=2).ravel()
        columns = np.repeat(unknowns[:, None, :], k, axis=1).ravel()
        there = (rows >= 0) & (columns >= 0)
        first, second = np.where(there, number[rows], -1), np.where(there, number[columns], -1)
        self.direct = np.flatnonzero((first >= 0) & (second >= 0) & (first <= second))
        self.first, self.second = first[self.direct], second[self.direct]
        alive = there & ((first >= 0) | linked[rows]) & ((second >= 0) | linked[columns])
        self.through = np.flatnonzero(alive & (linked[rows] | linked[columns]))
        self.through_rows, self.through_columns = rows[self.through], columns[self.through]
        self.place = np.zeros(0, dtype=np.int64)

    def ones(self) -> Array:
        """Matrices (m, 3k, 3k) full of ones, for the pattern."""
        return np.ones(self._shape)


def _joined(patterns: Sequence[Pattern], size: int) -> Pattern:
    """Patterns one after the other on the diagonal, and empty rows for the nodes of no part."""
    if len(patterns) == 1 and patterns[0].size == size:
        return patterns[0]
    indices, starts, row, stored = [], [np.zeros(1, dtype=np.int32)], 0, 0
    for pattern in patterns:
        indices.append(pattern.indices + np.int32(row))
        starts.append(pattern.indptr[1:] + np.int32(stored))
        row, stored = row + pattern.size, stored + len(pattern.indices)
    starts.append(np.full(size - row, stored, dtype=np.int32))
    return Pattern(np.concatenate(starts), np.concatenate(indices))


def _keys(matrix: csr_array, n: int) -> tuple[Ints, Array]:
    """Places row n + column of the upper triangle, and the values there."""
    entries = csr_array(matrix).tocoo()
    rows, columns = entries.coords[0].astype(np.int64), entries.coords[1].astype(np.int64)
    upper = rows <= columns
    return rows[upper] * n + columns[upper], entries.data[upper]
