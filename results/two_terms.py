"""Fit of a sum of two exponentials, the law that 4.5.3 puts through stiffness over the state of the fin."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

Array = NDArray[np.float64]

#: Largest rate: over a range of 1 a term may grow or fall by e^8 at most, beyond which it follows a single point.
_FASTEST = 8.0
_STARTS = (-4.0, -1.0, 1.0, 4.0)


@dataclass(frozen=True)
class TwoTerms:
    """K(s) = a exp(b s) + c exp(d s).

    Parameters
    ----------
    a, b, c, d
        In units of the result, and per unit of s.
    misfit
        Root mean square over the largest result.
    spare
        Points beyond the four numbers: 0 says that any four points are met.
    """

    a: float
    b: float
    c: float
    d: float
    misfit: float
    spare: int

    def __call__(self, s: Array) -> Array:
        """K at s (n,)."""
        return np.asarray(self.a * np.exp(self.b * s) + self.c * np.exp(self.d * s))


def two_term_fit(s: Array, results: Array) -> TwoTerms | None:
    """The fit to points without NaN; None for fewer than four, or where nothing comes out.

    Amplitudes follow from the rates by linear least squares, so that only two numbers are searched.
    """
    known = np.isfinite(s) & np.isfinite(results)
    x, y = np.asarray(s, dtype=float)[known], np.asarray(results, dtype=float)[known]
    if len(x) < 4:
        return None
    size = float(np.abs(y).max()) or 1.0

    def off(rates: Array) -> Array:
        terms = np.exp(np.outer(x, rates))
        return np.asarray(terms @ np.linalg.lstsq(terms, y / size, rcond=None)[0] - y / size)

    pairs = [(b, d) for i, b in enumerate(_STARTS) for d in _STARTS[i + 1 :]]
    tried = [least_squares(off, pair, bounds=(-_FASTEST, _FASTEST)) for pair in pairs]
    best = min(tried, key=lambda result: float(result.cost))
    b, d = sorted(map(float, best.x))
    a, c = (float(share) * size for share in np.linalg.lstsq(np.exp(np.outer(x, [b, d])), y / size, rcond=None)[0])
    misfit = float(np.sqrt(np.mean(off(np.array([b, d])) ** 2)))
    return TwoTerms(a, b, c, d, misfit, len(x) - 4)
