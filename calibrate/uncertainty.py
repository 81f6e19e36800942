"""How far the records pin the parameters down: covariance from the residual and its derivative.

The estimate minimises |r|^2, so small errors e of the records move it by -(J^T J)^-1 J^T e, and its
covariance is (J^T J)^-1 (J^T S J) (J^T J)^-1 with the errors' covariance S.  S is taken from the residual,
record by record: its covariance between coordinates, widened where it is correlated in time.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.blocks import Block
from calibrate.objective import Problem

Array = NDArray[np.float64]
#: Columns, and singular values of columns brought to one length, below these shares of the largest count as
#: zero: the second is what the truncation of central differences leaves of an exact dependence.
_NO_TRACE, _NEGLIGIBLE = 1e-9, 3e-5
#: Share of a parameter in a direction that is not seen, from which on it counts as not seen itself.
_SHARE = 1e-3
#: Chance of calling white noise correlated, and the ratio to the known noise above which a residual is more than that.
_ALARM, _ABOVE_NOISE = 0.01, 1.2
_LAGS = 10


@dataclass(frozen=True)
class Errors:
    """What the residual of one block says about the errors in it.

    Parameters
    ----------
    name
        Of the target, with the quantity.
    size
        Standard deviation, in the unit of the quantity (of the scaled misfit for reduced numbers).
    covariance
        Between the columns of the scaled residual, (columns, columns).
    stretch
        Variance of slow sums over that of white noise: the number of samples over the effective one; 1 for white.
    known
        The known standard deviation, if there is one.
    samples
        Rows times columns, the latter less where they move together.
    """

    name: str
    size: float
    covariance: Array
    stretch: float
    known: float | None
    samples: float

    @property
    def above_noise(self) -> float:
        """Ratio to the known noise; NaN where none is known."""
        return self.size / self.known if self.known else float("nan")

    @property
    def is_noise(self) -> bool:
        """Whether this is the known noise and nothing else."""
        return self.stretch == 1.0 and self.above_noise <= _ABOVE_NOISE

    def sentence(self) -> str:
        """Why the errors are taken larger than noise; empty when they are not."""
        if self.is_noise:
            return ""
        facts = []
        if self.above_noise > _ABOVE_NOISE:
            facts.append(f"is {self.above_noise:.1f} times the known noise")
        if self.stretch > 1.0:
            facts.append(f"is correlated in time (as good as {self.samples / self.stretch:.0f} independent samples)")
        return f"The residual of {self.name} {' and '.join(facts)}; the intervals are widened for it." if facts else ""


@dataclass(frozen=True)
class Uncertainty:
    """Of n coordinates, the p parameters first.

    Parameters
    ----------
    covariance
        In SI units, (n, n); meaningless for directions that are not seen.
    standard_errors
        SI, (n,); infinite for what the records do not see, NaN with too few of them.
    correlation
        (n, n).
    condition
        Ratio of the extreme singular values of the derivative by the parameters' logarithms, nuisances taken out.
    intervals
        95 % by Student's t on the scale of the search, cut at its bounds, SI, (n, 2).
    blind
        Directions in relative changes of all coordinates that the records do not see, (k, n).
    freedom
        Effective number of samples less n.
    errors
        Per block.
    """

    covariance: Array
    standard_errors: Array
    correlation: Array
    condition: float
    intervals: Array
    blind: Array
    freedom: float
    errors: tuple[Errors, ...]


def uncertainty(problem: Problem, unit: Array, residual: Array, derivative: Array) -> Uncertainty:
    """Uncertainty at an optimum.

    Errors of the model that the residual does not show (it may follow a record with wrong parameters) are not in it.

    Parameters
    ----------
    unit, residual, derivative
        Point of the unit cube (n,), residual (N,), and its derivative there (N, n).
    """
    count = len(unit)
    errors = tuple(errors_of(problem, residual))
    freedom = sum(e.samples / e.stretch for e in errors) - count
    bread, blind = _inverse(derivative)
    meat = np.zeros((count, count))
    for block, error, part in zip(problem.blocks, errors, problem.split(derivative), strict=True):
        meat += _meat(block, error, part, count)
    inside = bread @ meat @ bread
    # A coordinate with a share in a direction that is not seen can take any value.
    unseen = (np.abs(blind) > _SHARE * np.abs(blind).max(axis=1, keepdims=True)).any(axis=0)
    spread = np.where(unseen, np.inf, np.sqrt(np.diag(inside)))
    if problem.size <= count or freedom <= 0.0:
        spread = np.where(unseen, np.inf, np.nan)
    slope, sizes = problem.space.slope(unit), problem.space.sizes(unit)
    half = _student(freedom) * spread
    intervals = np.stack([problem.space.values(np.clip(unit + sign * half, 0.0, 1.0)) for sign in (-1.0, 1.0)], axis=1)
    blind = blind * slope / sizes
    return Uncertainty(
        covariance=inside * np.outer(slope, slope),
        standard_errors=np.abs(slope) * spread,
        correlation=correlation_of(inside),
        condition=_condition(derivative / (slope / sizes), blind, problem.parameters),
        intervals=np.where(np.isnan(spread)[:, None], np.nan, intervals),
        blind=blind / np.maximum(np.linalg.norm(blind, axis=1, keepdims=True), 1e-300),
        freedom=float(freedom),
        errors=errors,
    )


def errors_of(problem: Problem, residual: Array) -> list[Errors]:
    """Size, covariance and correlation in time of every block's residual, (N,)."""
    found = []
    offsets = sum(block.reference.shape[1] for block in problem.blocks if block.offset is not None)
    spent = len(problem.space) + offsets
    # The fit has taken its share out of the residual.
    lost = problem.size / (problem.size - spent) if problem.size > spent else np.nan
    for block, part in zip(problem.blocks, problem.split(residual), strict=True):
        target = problem.targets[block.target]
        rows, columns = block.reference.shape
        scaled = part.reshape(rows, columns)
        covariance = lost * scaled.T @ scaled / rows
        raw = scaled / (block.factor if block.timed else block.share)
        stretch = time_stretch(scaled) if block.timed else 1.0
        known = target.noise if block.timed else None
        size = float(np.sqrt(lost * np.mean(raw**2)))
        name = target.name if block.quantity in ("markers", "numbers") else f"{target.name}, {block.quantity}"
        found.append(Errors(name, size, covariance, stretch, known, rows * _independent(covariance)))
    return found


def _independent(covariance: Array) -> float:
    """Number of columns that move on their own: (trace)^2 / |C|^2, from 1 to all of them."""
    square = float(np.sum(covariance**2))
    return float(np.trace(covariance) ** 2 / square) if square > 0.0 else float(len(covariance))


def time_stretch(series: Array) -> float:
    """How much less independent than white noise the rows of a residual (rows, columns) are, from 1 on.

    The largest value of the normalised spectrum (Parzen window): whatever the frequency of the parameters'
    traces, sums over the residual vary by no more than this.  1 unless a portmanteau test on the first
    lags finds white noise unlikely.
    """
    from scipy.special import gammaincc

    rows = len(series)
    lags = min(rows // 4, 60)
    total = float(np.sum(series**2))
    if lags < 2 or total == 0.0:
        return 1.0
    rho = np.array([np.sum(series[k:] * series[:-k]) for k in range(1, lags + 1)]) / total
    tested = min(_LAGS, lags)
    columns = _independent(series.T @ series)
    chi_square = columns * rows * (rows + 2.0) * float(np.sum(rho[:tested] ** 2 / (rows - np.arange(1, tested + 1))))
    if gammaincc(tested / 2.0, chi_square / 2.0) > _ALARM:
        return 1.0
    place = np.arange(1, lags + 1) / (lags + 1.0)
    window = np.where(place <= 0.5, 1.0 - 6.0 * place**2 * (1.0 - place), 2.0 * (1.0 - place) ** 3)
    angles = np.linspace(0.0, np.pi, 256)[:, None] * np.arange(1, lags + 1)
    return float(np.clip((1.0 + 2.0 * np.cos(angles) @ (window * rho)).max(), 1.0, rows))


def _meat(block: Block, error: Errors, derivative: Array, count: int) -> Array:
    """J^T S J of one block, (n, n), from its derivative (rows * columns, n)."""
    if error.is_noise:
        assert error.known is not None
        return (float(block.factor[0, 0]) * error.known) ** 2 * derivative.T @ derivative
    rows, columns = block.reference.shape
    shaped = derivative.reshape(rows, columns, count)
    return error.stretch * np.einsum("rcn,cd,rdm->nm", shaped, error.covariance, shaped, optimize=True)


def leaves_trace(derivative: Array) -> NDArray[np.bool_]:
    """Which coordinates change the residual at all, (n,), from its derivative (N, n)."""
    norms = np.linalg.norm(derivative, axis=0)
    return np.asarray(norms > _NO_TRACE * max(float(norms.max(initial=0.0)), 1e-300))


def _inverse(derivative: Array) -> tuple[Array, Array]:
    """(J^T J)^-1 in the directions that are seen, (n, n), and those that are not, (k, n)."""
    count = derivative.shape[1]
    traced = np.flatnonzero(leaves_trace(derivative))
    inverse, dead = np.zeros((count, count)), np.delete(np.eye(count), traced, axis=0)
    if not len(traced):
        return inverse, dead
    lengths, few = np.linalg.norm(derivative[:, traced], axis=0), max(0, len(traced) - len(derivative))
    columns = np.vstack([derivative[:, traced] / lengths, np.zeros((few, len(traced)))])
    _, singular, directions = np.linalg.svd(columns, full_matrices=False)
    seen = singular > _NEGLIGIBLE * singular[0]
    half = directions[seen].T / singular[seen] / lengths[:, None]
    inverse[np.ix_(traced, traced)] = half @ half.T
    blind = np.zeros((int(np.sum(~seen)), count))
    blind[:, traced] = directions[~seen] / lengths
    return inverse, np.vstack([dead, blind])


def correlation_of(covariance: Array) -> Array:
    """Correlation (n, n) of a covariance, with ones on the diagonal also where there is no variance."""
    spread = np.sqrt(np.diag(covariance))
    safe = np.where(spread > 0.0, spread, 1.0)
    correlation = np.clip(covariance / np.outer(safe, safe), -1.0, 1.0)
    np.fill_diagonal(correlation, 1.0)
    return np.asarray(correlation)


def _condition(derivative: Array, blind: Array, parameters: int) -> float:
    """Condition number of the parameters' columns with what nuisances can mimic taken out; infinite when singular."""
    if np.any(blind[:, :parameters]):
        return float("inf")
    mine, others = derivative[:, :parameters], derivative[:, parameters:]
    if others.shape[1]:
        mine = mine - others @ np.linalg.lstsq(others, mine, rcond=None)[0]
    singular = np.linalg.svd(mine, compute_uv=False)
    return float(singular[0] / singular[-1]) if len(singular) and len(derivative) >= parameters else float("nan")


def _student(freedom: float) -> float:
    """Half width of a two-sided 95 % interval in standard errors."""
    from scipy.special import stdtrit

    return float(stdtrit(freedom, 0.975)) if freedom > 0.0 else float("nan")
