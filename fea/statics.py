"""Static solutions of a case: to given load factors, by a steered displacement, along the whole path."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fea.case import Case
from fea.controls import ArcLength, DisplacementControl
from fea.linear import SingularMatrixError
from fea.newton import Branch, DivergedError, History, Increment, NotConvergedError, Options, attempt, follow, settle
from fea.problem import Problem
from fea.run import Run
from fea.support import require_support

Array = NDArray[np.float64]
_AXES = {"x": 0, "y": 1, "z": 2}
# Turn of a traced path, rad, that the next increment aims at.
_TURN = 0.1
# Share of an interval below which smaller load increments are not tried before the arc length is.
_STUBBORN = 4e-3
# How often, with how many points and from which first length the arc length may help one load on.
_WALKS, _POINTS, _FIRST_STEP = 10, 300, 0.01


@dataclass(frozen=True)
class Steer:
    """Displacement control: the mean displacement of ``where`` along ``axis`` goes to ``travel``, m."""

    where: Any
    axis: str
    travel: float


def static(
    case: Case, at: Sequence[float] | Array = (1.0,), steer: Steer | None = None, first: float | None = None,
    options: Options | None = None, every: bool = False, seconds: float = 0.0,
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
    seconds
        Time, s, that passes while t goes from 0 to 1, for creep, relaxation and hysteresis of viscous materials
        without inertia; 0: so slow that nothing viscous is felt.  Not with ``steer``.

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
    if seconds and steer is not None:
        raise ValueError("'seconds' and 'steer' exclude each other: a steered load factor is no time")
    problem = case.problem(seconds)
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
                _take(run, steer is not None, level, _reach(system, branch, float(level), options, history))
    except DivergedError as error:
        run.status = "diverged"
        run.reason = f"stopped at {100 * error.reached / levels[-1]:.3g} % of the way: {error}"
        if error.reached > (0.0 if every else max([0.0, *levels[levels <= error.reached]])) + 1e-12 and not every:
            _take(run, steer is not None, error.reached, error.state)
    run.reached = float(branch.parameters[-1] / levels[-1])
    run.history, run.wall_time = history.summary(), perf_counter() - began
    return run


def _reach(
    system: Problem | DisplacementControl, branch: Branch, level: float, options: Options, history: History
) -> Array:
    """State at ``level``.  A load that no equilibrium nearby can bear is walked around by arc length: a snap."""
    if isinstance(system, DisplacementControl) or system.seconds:
        return follow(system, branch, level, options, history)
    eager = replace(options, min_increment=max(options.min_increment, _STUBBORN))
    for _ in range(_WALKS):
        try:
            return follow(system, branch, level, eager, history)
        except DivergedError as error:
            if not _walk(system, branch, level, options, history):
                raise DivergedError(f"{error}; nor does the arc length lead on", error.reached, error.state) from None
    return follow(system, branch, level, options, history)


def _walk(problem: Problem, branch: Branch, level: float, options: Options, history: History) -> bool:
    """Go on by arc length until the load has fallen and come back, or reached ``level``; whether that was possible."""
    bases, here, reached = [part.base for part in problem.links.rigid], branch.states[-1], branch.parameters[-1]
    branch.smooth = branch.settled = False
    try:
        system = ArcLength(problem, here, reached, level)
        path, top, fell = Branch.start(np.append(here, reached), _FIRST_STEP), reached, False
        for _ in range(_POINTS):
            last, size = path.states[-1], path.increment
            if not attempt(system, path, path.parameters[-1] + size, True, options, history, _FIRST_STEP):
                continue
            path.increment = min(path.increment, size * _TURN / max(system.turn, 1e-9))
            now = float(path.states[-1][-1])
            if now >= level or (fell and now > top):
                what = "snapped" if fell else "was stuck"
                history.notes.append(f"{what} at t = {reached:.6g}: arc length led on to t = {min(now, level):.6g}")
            if now >= level:
                share = (level - last[-1]) / (now - last[-1])
                guess = last[:-1] + share * (path.states[-1] - last)[:-1]
                log = Increment(level)
                history.increments.append(log)
                branch.parameters, branch.states = [level], [settle(problem, last[:-1], guess, level, options, log)]
                return True
            if fell and now > top:
                branch.parameters, branch.states = [now], [path.states[-1][:-1]]
                branch.increment = (level - now) / 10
                return True
            fell, top = fell or now < top, max(top, now)
    except (DivergedError, NotConvergedError, SingularMatrixError):
        pass
    for part, base in zip(problem.links.rigid, bases, strict=True):
        part.base = base
    branch.parameters, branch.states = [reached], [here]
    return False


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
    done = False
    try:
        # Loads that are always there, such as the small one that decides where to buckle, come first.
        start = _at_zero(problem, options, history)
        run.add(0.0, start)
        system = ArcLength(problem, start, 0.0, until)
        branch = Branch.start(np.append(start, 0.0), first)
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
        if not len(run.t):
            run.add(0.0, problem.rest)
        run.status, run.reason = "diverged", f"the path was lost at the load factor {run.t[-1]:.6g}: {error}"
    run.reached = 1.0 if done else float(np.clip(run.t.max() / until, 0.0, 1.0))
    run.history, run.wall_time = history.summary(), perf_counter() - began
    return run


def _at_zero(problem: Problem, options: Options, history: History) -> Array:
    """Equilibrium at t = 0; where nothing pulls yet, that is rest."""
    right, scale = problem.residual(problem.rest, 0.0)
    if np.linalg.norm(right) <= options.tolerance * scale:
        return problem.rest
    log = Increment(0.0)
    history.increments.append(log)
    try:
        return settle(problem, problem.rest, problem.rest, 0.0, options, log)
    except (NotConvergedError, SingularMatrixError) as error:
        raise DivergedError(f"no equilibrium under the constant loads: {error}", 0.0, problem.rest) from None


def _weights(case: Case, problem: Problem, steer: Steer) -> Array:
    """Mean displacement of the steered nodes as weights of the unknowns."""
    name = steer.where
    nodes = case.watched[name] if isinstance(name, str) and name in case.watched else case.select(name)
    rows = 3 * nodes + _AXES[steer.axis]
    weights = np.asarray(problem.links.jacobian(problem.rest, 0.0)[rows].mean(axis=0)).ravel()
    if not weights.any():
        raise ValueError(f"the displacement along {steer.axis} to steer by is held, so that no load can move it")
    return weights
