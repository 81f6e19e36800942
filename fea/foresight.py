"""Guess of the next of equally spaced vectors: a polynomial through the last ones, corrected by what it missed before.

The error of extrapolating a sampled smooth motion is itself a sum of the same decaying oscillations.  Its linear
dependence on the last differences is learnt by least squares from the last steps (linear prediction, Prony 1795),
which repeats a periodic motion almost exactly.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

#: Values that a guess is made of, and past guesses that it learns from.
ORDER, LESSONS = 6, 12
_KEPT = ORDER + LESSONS + 1
_SUMS = {"reassoc", "contract", "nsz"}


class Trail(NamedTuple):
    """The last vectors in a ring (kept, n), their scalar products (kept, kept), ``[place of the newest, count]``."""

    vectors: Array
    products: Array
    place: Ints


def trail(size: int) -> Trail:
    """Empty trail of vectors (size,)."""
    return Trail(np.zeros((_KEPT, size)), np.zeros((_KEPT, _KEPT)), np.array([_KEPT - 1, 0]))


@njit(cache=True, fastmath=_SUMS)
def remember(trail: Trail, vector: Array) -> None:
    """Add the newest vector (n,)."""
    place = (trail.place[0] + 1) % _KEPT
    trail.place[0], trail.place[1] = place, min(trail.place[1] + 1, _KEPT)
    newest = trail.vectors[place]
    newest[:] = vector
    for other in range(_KEPT):
        total, old = 0.0, trail.vectors[other]
        for k in range(len(newest)):
            total += newest[k] * old[k]
        trail.products[place, other] = trail.products[other, place] = total


@njit(cache=True)
def forget(trail: Trail) -> None:
    """Empty the trail: what follows has another spacing."""
    trail.place[1] = 0


@njit(cache=True)
def _differences(order: int) -> Array:
    """Weights (order + 1, order + 1) of the backward differences, newest vector first."""
    weights = np.zeros((order + 1, order + 1))
    weights[0, 0] = 1.0
    for k in range(1, order + 1):
        for i in range(k + 1):
            weights[k, i] = weights[k - 1, i] - (weights[k - 1, i - 1] if i > 0 else 0.0)
    return weights


@njit(cache=True)
def _learnt(trail: Trail, weights: Array) -> Array:
    """Share (ORDER,) of every difference that extrapolation has lately left out."""
    products, p = np.empty((_KEPT, _KEPT)), ORDER
    for i in range(_KEPT):
        for j in range(_KEPT):
            products[i, j] = trail.products[(trail.place[0] - i) % _KEPT, (trail.place[0] - j) % _KEPT]
    matrix, right = np.zeros((p, p)), np.zeros(p)
    few = np.ascontiguousarray(weights[:p, :p])
    for lesson in range(LESSONS):
        below = np.ascontiguousarray(products[lesson + 1 : lesson + 1 + p, lesson : lesson + 1 + p])
        through = np.dot(few, below)
        matrix += np.dot(np.ascontiguousarray(through[:, 1:]), few.T)
        right += np.dot(through, weights[p])
    largest = 0.0
    for k in range(p):
        largest = max(largest, matrix[k, k])
    if not largest > 0.0:
        return right
    for k in range(p):
        matrix[k, k] += 1e-6 * matrix[k, k] + 1e-15 * largest
    right[:] = np.linalg.solve(matrix, right)
    return right


@njit(cache=True)
def guess(trail: Trail, result: Array) -> bool:
    """Put the next vector into ``result`` (n,); False where fewer than four are known."""
    known = trail.place[1]
    if known < 4:
        return False
    full = known == _KEPT
    order = ORDER if full else 4
    weights = _differences(ORDER)
    shares = np.ones(order)
    if full:
        shares += _learnt(trail, weights)
    result[:] = 0.0
    for i in range(order):
        weight = 0.0
        for k in range(i, order):
            weight += shares[k] * weights[k, i]
        vector = trail.vectors[(trail.place[0] - i) % _KEPT]
        for k in range(len(result)):
            result[k] += weight * vector[k]
    return True
