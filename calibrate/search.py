"""Global and local search on the unit cube, seeded."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from calibrate.objective import Problem
from calibrate.spec import Search

Array = NDArray[np.float64]
_LARGEST_COUNT = 60
#: Objective over the best one below which a rough optimum may be the best of the exact problem, and the distance in
#: the unit cube below which two are the same.
_RIVAL, _SAME = 1.3, 1e-3


@dataclass(frozen=True)
class Found:
    """The end of a search.

    Parameters
    ----------
    unit, residual
        Best point of the unit cube (n,) and its residual (N,).
    history
        Best objective after each generation, or after the starts and each polish.
    agreed
        Whether the search ended because its candidates agreed.
    """

    unit: Array
    residual: Array
    history: tuple[float, ...]
    agreed: bool

    @property
    def objective(self) -> float:
        """Root of the residual's sum of squares."""
        return float(np.linalg.norm(self.residual))


def find(problem: Problem, search: Search) -> Found:
    """Optimum of ``problem`` by the search's method; the same seed gives the same numbers.

    Raises
    ------
    ValueError
        When no candidate at all can be simulated.
    """
    if not len(problem.space):
        return Found(np.empty(0), _simulated(problem, np.empty((1, 0))), (), True)
    if search.method == "least-squares":
        return least_squares_from_starts(problem, search)
    return evolve(problem, search)


def evolve(problem: Problem, search: Search) -> Found:
    """Differential evolution, one batch per generation, then least squares from its best candidate."""
    from scipy.optimize import Bounds, OptimizeResult, differential_evolution

    history: list[float] = []

    def remember(intermediate_result: OptimizeResult) -> None:
        history.append(float(intermediate_result.fun))

    count, rough = len(problem.space), problem.rough()
    # The stubs of SciPy do not know vectorized objectives, which return an array.
    objectives: Any = lambda columns: rough.objectives(columns.T)  # noqa: E731
    found = differential_evolution(
        objectives, Bounds(np.zeros(count), np.ones(count)), popsize=search.population,
        maxiter=search.generations, tol=search.tolerance, rng=np.random.default_rng(search.seed), polish=False,
        vectorized=True, updating="deferred", callback=remember,
    )  # fmt: skip
    end = polish(rough, found.x, _simulated(rough, found.x[None]))
    unit, residual = _exact(problem, rough, [end])
    return Found(unit, residual, tuple(history), bool(found.success))


def least_squares_from_starts(problem: Problem, search: Search) -> Found:
    """Least squares from the best of a Latin hypercube, which is simulated in one batch with the nominal point."""
    rng = np.random.default_rng(search.seed)
    starts = np.vstack([problem.start(), latin_hypercube(search.starts, len(problem.space), rng)])
    rough = problem.rough()
    residuals = rough.residuals(starts)
    sizes = np.nan_to_num(np.linalg.norm(residuals, axis=1), nan=np.inf)
    order = [int(i) for i in np.argsort(sizes, kind="stable")[: search.polished] if np.isfinite(sizes[i])]
    if not order:
        raise ValueError(_NOTHING_RUNS)
    ends, history = [], [float(sizes[order[0]])]
    for i in order:
        ends.append(polish(rough, starts[i], residuals[i]))
        history.append(min(history[-1], float(np.linalg.norm(ends[-1][1]))))
    values = [float(np.linalg.norm(residual)) for _, residual in ends]
    best = min(values)
    # One start that ends elsewhere is what more starts are for; the best one being met twice is trust.
    agreed = len(values) == 1 or sum(value <= 1.01 * best for value in values) > 1
    near = [end for end, value in zip(ends, values, strict=True) if value <= _RIVAL * best]
    return Found(*_exact(problem, rough, near), tuple(history), agreed)


def _exact(problem: Problem, rough: Problem, ends: Sequence[tuple[Array, Array]]) -> tuple[Array, Array]:
    """Best optimum of the exact problem next to those of the rough one, whose order may differ."""
    problem.evaluations = rough.evaluations
    ends = sorted(ends, key=lambda end: float(np.linalg.norm(end[1])))
    if rough.performer is problem.performer:
        return ends[0]
    found: list[tuple[Array, Array]] = []
    tried: list[Array] = []
    for unit, _ in ends:
        if all(np.abs(unit - other).max() > _SAME for other in tried):
            tried.append(unit)
            found.append(polish(problem, unit, _simulated(problem, unit[None])))
    return min(found, key=lambda end: float(np.linalg.norm(end[1])))


def latin_hypercube(count: int, dimensions: int, rng: np.random.Generator) -> Array:
    """Points of the unit cube, (count, dimensions), of which each slice along each axis holds one."""
    slices = np.stack([rng.permutation(count) for _ in range(dimensions)], axis=1)
    return (slices + rng.random((count, dimensions))) / count


def polish(
    problem: Problem,
    start: Array,
    first: Array,
    which: Sequence[int] | None = None,
    largest_count: int = _LARGEST_COUNT,
) -> tuple[Array, Array]:
    """Box-bounded least squares.

    Parameters
    ----------
    start, first
        Point of the unit cube (n,) and its residual (N,), which must be finite.
    which
        Coordinates that may move; None: all.

    Returns
    -------
    unit, residual
        The best point (n,), no worse than the start, and its residual.
    """
    from scipy.optimize import least_squares

    chosen = list(range(len(start))) if which is None else list(which)
    size = float(np.linalg.norm(first))
    if not chosen or size == 0.0:
        return start, first
    part = _Part(problem, start, chosen, 1.0 / size, {start[chosen].tobytes(): first})
    # Further digits of a parameter cost nothing, or minutes.
    xtol, ftol = (1e-7, 1e-9) if problem.performer.cheap else (1e-4, 1e-6)
    result = least_squares(
        part.residual, start[chosen], jac=part.derivative, bounds=(0.0, 1.0), xtol=xtol, ftol=ftol, gtol=1e-10,
        max_nfev=largest_count,
    )  # fmt: skip
    polished = result.fun / part.scale
    return (part.whole(result.x), polished) if polished @ polished < first @ first else (start, first)


@dataclass(frozen=True)
class _Part:
    """A problem along some coordinates through a point.

    Tolerances of SciPy's ``least_squares`` are partly absolute: ``scale`` brings the residual to about 1.
    """

    problem: Problem
    point: Array
    chosen: list[int]
    scale: float
    known: dict[bytes, Array]

    def whole(self, part: Array) -> Array:
        point = self.point.copy()
        point[self.chosen] = part
        return point

    def residual(self, part: Array) -> Array:
        key = part.tobytes()
        if key not in self.known:
            self.known[key] = self.problem.residuals(self.whole(part)[None])[0]
        return self.scale * self.known[key]

    def derivative(self, part: Array) -> Array:
        return self.scale * self.problem.derivative(self.whole(part), self.chosen)


_NOTHING_RUNS = "no candidate of the search could be simulated; narrow the bounds or shorten the time step"


def _simulated(problem: Problem, unit: Array) -> Array:
    residual = problem.residuals(unit)[0]
    if not np.isfinite(residual).all():
        raise ValueError(_NOTHING_RUNS)
    return residual
