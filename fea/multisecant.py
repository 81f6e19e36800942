"""Compiled multisecant correction of steps with an old tangent, as in ``fea.secant``."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Steps that are remembered.
DEPTH = 5


@njit(cache=True)
def improve(steps: Array, answers: Array, known: int, step: Array) -> int:
    """Make the tangent's ``step`` (n,) a better one (Walker & Ni 2011).

    Parameters
    ----------
    steps, answers
        Steps taken and what the tangent had proposed (DEPTH + 1, n), oldest first; updated.
    known
        How many of them are filled.

    Returns
    -------
    int
        How many are filled now.
    """
    if known > DEPTH:
        for k in range(DEPTH):
            steps[k], answers[k] = steps[k + 1], answers[k + 1]
        known = DEPTH
    answers[known] = step
    if known:
        changes = answers[1 : known + 1] - answers[:known]
        products, right = np.dot(changes, changes.T), np.dot(changes, step)
        largest = 0.0
        for k in range(known):
            largest = max(largest, products[k, k])
        for k in range(known):
            products[k, k] += 1e-12 * largest
        if largest > 0.0:
            mix = np.linalg.solve(products, right)
            changes += steps[:known]
            correction = np.dot(mix, changes)
            for k in range(len(step)):
                step[k] -= correction[k]
    steps[known] = step
    return known + 1
