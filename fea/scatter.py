"""Where element matrices go: sparsity, places of node pairs, and sets of elements that share no node."""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fea.pattern import Pattern

Array = NDArray[np.float64]
Indices = NDArray[np.int32]
Cells = NDArray[np.int64]


@dataclass(frozen=True)
class Scatter:
    """Assembly of element matrices with three unknowns a node into the upper triangle.

    Parameters
    ----------
    pattern
        Sparsity of the assembled matrix.
    starts
        (elements, k, k): stored entry of the first unknowns of a node pair; -1 where the second node comes before
        the first.
    widths
        (nodes,): pairs in the rows of a node.  Its three rows hold 3, 3 - 1 and 3 - 2 entries less the
        diagonal's lower part, so that entry (i, j) of a pair lies ``(0, 3 width - 1, 6 width - 3)[i] + j`` after
        its start.
    order, ends
        Elements (elements,) colour by colour, ascending inside each, and where each colour ends (colours,).
        Elements of one colour share no node: they may be added at the same time, and the sum of
        every entry has the same order whatever the number of threads.
    """

    pattern: Pattern
    starts: Indices
    widths: Indices
    order: Cells
    ends: Cells


def make_scatter(cells: Cells, nodes: int) -> Scatter:
    """Scatter of ``cells`` (elements, k) over ``nodes`` nodes."""
    begins, uses = _uses(cells, nodes)
    widths, columns, starts = _pairs(cells, nodes, begins, uses)
    lengths = np.maximum(3 * widths[:, None] - np.arange(3), 0).ravel()
    indptr = np.concatenate([[0], np.cumsum(lengths)]).astype(np.int32)
    pattern = Pattern(indptr, _columns(indptr, widths, columns))
    colours = _colours(cells, begins, uses)
    order = np.argsort(colours, kind="stable")
    return Scatter(pattern, starts, widths, order, np.cumsum(np.bincount(colours)))


@njit(cache=True)
def _uses(cells: Cells, nodes: int) -> tuple[Cells, Cells]:
    """Entries of ``cells.ravel()`` that name each node: where they begin (nodes + 1,), and which."""
    flat = cells.ravel()
    begins = np.zeros(nodes + 1, np.int64)
    for entry in range(len(flat)):
        begins[flat[entry] + 1] += 1
    for node in range(nodes):
        begins[node + 1] += begins[node]
    uses, filled = np.empty(len(flat), np.int64), begins[:-1].copy()
    for entry in range(len(flat)):
        uses[filled[flat[entry]]] = entry
        filled[flat[entry]] += 1
    return begins, uses


@njit(cache=True)
def _pairs(cells: Cells, nodes: int, begins: Cells, uses: Cells) -> tuple[Indices, Indices, Indices]:
    """Upper neighbours of every node (itself among them): how many, which; and ``starts``."""
    elements, k = cells.shape
    starts = np.full((elements, k, k), -1, np.int32)
    widths, seen, place = np.zeros(nodes, np.int32), np.full(nodes, -1, np.int64), np.zeros(nodes, np.int64)
    columns, found, first = np.empty(len(uses) * k, np.int32), 0, 0
    for node in range(nodes):
        begin = found
        for entry in uses[begins[node] : begins[node + 1]]:
            for other in cells[entry // k]:
                if other >= node and seen[other] != node:
                    seen[other] = node
                    columns[found] = other
                    found += 1
        columns[begin:found].sort()
        for n in range(begin, found):
            place[columns[n]] = first + 3 * (n - begin)
        for entry in uses[begins[node] : begins[node + 1]]:
            for b in range(k):
                if cells[entry // k, b] >= node:
                    starts[entry // k, entry % k, b] = place[cells[entry // k, b]]
        widths[node] = found - begin
        first += max(9 * (found - begin) - 3, 0)
    return widths, columns[:found].copy(), starts


@njit(cache=True)
def _columns(indptr: Indices, widths: Indices, columns: Indices) -> Indices:
    """Columns of all stored entries."""
    result, pair = np.empty(indptr[-1], np.int32), 0
    for node in range(len(widths)):
        for axis in range(3):
            place = indptr[3 * node + axis]
            for n in range(widths[node]):
                for component in range(axis if n == 0 else 0, 3):
                    result[place] = 3 * columns[pair + n] + component
                    place += 1
        pair += widths[node]
    return result


@njit(cache=True)
def _colours(cells: Cells, begins: Cells, uses: Cells) -> Cells:
    """Smallest colour that no earlier element at the same nodes has, (elements,)."""
    elements, k = cells.shape
    colours = np.full(elements, -1, np.int64)
    taken = np.full(elements + 1, -1, np.int64)
    for e in range(elements):
        for node in cells[e]:
            for entry in uses[begins[node] : begins[node + 1]]:
                if colours[entry // k] >= 0:
                    taken[colours[entry // k]] = e
        colour = 0
        while taken[colour] == e:
            colour += 1
        colours[e] = colour
    return colours
