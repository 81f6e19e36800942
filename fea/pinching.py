"""The stages of experiments with pinched tubes, step by step in time, slowly.

Pinched tubes buckle on their way, more than once.  Steps in time with the material's viscosity pass such points,
where a path of equilibria would have to be traced through all its branches; the travel of the tendons is given.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from fea.newton import Branch, DivergedError, History, Options, attempt
from fea.tube import Tube, TubeExperiment
from fea.tube_sensing import Sensed
from lab.experiments import Pinch, PinchedBending, ShapeRecovery

Array = NDArray[np.float64]

#: Steps beside a first touch over those elsewhere: the least before it and after, and those of a wall that lies on.
_BEFORE, _AFTER, _TOUCHING = 1 / 16, 1 / 64, 1 / 4
#: Share of the gap, or of the force that is waited for, that one step may use up.
_WARY = 0.6
#: Travel that is tried over that at which pads would just meet: tendons and walls give a little.
_BEYOND = 1.1
#: Smallest step over that between records.
_STUBBORN = 1e-5


@dataclass
class _Now:
    """What steps depend on."""

    t: float
    force: float
    gap: float
    contact: float


@dataclass
class Story:
    """Goes through the stages of an experiment and senses.

    Attributes
    ----------
    reason
        Why a stage could not be finished; empty while all is well.
    notes
        What a reader should know: a pinch that never closed, a force that was never reached.
    """

    tube: Tube
    experiment: TubeExperiment
    tolerance: float
    sensed: Sensed = field(init=False)
    history: History = field(default_factory=History)
    notes: list[str] = field(default_factory=list)
    reason: str = ""

    def __post_init__(self) -> None:
        self._branch = Branch.start(self.tube.problem.rest, 1.0)
        self.sensed = Sensed(self.tube)
        self.sensed.read("rest", self.tube.problem.rest, 0.0)
        self._options = Options(
            tolerance=max(self.tolerance, 1e-6), max_iterations=12, target_tangents=3, min_increment=_STUBBORN
        )

    @property
    def t(self) -> float:
        """Time that has been reached, s."""
        return self._branch.parameters[-1]

    @property
    def x(self) -> Array:
        """Displacements there (N, 3), m."""
        return self.tube.problem.displacement(self._branch.states[-1], self.t)

    def play(self) -> None:
        """All stages, as far as they go."""
        for stage in _STAGES[self.experiment.kind](self):
            if self.reason:
                return
            stage()

    # -- stages --------------------------------------------------------------------------------------

    def pinch(self) -> None:
        """Pull until the walls touch firmly, the force limit, or the end of all travel."""
        experiment, tube = self.experiment, self.tube
        shares = experiment.shares(tube.specimen.pairs)[: tube.lines]
        meet, whole = tube.meeting, _BEYOND * tube.meeting * float(shares.sum())
        end = self.t + experiment.duration * whole / meet
        tube.tendons.pull(self.x, shares, self.t, end, whole)
        limit = np.inf if experiment.force_limit is None else experiment.force_limit

        def left(now: _Now) -> float:
            return min(experiment.firmness * now.force - now.contact if now.contact > 0 else np.inf, limit - now.force)

        last = self._march("pinch", end, experiment.duration / experiment.increments, left)
        if last is not None and last.contact < experiment.firmness * last.force:
            why = f"the limit of {limit:g} N" if last.force >= limit else "the end of the tendons' travel"
            touched = "its walls touch, but not firmly" if last.contact > 0 else "its walls do not touch"
            self.notes.append(f"the pinch ended at {why}, F_p = {last.force:.4g} N: {touched}")
        tube.tendons.hold(self.x, self.t)

    def settle(self) -> None:
        """Wait with the tendons held."""
        experiment = self.experiment
        assert isinstance(experiment, PinchedBending)
        self._march("settle", self.t + experiment.pause, experiment.pause)

    def load(self, stage: str = "load") -> None:
        """Put the dead load on."""
        experiment = self.experiment
        assert isinstance(experiment, PinchedBending | ShapeRecovery)
        assert experiment.load is not None
        end = self.t + experiment.bend_duration
        self.tube.block_load.load.goes(self.t, end, experiment.load)
        self._march(stage, end, experiment.bend_duration / experiment.bend_increments)

    def bend(self) -> None:
        """Load, or push from where the block is."""
        if isinstance(self.experiment, PinchedBending) and self.experiment.push is not None:
            self._push("bend", self.experiment.push)
        else:
            self.load("bend")

    def back(self) -> None:
        """Unload, or move the pusher back."""
        experiment = self.experiment
        assert isinstance(experiment, PinchedBending)
        if experiment.push is not None:
            self._push("return", -experiment.push)
            return
        end = self.t + experiment.bend_duration
        self.tube.block_load.load.goes(self.t, end, 0.0)
        self._march("return", end, experiment.bend_duration / experiment.bend_increments)

    def _push(self, stage: str, by: float) -> None:
        experiment = self.experiment
        assert isinstance(experiment, PinchedBending)
        end = self.t + experiment.bend_duration
        self.tube.block_load.push(self.x, self.t, end, by)
        self._march(stage, end, experiment.bend_duration / experiment.bend_increments)

    def release(self, stage: str = "release") -> None:
        """Pay the tendons out."""
        experiment = self.experiment
        assert isinstance(experiment, ShapeRecovery)
        end = self.t + experiment.duration
        self.tube.tendons.release(self.t, end)
        self._march(stage, end, experiment.duration / experiment.bend_increments)

    def recover(self) -> None:
        """Pull the pairs that were not pulled, with equal forces, up to a share of the closing force."""
        experiment, tube = self.experiment, self.tube
        assert isinstance(experiment, ShapeRecovery)
        others = (tube.tendons.shares == 0).astype(float)
        if not others.any():
            raise ValueError("recover: every pair of pads has been pulled, and none is left to pull the tube open")
        wanted = experiment.recover_force * self.sensed.largest_force("pinch")
        before = float(others @ tube.tendons.shortening(self.x))
        whole = _BEYOND * tube.meeting * float(others.sum())
        end = self.t + experiment.duration * (whole - before) / tube.meeting
        tube.tendons.pull(self.x, others, self.t, end, whole)
        grid = experiment.duration / experiment.bend_increments
        last = self._march("recover", end, grid, lambda now: wanted - now.force)
        if last is not None and last.force < wanted:
            self.notes.append(f"the other pairs reached {last.force:.4g} N of the {wanted:.4g} N that were wanted")
        tube.tendons.hold(self.x, self.t)

    # -- steps ---------------------------------------------------------------------------------------

    def _march(self, stage: str, end: float, grid: float, left: Callable[[_Now], float] | None = None) -> _Now | None:
        """Go to the time ``end``, or to where no force is ``left`` to be reached, N; None when the way was lost.

        Recorded every ``grid`` s; where forces are waited for, more finely as walls meet.
        """
        problem, branch, start = self.tube.problem, self._branch, self.t
        # Drives have kinks here.
        branch.restart(grid / 4)
        number, last, now, told = 1, self._look(), self._look(), start
        # After a failure steps do not grow before they have passed where it was.
        failed, small = self.t, grid
        while self.t < end - 1e-9 * grid:
            here, following = self.t, min(start + number * grid, end)
            step = min(branch.increment, self._longest(last, now, grid, left) if left else grid)
            if here < failed:
                step = min(step, small)
            recorded = here + step >= following - 1e-6 * grid
            target = following if recorded else here + step
            try:
                if not attempt(problem, branch, target, recorded, self._options, self.history, grid):
                    failed, small = target, branch.increment
                    continue
            except DivergedError as error:
                done = 100 * (here - start) / (end - start)
                self.reason = f"stage {stage} stopped at {done:.3g} % of its longest way: {error}{self._hint}"
                self._record(stage)
                return None
            branch.increment = min(branch.increment, grid)
            last, now = now, self._look()
            number += recorded
            stopped = left is not None and left(now) <= 0.0
            near = left is not None and np.isfinite(now.gap) and self.t - told > 0.9 * _BEFORE * grid
            if recorded or stopped or near or (left and now.contact > 0):
                self._record(stage)
                told = self.t
            if stopped:
                break
        return now

    @property
    def _hint(self) -> str:
        if self.tube.part.material.law != "saint-venant-kirchhoff":
            return ""
        return "; the law saint-venant-kirchhoff gives way in sharp folds, neo-hookean does not"

    def _look(self) -> _Now:
        x, t = self.x, self.t
        gap, contact = self.tube.touch(x)
        return _Now(t, self.tube.tendons.joint_force(x, t), gap, contact)

    @staticmethod
    def _longest(last: _Now, now: _Now, grid: float, left: Callable[[_Now], float]) -> float:
        """Longest step, s, that is not likely to run far past a first touch or what is left of a force."""
        passed, result, least = now.t - last.t, grid, _BEFORE * grid
        if now.contact > 0:
            result, least = _TOUCHING * grid, _AFTER * grid
        elif np.isfinite(now.gap):
            closing = (last.gap - now.gap) / passed if passed and np.isfinite(last.gap) else now.gap / grid
            result = _WARY * now.gap / closing if closing > 0 else grid
        before, after = left(last), left(now)
        if np.isfinite(after) and passed and before > after:
            # Where nothing told of that force before, it has only just begun.
            result = min(result, after * passed / (before - after) if np.isfinite(before) else least)
        return float(np.clip(result, least, grid))

    def _record(self, stage: str) -> None:
        self.sensed.read(stage, self._branch.states[-1], self.t)


def _pinched_bending(story: Story) -> list[Callable[[], None]]:
    experiment = story.experiment
    assert isinstance(experiment, PinchedBending)
    if experiment.order == "load first":
        return [story.load, story.pinch]
    closed = [story.pinch, story.settle] if experiment.pinched else []
    return [*closed, story.bend, *([story.back] if experiment.returns else [])]


def _shape_recovery(story: Story) -> list[Callable[[], None]]:
    experiment = story.experiment
    assert isinstance(experiment, ShapeRecovery)
    after = [story.recover, lambda: story.release("let go")] if experiment.recover else []
    return [story.load, story.pinch, story.release, *after]


#: Experiment kind to its stages.
_STAGES: dict[str, Callable[[Story], list[Callable[[], None]]]] = {
    Pinch.__name__: lambda story: [story.pinch],
    PinchedBending.__name__: _pinched_bending,
    ShapeRecovery.__name__: _shape_recovery,
}
