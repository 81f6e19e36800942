"""Bootstrap: the same fit to records that could have been measured instead."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.objective import Problem
from calibrate.search import polish
from calibrate.uncertainty import Errors, Uncertainty

Array = NDArray[np.float64]
#: Rounds of the simplified Newton method, and the step in standard errors at which a refit has ended.
_ROUNDS, _ENDED = 12, 1e-2
#: Fewer rows than this cannot be resampled: drawn from a normal distribution of their size.
_FEW = 8


@dataclass(frozen=True)
class Bootstrap:
    """Spread of the parameters over refits.

    Parameters
    ----------
    method
        A phrase: how the records were made.
    count, failed
        Refits, and those among them that could not be ended.
    names, standard_errors, intervals
        Of the parameters, (p,) and (p, 2), SI: standard deviation and 2.5 % and 97.5 % quantiles.
    correlation
        (p, p).
    """

    method: str
    count: int
    failed: int
    names: tuple[str, ...]
    standard_errors: tuple[float, ...]
    intervals: tuple[tuple[float, float], ...]
    correlation: tuple[tuple[float, ...], ...]


def bootstrap(problem: Problem, unit: Array, derivative: Array, known: Uncertainty, count: int, seed: int) -> Bootstrap:
    """Refits to ``count`` resampled sets of records.

    Where every residual is the known noise and no more, records are the fitted prediction with new noise
    (parametric).  Otherwise blocks of consecutive samples of the residual, all coordinates together, are put
    on the prediction in random order (moving blocks): model error is correlated, and single samples drawn at
    random would break that.

    Parameters
    ----------
    unit, derivative
        The optimum (n,) and the residual's derivative there (N, n).
    """
    rng = np.random.default_rng(seed)
    references, method = resampled(problem, unit, known.errors, count, rng)
    points = _refits(problem, unit, derivative, known, references)
    good = np.isfinite(points).all(axis=1)
    p = problem.parameters
    values = problem.space.values(points[good])[:, :p]
    if len(values) < 2:
        values = np.full((2, p), np.nan)
    correlation = np.atleast_2d(np.corrcoef(values, rowvar=False)) if np.ptp(values, axis=0).all() else np.eye(p)
    return Bootstrap(
        method, count, int(np.sum(~good)), problem.space.names[:p],
        tuple(values.std(axis=0, ddof=1).tolist()),
        tuple((float(low), float(high)) for low, high in np.percentile(values, [2.5, 97.5], axis=0).T),
        tuple(map(tuple, correlation.tolist())),
    )  # fmt: skip


def resampled(
    problem: Problem, unit: Array, errors: tuple[Errors, ...], count: int, rng: np.random.Generator
) -> tuple[list[Array], str]:
    """Sets of records, one array (count, rows, columns) per block, and how they were made."""
    predictions = [part[0] for part in problem.predictions(unit[None])]
    parametric = all(error.is_noise for error in errors)
    found, lengths = [], []
    for block, prediction, error in zip(problem.blocks, predictions, errors, strict=True):
        difference, offset = block.difference(prediction)
        clean = prediction + offset
        rows, columns = clean.shape
        if parametric:
            assert error.known is not None
            new = error.known * rng.standard_normal((count, rows, columns))
        elif not block.timed or rows < _FEW:
            new = error.size * rng.standard_normal((count, rows, columns)) * (1.0 if block.timed else block.scale)
        else:
            length = min(max(math.ceil(rows ** (1 / 3)), math.ceil(2.0 * error.stretch)), rows // 2)
            lengths.append(length)
            new = _moving_blocks(-(difference - difference.mean(axis=0)), length, count, rng)
            # What the fit took out of the residual is put back.
            new *= error.size / max(float(np.sqrt(np.mean(new**2))), 1e-300)
        found.append(clean + new)
    if parametric:
        return found, "parametric: the fitted prediction with the known noise"
    span = f" of {min(lengths)} to {max(lengths)} samples" if lengths else ""
    return found, f"moving blocks{span} of the residual on the fitted prediction"


def _moving_blocks(residual: Array, length: int, count: int, rng: np.random.Generator) -> Array:
    """Rows (rows, columns) in random consecutive pieces, (count, rows, columns)."""
    rows = len(residual)
    pieces = math.ceil(rows / length)
    begins = rng.integers(0, rows - length + 1, size=(count, pieces))
    places = (begins[:, :, None] + np.arange(length)).reshape(count, -1)[:, :rows]
    return residual[places]


def _refits(problem: Problem, unit: Array, derivative: Array, known: Uncertainty, references: list[Array]) -> Array:
    """Optima (count, n) of the resampled problems, NaN where there is none.

    All at once by Newton's method with the derivative of the original optimum, which the new ones lie
    close to; what it does not bring to an end, or brings to a bound, goes on alone.
    """
    count = len(references[0])
    inverse = np.linalg.pinv(derivative, rcond=1e-9)
    spread = known.standard_errors / np.abs(problem.space.slope(unit))
    small = _ENDED * np.where(np.isfinite(spread) & (spread > 0.0), spread, 1.0)
    points, active = np.tile(unit, (count, 1)), np.arange(count)
    ended = np.zeros(count, bool)
    for _ in range(_ROUNDS):
        residuals = problem.residuals_of(problem.predictions(points[active]), [r[active] for r in references])
        steps = np.nan_to_num(residuals @ inverse.T)
        moved = np.clip(points[active] - steps, 0.0, 1.0)
        done = (np.abs(moved - points[active]) < small).all(axis=1) & np.isfinite(residuals).all(axis=1)
        points[active] = moved
        ended[active[done]] = True
        active = active[~done]
        if not len(active):
            break
    at_bound = ((points <= 0.0) | (points >= 1.0)).any(axis=1)
    for i in np.flatnonzero(~ended | at_bound):
        points[i] = _alone(problem, unit, [r[i] for r in references])
    return points


def _alone(problem: Problem, unit: Array, references: list[Array]) -> Array:
    alone = problem.with_references(references)
    first = alone.residuals(unit[None])[0]
    if not np.isfinite(first).all():
        return np.full_like(unit, np.nan)
    found = polish(alone, unit, first)[0]
    problem.evaluations = alone.evaluations
    return found
