"""Newton's method with line search, along a load parameter in increments that adapt themselves."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from fea.linear import SingularMatrixError

Array = NDArray[np.float64]


class NotConvergedError(ArithmeticError):
    """One equilibrium was not found; callers cut the increment."""


class DivergedError(ArithmeticError):
    """The path ended early: ``reached`` is the last parameter in equilibrium, ``state`` its unknowns."""

    def __init__(self, message: str, reached: float, state: Array) -> None:
        super().__init__(message)
        self.reached = reached
        self.state = state


#: Share of a step below which one that hardly reduces the residual is not worth repeating.
_LEAST = 0.05


class System(Protocol):
    """Equations r(y, s) = 0 with the load parameter s.

    ``noise`` is the size of a residual that rounding makes by itself, at the last tangent.
    """

    noise: float

    def residual(self, state: Array, parameter: float) -> tuple[Array, float]:
        """Residual and the size of the reactions that it is measured against."""

    def linearise(self, state: Array, parameter: float, step: Array | None = None) -> tuple[Array, float]:
        """Factorise the tangent; returns what ``residual`` does.

        ``step`` is what the state has just moved by; it may serve a better tangent.
        """

    def solve(self, right: Array) -> Array:
        """Solution with the last factorised tangent."""

    def advance(self, state: Array, parameter: float, target: float, renew: bool = True) -> Array:
        """First-order change of the state towards the parameter ``target``.

        ``renew`` factorises the tangent for it; otherwise the last one is near enough.
        """

    def prepare(self, state: Array, parameter: float) -> bool:
        """Get ready for an increment that starts here; True when the last factorised tangent is lost by it."""

    def augment(self, state: Array, parameter: float) -> bool:
        """Improve multipliers at an equilibrium; True when it must be sought again."""

    def accept(self, state: Array, parameter: float) -> Array | None:
        """Take over the end of an increment; the same state in new unknowns where they had to change."""

    def reject(self) -> None:
        """Forget what was tried since the last accepted increment."""


@dataclass(frozen=True)
class Options:
    """When to stop, and when to try something else.

    Parameters
    ----------
    tolerance
        Residual relative to the reactions.
    loose_tolerance
        The same inside an interval, where only the path matters.
    max_iterations
        Per increment; above it the increment is cut.
    max_augmentations
        Renewals of multipliers per increment; above it the increment is cut.
    keep_below
        Relative residual below which an old tangent is tried first.
    stall
        A step with an old tangent must reduce the residual below this fraction, else it is renewed.
    growth
        A full step may enlarge the residual by this factor, or to the largest of the increment, before the
        line search sets in.
    target_tangents
        Increments grow while their first equilibrium needs no more tangents than this.
    min_increment
        Smallest increment as a fraction of the interval.
    """

    tolerance: float = 1e-8
    loose_tolerance: float = 1e-4
    max_iterations: int = 25
    max_augmentations: int = 12
    keep_below: float = 1e-2
    stall: float = 0.1
    growth: float = 10.0
    target_tangents: int = 4
    min_increment: float = 1e-4


@dataclass
class Increment:
    """One attempt: target parameter, relative residuals, tangents used, success.

    ``effort`` are the tangents up to the first equilibrium, before multipliers changed.
    """

    target: float
    residuals: list[float] = field(default_factory=list)
    tangents: int = 0
    effort: int = 0
    converged: bool = False


@dataclass
class History:
    """What Newton's method did; saved with the record."""

    increments: list[Increment] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def summary(self) -> dict[str, Any]:
        """Totals, and every increment, as plain JSON data."""
        done = self.increments
        return {
            "notes": self.notes,
            "increments": sum(i.converged for i in done),
            "cut_back": sum(not i.converged for i in done),
            "iterations": sum(max(len(i.residuals) - 1, 0) for i in done),
            "tangents": sum(i.tangents for i in done),
            "largest_final_residual": max((i.residuals[-1] for i in done if i.converged and i.residuals), default=0.0),
            "per_increment": [
                {"target": i.target, "iterations": max(len(i.residuals) - 1, 0), "tangents": i.tangents,
                 "residual": i.residuals[-1] if i.residuals else None, "converged": i.converged}
                for i in done
            ],
        }  # fmt: skip


def equilibrate(
    system: System, before: Array, guess: Array, parameter: float, options: Options, log: Increment
) -> Array:
    """State with a small residual at ``parameter``, from a ``guess`` and whatever tangent is factorised.

    ``before`` is the equilibrium that the guess was made from.

    Close to equilibrium an old tangent is kept while each step with it reduces the residual well.  Full
    steps are taken even if the residual grows for once, as it does where a thin part turns and its
    stretch is mended by the next step; an energy line search damps those from which it would explode.

    Raises
    ------
    NotConvergedError
    """
    state, moved = guess, guess - before
    right, scale = system.residual(state, parameter)
    for _ in range(options.max_iterations):
        size = float(np.linalg.norm(right))
        log.residuals.append(size / scale)
        if not np.isfinite(size):
            raise NotConvergedError("the residual is not finite")
        # Rounding ends the descent: only then is its estimate, an upper one, believed.
        stalled = size <= system.noise and len(log.residuals) > 1 and size > 0.5 * log.residuals[-2] * scale
        if size <= options.tolerance * scale or stalled:
            log.converged = True
            return state
        try:
            kept = size <= options.keep_below * scale
            step = system.solve(-right) if kept else np.zeros(0)
            trial = system.residual(state + step, parameter) if kept else None
            if trial is None or not np.linalg.norm(trial[0]) < options.stall * size:
                right, scale = system.linearise(state, parameter, moved)
                log.tangents += 1
                step = system.solve(-right)
                trial = system.residual(state + step, parameter)
        except SingularMatrixError as error:
            raise NotConvergedError(str(error)) from None
        length = 1.0
        if not np.linalg.norm(trial[0]) <= max(options.growth * size, max(log.residuals) * scale):
            length, right, scale = search(lambda y: system.residual(y, parameter), state, step, right, trial)
            if length < _LEAST and np.linalg.norm(right) > 0.99 * size:
                raise NotConvergedError("Newton's step leads nowhere")
        else:
            right, scale = trial
        moved = length * step
        state = state + moved
    raise NotConvergedError(f"no equilibrium after {options.max_iterations} iterations")


def search(
    residual: Callable[[Array], tuple[Array, float]], state: Array, step: Array, right: Array, full: tuple[Array, float]
) -> tuple[float, Array, float]:
    """Length at which the work of the residual along ``step`` has fallen; the residual and scale there.

    ``right`` is the residual before the step, ``full`` residual and scale after all of it.
    """
    start, length, (trial, scale) = float(step @ right), 1.0, full
    for _ in range(8):
        end = float(step @ trial)
        falls = abs(end) <= 0.8 * abs(start) or np.linalg.norm(trial) < np.linalg.norm(right)
        if np.isfinite(end) and falls:
            return length, trial, scale
        crossing = length * start / (start - end) if np.isfinite(end) and end * start < 0 else 0.0
        length = float(np.clip(crossing, 0.1 * length, 0.5 * length))
        trial, scale = residual(state + length * step)
    if not np.isfinite(trial).all():
        raise NotConvergedError("no finite residual along the step")
    return length, trial, scale


@dataclass
class Branch:
    """Equilibria found so far along one load path, and the size of its next increment.

    ``smooth``: extrapolation may be trusted; ``settled``: the last factorised tangent belongs to the last
    equilibrium.
    """

    parameters: list[float]
    states: list[Array]
    increment: float
    smooth: bool = False
    settled: bool = False

    @classmethod
    def start(cls, state: Array, increment: float, parameter: float = 0.0) -> "Branch":
        """A path that begins in equilibrium."""
        return cls([parameter], [state], increment)

    def add(self, parameter: float, state: Array) -> None:
        """Append an equilibrium; the last four serve the predictor."""
        self.parameters, self.states = [*self.parameters[-3:], parameter], [*self.states[-3:], state]

    def restart(self, increment: float) -> None:
        """Go on from the last equilibrium without a past: at a kink of what drives it, or after a step that failed."""
        self.parameters, self.states = self.parameters[-1:], self.states[-1:]
        self.smooth = self.settled = False
        self.increment = increment

    def predict(self, target: float) -> Array:
        """Lagrange extrapolation through the last equilibria, at least two, at most four."""
        result = np.zeros_like(self.states[-1])
        for i, (here, state) in enumerate(zip(self.parameters, self.states, strict=True)):
            others = [s for j, s in enumerate(self.parameters) if j != i]
            result += np.prod([(target - s) / (here - s) for s in others]) * state
        return result


def follow(system: System, path: Branch, end: float, options: Options, history: History) -> Array:
    """Follow equilibria from the last one of ``path`` to the parameter ``end``; returns the state there.

    Raises
    ------
    DivergedError
        When the increment has been cut below ``options.min_increment`` of the interval.
    """
    interval = end - path.parameters[-1]
    while (left := end - path.parameters[-1]) > 1e-12 * max(abs(end), abs(interval)):
        last = path.increment >= left * (1 - 1e-9)
        attempt(system, path, end if last else path.parameters[-1] + path.increment, last, options, history, interval)
    return path.states[-1]


def attempt(
    system: System, path: Branch, target: float, exact: bool, options: Options, history: History, interval: float
) -> bool:
    """Try one increment to ``target``, to the loose tolerance unless ``exact``; sets the size of the next one.

    Returns
    -------
    bool
        Whether equilibrium was found; the path has then grown by it.

    Raises
    ------
    DivergedError
        When the increment has been cut below ``options.min_increment`` of the ``interval``.
    """
    here, log = path.parameters[-1], Increment(target)
    history.increments.append(log)
    loose = max(options.tolerance, options.tolerance if exact else options.loose_tolerance)
    try:
        if system.prepare(path.states[-1], here):
            path.smooth = path.settled = False
        guess = _guess(system, path, target, log)
        state = settle(system, path.states[-1], guess, target, replace(options, tolerance=loose), log)
    except (NotConvergedError, SingularMatrixError) as error:
        log.converged = False
        system.reject()
        path.restart((target - here) / 4)
        if path.increment < options.min_increment * interval:
            raise DivergedError(str(error), here, path.states[-1]) from None
        return False
    path.add(target, state)
    path.smooth, path.settled = log.effort <= 3, True
    rebased = system.accept(state, target)
    if rebased is not None:
        path.parameters, path.states, path.settled = [target], [rebased], False
    if log.effort <= options.target_tangents:
        path.increment *= 2 if target - here >= path.increment * (1 - 1e-9) else 1
    elif log.effort > 2 * options.target_tangents:
        path.increment /= 2
    return True


def settle(system: System, before: Array, guess: Array, target: float, options: Options, log: Increment) -> Array:
    """Equilibrium at ``target`` with multipliers that need no further change."""
    state = equilibrate(system, before, guess, target, options, log)
    log.effort = log.tangents
    for _ in range(options.max_augmentations):
        if not system.augment(state, target):
            return state
        state = equilibrate(system, before, state, target, options, log)
    raise NotConvergedError(f"multipliers do not settle within {options.max_augmentations} renewals")


def _guess(system: System, path: Branch, target: float, log: Increment) -> Array:
    """Extrapolation on a smooth path, unless a kink makes it worse than none; else the tangent.

    The tangent's step does not stretch what turns.
    """
    here = path.states[-1]
    if path.smooth and len(path.states) > 1:
        guess = path.predict(target)
        if np.linalg.norm(system.residual(guess, target)[0]) < np.linalg.norm(system.residual(here, target)[0]):
            return guess
    log.tangents += not path.settled
    return here + system.advance(here, path.parameters[-1], target, not path.settled)
