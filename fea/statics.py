"""Static solutions of a case: to given load factors, by a steered displacement, along the whole path."""

from collections.abc import Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fea.case import Case
from fea.controls import ArcLength, DisplacementControl
from fea.newton import Branch, DivergedError, History, Options, attempt, follow
from fea.problem import Problem
from fea.run import Run
from fea.support import require_support

Array = NDArray[np.float64]
_AXES = {"x": 0, "y": 1, "z": 2}
# Turn of a traced path, rad, that the next increment aims at.
_TURN = 0.1


@dataclass(frozen=True)
class Steer:
    """Displacement control: the mean displacement of ``where`` along ``axis`` goes to ``travel``, m."""

    where: Any
    axis: str
    travel: float


def static(
    case: Case, at: Sequence[float] | Array = (1.0,), steer: Steer | None = None, first: float | None = None,
    options: Options | None = None, every: bool = False,
) -> Run:  # fmt: skip
    """Follow equilibria from rest through the parameters ``at``.

    Parameters
    ----------
    case
        What is solved.
    at
        Where to record, growing: values of t; with ``steer`` shares of the travel.
    steer
        Find the load factor t that moves a place so far, instead of prescribing t: gets past limit points
        at which the load falls while the place moves on.
    first
        First increment; default: the first of ``at``, at most a tenth of the last.  Later ones adapt.
    options
        Tolerances and limits of Newton's method.
    every
        Record every increment instead of only those at ``at``.

    Returns
    -------
    Run
        ``diverged`` with all increments so far where no equilibrium was found.

    Raises
    ------
    ConstraintError
        When something can move freely as a rigid body, or constraints contradict one another.
    """
    levels = np.asarray(at, dtype=float)
    if not len(levels) or (np.diff(np.concatenate([[0.0], levels])) <= 0).any():
        raise ValueError(f"'at' must be positive and growing, not {levels.tolist()}")
    began = perf_counter()
    problem = case.problem()
    require_support(case, problem)
    run, history, options = Run(case, problem), History(), options or Options()
    system: Problem | DisplacementControl = problem
    rest = problem.rest
    if steer is not None:
        system, rest = DisplacementControl(problem, _weights(case, problem, steer), steer.travel), np.append(rest, 0.0)
    branch = Branch.start(rest, first or min(levels[0], levels[-1] / 10))
    _take(run, steer is not None, 0.0, rest)
    try:
        for level in levels:
            if every:
                while (left := level - branch.parameters[-1]) > 1e-12 * level:
                    exact = branch.increment >= left * (1 - 1e-9)
                    target = level if exact else branch.parameters[-1] + branch.increment
                    if attempt(system, branch, target, True, options, history, float(levels[-1])):
                        _take(run, steer is not None, target, branch.states[-1])
            else:
                _take(run, steer is not None, level, follow(system, branch, float(level), options, history))
    except DivergedError as error:
        run.status = "diverged"
        run.reason = f"stopped at {100 * error.reached / levels[-1]:.3g} % of the way: {error}"
        if error.reached > (0.0 if every else max([0.0, *levels[levels <= error.reached]])) + 1e-12 and not every:
            _take(run, steer is not None, error.reached, error.state)
    run.reached = float(branch.parameters[-1] / levels[-1])
    run.history, run.wall_time = history.summary(), perf_counter() - began
    return run


def _take(run: Run, steered: bool, parameter: float, state: Array) -> None:
    run.add(*((float(state[-1]), state[:-1]) if steered else (float(parameter), state)))


def trace(
    case: Case, until: float = 1.0, first: float = 0.05, largest: float = np.inf, points: int = 200,
    stop: Any = None, options: Options | None = None,
) -> Run:  # fmt: skip
    """Follow the path of equilibria by arc length, through snap-through and snap-back, until t passes ``until``.

    Parameters
    ----------
    case
        Its loads are to be proportional to t.
    until
        Load factor to end at; the last point lies beyond it.
    first, largest
        First and largest increment, as shares of the linear answer to ``until`` (in unknowns and in t).
    points
        At most so many.
    stop
        Called with the run after every point; a true answer ends it.
    options
        Tolerances and limits of Newton's method.

    Returns
    -------
    Run
        ``diverged`` when the path was lost or ``points`` did not suffice.
    """
    began = perf_counter()
    problem = case.problem()
    require_support(case, problem)
    run, history, options = Run(case, problem), History(), options or Options()
    run.add(0.0, problem.rest)
    system = ArcLength(problem, problem.rest, 0.0, until)
    branch = Branch.start(np.append(problem.rest, 0.0), first)
    done = False
    try:
        while not done and len(run.t) <= points:
            branch.increment = min(branch.increment, largest)
            target = branch.parameters[-1] + branch.increment
            size = branch.increment
            if attempt(system, branch, target, True, options, history, max(first, 1e-3)):
                branch.increment = min(branch.increment, size * _TURN / max(system.turn, 1e-9))
                state = branch.states[-1]
                run.add(float(state[-1]), state[:-1])
                done = state[-1] >= until if stop is None else bool(stop(run))
        if not done:
            run.status, run.reason = "diverged", f"{points} points did not reach the load factor {until:g}"
    except DivergedError as error:
        run.status, run.reason = "diverged", f"the path was lost at the load factor {run.t[-1]:.6g}: {error}"
    run.reached = 1.0 if done else float(np.clip(run.t.max() / until, 0.0, 1.0))
    run.history, run.wall_time = history.summary(), perf_counter() - began
    return run


def _weights(case: Case, problem: Problem, steer: Steer) -> Array:
    """Mean displacement of the steered nodes as weights of the unknowns."""
    name = steer.where
    nodes = case.watched[name] if isinstance(name, str) and name in case.watched else case.select(name)
    rows = 3 * nodes + _AXES[steer.axis]
    weights = np.asarray(problem.links.jacobian(problem.rest, 0.0)[rows].mean(axis=0)).ravel()
    if not weights.any():
        raise ValueError(f"the displacement along {steer.axis} to steer by is held, so that no load can move it")
    return weights
