"""How strongly a result follows a swept number: range, spread, slope, correlation."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Effect:
    """What a sweep does to a result.

    Parameters
    ----------
    designs
        Number of samples with a result.
    low, high, mean
        Of the result.
    slope
        Of the straight line through all, result per swept number.
    correlation
        Pearson's, -1 to 1; NaN for a result that does not vary.
    """

    designs: int
    low: float
    high: float
    mean: float
    slope: float
    correlation: float

    @property
    def range(self) -> float:
        """Largest less smallest."""
        return self.high - self.low

    @property
    def spread(self) -> float:
        """Range over the size of the mean; NaN for a mean of nought."""
        return self.range / abs(self.mean) if self.mean else math.nan


def effect(values: Array, results: Array) -> Effect:
    """Effect of ``values`` on ``results`` (n,), those without a result left out; NaN throughout where two are missing.

    Examples
    --------
    >>> import numpy as np
    >>> found = effect(np.array([1.0, 2.0, 3.0]), np.array([2.0, 4.0, 6.0]))
    >>> found.spread, round(found.slope, 9), round(found.correlation, 9)
    (1.0, 2.0, 1.0)
    """
    known = np.isfinite(results)
    x, y = np.asarray(values, dtype=float)[known], np.asarray(results, dtype=float)[known]
    if len(x) < 2 or not np.ptp(x):
        return Effect(len(x), *[math.nan] * 5)
    slope = float(np.polyfit(x, y, 1)[0])
    correlation = float(np.corrcoef(x, y)[0, 1]) if np.ptp(y) > 1e-12 * np.abs(y).max() else math.nan
    return Effect(len(x), float(y.min()), float(y.max()), float(y.mean()), slope, correlation)


def sign_changes(values: Array, results: Array) -> list[float]:
    """Where a result crosses nought, between neighbours on a straight line, ascending.

    Examples
    --------
    >>> import numpy as np
    >>> sign_changes(np.array([0.0, 1.0, 2.0]), np.array([-1.0, 1.0, 3.0]))
    [0.5]
    """
    known = np.isfinite(results)
    x, y = np.asarray(values)[known], np.asarray(results)[known]
    found = [float(x[i]) for i in range(len(x)) if y[i] == 0]
    for i in np.flatnonzero(y[:-1] * y[1:] < 0):
        found.append(float(x[i] - y[i] * (x[i + 1] - x[i]) / (y[i + 1] - y[i])))
    return sorted(found)
