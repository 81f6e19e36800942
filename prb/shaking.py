"""Motion of compiled mechanisms over a shaken clamp until it repeats, many at a time."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import ceil

import mujoco
import numpy as np
from numpy.typing import NDArray

from lab.experiments import BaseShake
from lab.settling import Settling
from prb.release import full_states, halved, is_stable, roll, steps_per_sample
from prb.statics import Chain, Load, hang

Array = NDArray[np.float64]
#: Fewest and most steps between two looks at which runs have become steady.
_SHORTEST, _LONGEST = 256, 1024
#: Share of the permitted transient that the runs with whole steps may leave.
_SHARE = 0.5
_FORCES = int(mujoco.mjtState.mjSTATE_XFRC_APPLIED)


@dataclass(frozen=True)
class Orbit:
    """Last period of a shaken mechanism.

    Parameters
    ----------
    path
        Displacements of tip and markers from rest relative to the clamp, (samples, 1 + markers, 3), m.
    joints
        Joint coordinates, (samples, joints), rad or m.
    periods
        Periods until then.
    change
        Of the path from the period before, see ``BaseShake.change``.
    remaining
        What may be left of the transient over the path's size, see ``BaseShake.remaining``.
    reason
        Why it is not steady; empty for a steady orbit.
    worth
        Periods that could have been simulated with both steps for the work that was done.
    """

    path: Array
    joints: Array
    periods: int
    change: float
    remaining: float
    reason: str
    worth: float


def step_of(experiment: BaseShake, time_step: float) -> float:
    """Step that divides the sampling interval and is no longer than ``time_step``, s."""
    rate = experiment.frequency * experiment.samples_per_period
    return 1.0 / (rate * steps_per_sample(rate, time_step))


def rest_of(chain: Chain, experiment: BaseShake) -> Array:
    """Posture before the clamp moves, (joints,), rad or m; NotConverged where own weight has no equilibrium."""
    gravity = experiment.own_gravity
    return hang(chain, Load(np.zeros(3), None, None if gravity is None else np.array(gravity)))


def orbits(
    models: Sequence[mujoco.MjModel],
    data: Sequence[mujoco.MjData],
    experiments: Sequence[BaseShake],
    rests: Sequence[Array],
) -> list[Orbit | None]:
    """Steady orbits of mechanisms of one structure, extrapolated to no step; None where a run is not stable.

    The steady orbit of the models' steps is where half steps start: where a mechanism has several orbits, both stay
    on one, and what is left to settle is small.  An orbit that is not steady stays that of the models' steps.

    Parameters
    ----------
    models
        One per experiment, with its gravity and with the step that ``step_of`` tells; they have as many markers.
    data
        Scratch, one per thread.
    rests
        Postures from which the runs start and the markers are measured, (joints,) each, rad or m; see ``rest_of``.
    """
    begins = zip(experiments, models, rests, strict=True)
    coarse = [_Shaken.begin(e, model, data[0], rest) for e, model, rest in begins]
    _until_steady(coarse, data)
    fine: dict[int, _Shaken] = {}
    with halved([run.model for run in coarse if run.is_steady]):
        for number, run in enumerate(coarse):
            if run.is_steady:
                fine[number] = run.with_half_steps(data[0])
        _until_steady(list(fine.values()), data)
    return [_orbit(run, fine.get(number)) for number, run in enumerate(coarse)]


def _orbit(coarse: "_Shaken", fine: "_Shaken | None") -> Orbit | None:
    if coarse.lost or (fine and fine.lost):
        return None
    if fine is None:
        settling, periods = coarse.settling, coarse.periods
        reason = settling.reason(periods, coarse.experiment.tolerance)
        return Orbit(
            coarse.places, coarse.joints, periods, settling.change, settling.remaining, reason, periods / 3.0
        )  # fmt: skip
    return Orbit(
        2.0 * fine.places - coarse.places,
        2.0 * fine.joints - coarse.joints,
        fine.periods,
        max(fine.settling.change, coarse.settling.change),
        2.0 * fine.settling.remaining + coarse.settling.remaining,
        "" if fine.is_steady else fine.settling.reason(fine.periods, fine.experiment.tolerance),
        (coarse.periods + 2.0 * (fine.periods - coarse.periods)) / 3.0,
    )


@dataclass
class _Shaken:
    """A run on its way to the steady orbit.

    Parameters
    ----------
    posture, rest
        Joint coordinates at rest (joints,), rad or m, and the places of tip and markers there (1 + markers, 3), m.
    stride
        Steps per sample.
    settling
        How it settles, by the simulator's states without their time.
    first, last
        Periods after which the first change counts, and after which to give up.
    state
        The simulator's, (size,), after ``steps`` steps since the clamp began to move.
    places, states
        Displacements (n, 1 + markers, 3), m, and the simulator's states (n, size) that may still be needed; the first
        is ``dropped`` periods after the clamp began to move.  Of a run that is done: those of the last period.
    """

    experiment: BaseShake
    model: mujoco.MjModel
    posture: Array
    rest: Array
    stride: int
    settling: Settling
    first: int
    last: int
    state: Array
    places: Array
    states: Array
    steps: int = 0
    dropped: int = 0
    done: bool = False
    lost: bool = False

    @classmethod
    def begin(cls, experiment: BaseShake, model: mujoco.MjModel, data: mujoco.MjData, posture: Array) -> "_Shaken":
        """At rest in a posture."""
        chain = Chain(model, data)
        state, rest = full_states(model, chain.laws.with_hidden(posture)[None])[0], chain.sites(posture)
        stride = round(experiment.period / (experiment.samples_per_period * model.opt.timestep))
        none = np.empty((0, *rest.shape)), np.empty((0, len(state)))
        # Speeds count as the displacements that they become.
        scale = np.repeat([1.0, experiment.period / (2.0 * np.pi)], [model.nq, model.nv])
        settling = Settling(scale, _SHARE * experiment.tolerance)
        limits = ceil(experiment.rising_periods), experiment.max_periods
        run = cls(experiment, model, posture, rest, stride, settling, *limits, state, *none)
        run.lost = not is_stable(model, data, posture)
        return run

    def with_half_steps(self, data: mujoco.MjData) -> "_Shaken":
        """From where this run is done, on a model whose step has been halved."""
        # Its transient counts twice in the extrapolation.
        return replace(
            self, stride=2 * self.stride,
            settling=self.settling.resumed((1.0 - _SHARE) / 2.0 * self.experiment.tolerance),
            first=self.periods, last=self.periods + self.last, dropped=self.periods, state=self.states[-1],
            steps=self.periods * self.experiment.samples_per_period * 2 * self.stride,
            places=self.places[:0], states=self.states[:0], done=False,
            lost=not is_stable(self.model, data, self.posture),
        )  # fmt: skip

    @property
    def is_steady(self) -> bool:
        return self.done and self.settling.is_steady

    @property
    def periods(self) -> int:
        """Up to the end of the later one of the periods that are compared."""
        return self.dropped + 2

    @property
    def joints(self) -> Array:
        """Joint coordinates beside ``places``, (n, joints), rad or m."""
        return self.states[:, 1 : 1 + len(self.posture)]

    @property
    def due(self) -> int:
        """Steps until the run may be found steady."""
        # Two changes, which are those of three periods.
        return max(self.periods, self.first + 3) * self.experiment.samples_per_period * self.stride + 1 - self.steps

    def forces(self, count: int) -> Array:
        """Inertial forces of the moving frame on every body in the next steps, (count, 6 bodies), N and N*m."""
        times = (self.steps + np.arange(count)) * self.model.opt.timestep
        acceleration = self.experiment.base.acceleration(times)
        forces = np.zeros((count, self.model.nbody, 6))
        forces[:, :, :3] = -acceleration[:, None] * self.model.body_mass[:, None]
        return forces.reshape(count, -1)

    def advance(self, states: Array, places: Array) -> None:
        """Take in the states after and the places before some steps, and look at the periods that are complete."""
        count, step = len(states), self.model.opt.timestep
        self.lost = not (states[-1, 0] > (self.steps + count - 0.5) * step and np.isfinite(places).all())
        sampled = np.arange(-self.steps % self.stride, count, self.stride)
        visited = states[sampled - 1]
        if len(sampled) and not sampled[0]:
            visited[0] = self.state  # that before the first step
        self.states = np.concatenate([self.states, visited])
        self.places = np.concatenate([self.places, places[sampled].reshape(-1, *self.rest.shape) - self.rest])
        self.state, self.steps = states[-1], self.steps + count
        while not (self.lost or self.done or len(self.places) <= 2 * self.experiment.samples_per_period):
            self._compare()

    def _compare(self) -> None:
        whole = self.experiment.samples_per_period
        before, after = slice(whole + 1), slice(whole, 2 * whole + 1)
        if self.dropped >= self.first:
            change = self.experiment.change(self.places[before, 1:], self.places[after, 1:])
            self.settling.add(change, self.states[[0, whole, 2 * whole], 1:])
        self.done = self.settling.is_steady or self.periods >= self.last
        if self.done:
            self.places, self.states = self.places[after], self.states[after]
        elif (end := self._foreseen()) is not None:
            self.state, self.steps = end, self.periods * whole * self.stride
            self.dropped = self.first = self.periods
            self.places, self.states = self.places[:0], self.states[:0]
        else:
            self.places, self.states, self.dropped = self.places[whole:], self.states[whole:], self.dropped + 1

    def _foreseen(self) -> Array | None:
        """State at the end of a period without the transient, (size,), where that can be told and checked."""
        if self.periods + 3 > self.last:
            return None  # nothing would show whether it is right
        end, whole = self.settling.foresee(), self.experiment.samples_per_period
        return None if end is None else np.concatenate([self.states[2 * whole, :1], end])


def _until_steady(runs: Sequence[_Shaken], data: Sequence[mujoco.MjData]) -> None:
    while active := [run for run in runs if not (run.done or run.lost)]:
        count = min(max(min(run.due for run in active), _SHORTEST), _LONGEST)
        forces, begin = np.array([run.forces(count) for run in active]), np.array([run.state for run in active])
        states, places = roll([r.model for r in active], data, begin, count, control=forces, control_spec=_FORCES)
        for run, after, before in zip(active, states, places, strict=True):
            run.advance(after, before)
