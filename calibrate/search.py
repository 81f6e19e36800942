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

    count = len(problem.space)
    # The stubs of SciPy do not know vectorized objectives, which return an array.
    objectives: Any = lambda columns: problem.objectives(columns.T)  # noqa: E731
    found = differential_evolution(
        objectives, Bounds(np.zeros(count), np.ones(count)), popsize=search.population,
        maxiter=search.generations, tol=search.tolerance, rng=np.random.default_rng(search.seed), polish=False,
        vectorized=True, updating="deferred", callback=remember,
    )  # fmt: skip
    first = _simulated(problem, found.x[None])
    unit, residual = polish(problem, found.x, first)
    return Found(unit, residual, tuple(history), bool(found.success))


def least_squares_from_starts(problem: Problem, search: Search) -> Found:
    """Least squares from the best of a Latin hypercube, which is simulated in one batch with the nominal point."""
    rng = np.random.default_rng(search.seed)
    starts = np.vstack([problem.start(), latin_hypercube(search.starts, len(problem.space), rng)])
    residuals = problem.residuals(starts)
    sizes = np.nan_to_num(np.linalg.norm(residuals, axis=1), nan=np.inf)
    order = [int(i) for i in np.argsort(sizes, kind="stable")[: search.polished] if np.isfinite(sizes[i])]
    if not order:
        raise ValueError(_NOTHING_RUNS)
    ends, history = [], [float(sizes[order[0]])]
    for i in order:
        ends.append(polish(problem, starts[i], residuals[i]))
        history.append(min(history[-1], float(np.linalg.norm(ends[-1][1]))))
    values = [float(np.linalg.norm(residual)) for _, residual in ends]
    best = int(np.argmin(values))
    # One start that ends elsewhere is what more starts are for; the best one being met twice is trust.
    agreed = len(values) == 1 or sum(value <= 1.01 * values[best] for value in values) > 1
    return Found(*ends[best], tuple(history), agreed)


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
    # Tolerances of least_squares are partly absolute: the residual is brought to about 1.
    scale, known = 1.0 / size, {start[chosen].tobytes(): first}

    def whole(part: Array) -> Array:
        point = start.copy()
        point[chosen] = part
        return point

    def residual(part: Array) -> Array:
        if part.tobytes() not in known:
            known[part.tobytes()] = problem.residuals(whole(part)[None])[0]
        return scale * known[part.tobytes()]

    def derivative(part: Array) -> Array:
        return scale * problem.derivative(whole(part), chosen)

    result = least_squares(
        residual, start[chosen], jac=derivative, bounds=(0.0, 1.0), xtol=1e-7, ftol=1e-9, gtol=1e-10,
        max_nfev=largest_count,
    )  # fmt: skip
    polished = result.fun / scale
    return (whole(result.x), polished) if polished @ polished < first @ first else (start, first)


_NOTHING_RUNS = "no candidate of the search could be simulated; narrow the bounds or shorten the time step"


def _simulated(problem: Problem, unit: Array) -> Array:
    residual = problem.residuals(unit)[0]
    if not np.isfinite(residual).all():
        raise ValueError(_NOTHING_RUNS)
    return residual
