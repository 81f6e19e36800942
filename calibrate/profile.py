"""Profile likelihood: how well the best other parameters can make up for a wrong value of one."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.objective import Problem
from calibrate.search import polish
from calibrate.uncertainty import Uncertainty

Array = NDArray[np.float64]
#: 95 % quantile of chi^2 with one degree of freedom.
THRESHOLD = 3.841
#: Places at which a profile is computed on each side, in standard errors, until it has risen above the threshold.
_STEPS = (0.7, 1.4, 2.1, 2.8, 4.0, 6.0, 9.0, 14.0)
_COUNT = 15
#: Standard error, as a share of the range, from which on it is no guide.
_WIDE = 0.5
#: Shares of the range where there is no standard error to go by.
_SHARES = (0.01, 0.03, 0.1, 0.2, 0.35, 0.5, 0.75, 1.0)


@dataclass(frozen=True)
class Profile:
    """Of one parameter.

    Parameters
    ----------
    name, unit
        Of the parameter, SI.
    values
        Rising, (k,), SI; the optimum is among them.
    rise
        By how much the best sum of squares with that value exceeds the optimum's, in units that make it
        ((value - optimum) / standard error)^2 for a linear model, (k,).
    interval
        Where ``rise`` stays below ``THRESHOLD``: 95 %, SI.
    open_sides
        ``lower`` and ``upper``, where the bound of the search is met first.
    """

    name: str
    unit: str
    values: tuple[float, ...]
    rise: tuple[float, ...]
    interval: tuple[float, float]
    open_sides: tuple[str, ...]


def profile(
    problem: Problem, unit: Array, residual: Array, derivative: Array, known: Uncertainty, which: int
) -> Profile:
    """Profile of the coordinate ``which`` inside the box, the others refitted from the last place on.

    The sum of squares is scaled such that its curvature agrees with the standard error, widened as that is.

    Parameters
    ----------
    unit, residual, derivative
        The optimum (n,), its residual (N,) and derivative (N, n).
    """
    best = float(residual @ residual)
    spread = float(known.standard_errors[which] / abs(problem.space.slope(unit)[which]))
    scale = _curvature(derivative, which) * spread**2
    if not (np.isfinite(scale) and scale > 0.0) or spread > _WIDE:
        freedom = known.freedom if known.freedom > 0.0 else 1.0
        scale, spread = max(best / freedom, 1e-300), float("nan")
    sides = []
    valley = _valley(derivative, which)
    for sign in (-1.0, 1.0):
        places = _places(float(unit[which]), sign, spread)
        sides.append(list(_walk(problem, unit, valley, which, places, best, scale)))
    points = sorted([*sides[0], (float(unit[which]), 0.0), *sides[1]])
    ends = [_crossing(float(unit[which]), side, sign) for side, sign in zip(sides, (-1.0, 1.0), strict=True)]
    coordinate = problem.space.coordinates[which]
    opened = tuple(side for side, (_, met) in zip(("lower", "upper"), ends, strict=True) if not met)
    return Profile(
        coordinate.name,
        coordinate.unit,
        tuple(_value(problem, unit, which, place) for place, _ in points),
        tuple(rise for _, rise in points),
        (_value(problem, unit, which, ends[0][0]), _value(problem, unit, which, ends[1][0])),
        opened,
    )


def _valley(derivative: Array, which: int) -> Array:
    """How all coordinates move with the one that is profiled while the residual changes least, (n,)."""
    others = np.delete(derivative, which, axis=1)
    along = -np.linalg.lstsq(others, derivative[:, which], rcond=1e-9)[0] if others.shape[1] else np.empty(0)
    return np.insert(along, which, 1.0)


def _curvature(derivative: Array, which: int) -> float:
    """Half the second derivative of the profiled sum of squares by the coordinate."""
    left = derivative @ _valley(derivative, which)
    return float(left @ left)


def _places(start: float, sign: float, spread: float) -> list[float]:
    end = 1.0 if sign > 0 else 0.0
    steps = [spread * s for s in _STEPS] if np.isfinite(spread) else [abs(end - start) * s for s in _SHARES]
    inside = [start + sign * step for step in steps if step < abs(end - start)]
    return [*inside, end] if len(inside) < len(steps) else inside


def _walk(
    problem: Problem, unit: Array, valley: Array, which: int, places: list[float], best: float, scale: float
) -> Iterator[tuple[float, float]]:
    """Places and rises until the threshold is passed."""
    others, point = [i for i in range(len(unit)) if i != which], unit
    for place in places:
        # Started where the others would be on a straight valley, and where they were.
        step = place - point[which]
        starts = np.clip(np.stack([point + step * valley, point + step * np.eye(len(unit))[which]]), 0.0, 1.0)
        starts[:, which] = place
        residuals = problem.residuals(starts)
        sizes = np.nan_to_num(np.linalg.norm(residuals, axis=1), nan=np.inf)
        first = int(np.argmin(sizes))
        if not np.isfinite(sizes[first]):
            yield place, float("inf")
            return
        point, residual = polish(problem, starts[first], residuals[first], others, largest_count=_COUNT)
        rise = max(float(residual @ residual) - best, 0.0) / scale
        yield place, rise
        if rise > THRESHOLD:
            return


def _crossing(start: float, side: list[tuple[float, float]], sign: float) -> tuple[float, bool]:
    """Where the root of the rise, nearly straight, passes that of the threshold, and whether it does."""
    before = (start, 0.0)
    for place, rise in side:
        if rise > THRESHOLD:
            if not np.isfinite(rise):
                return before[0], True
            low, high = np.sqrt(before[1]), np.sqrt(rise)
            return before[0] + (place - before[0]) * float((np.sqrt(THRESHOLD) - low) / (high - low)), True
        before = (place, rise)
    return before[0], False


def _value(problem: Problem, unit: Array, which: int, place: float) -> float:
    point = unit.copy()
    point[which] = place
    return float(problem.space.values(point)[which])
