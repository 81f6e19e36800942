"""Steady orbit of the tip over a clamp that shakes."""

from collections.abc import Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from lab.experiments import BaseShake
from lab.records import Channel, Record, Scalar, channels
from lab.specimens import Specimen
from prb.experiments.common import heading, how
from prb.model import PrbModel
from prb.mujoco_model import compile_mechanism
from prb.release import full_states, halved, is_stable, refusal, roll, steps_per_sample, unstable
from prb.statics import Chain

Array = NDArray[np.float64]
#: Steps between two looks at which runs have become steady.
_ROUND = 1024
_FORCES = int(mujoco.mjtState.mjSTATE_XFRC_APPLIED)


@dataclass(frozen=True)
class Orbit:
    """Last period of a shaken mechanism.

    Parameters
    ----------
    path
        Displacements of tip and markers relative to the clamp, (samples, 1 + markers, 3), m.
    periods
        Periods that were simulated.
    change
        Of the path from the period before, see ``BaseShake.change``.
    """

    path: Array
    periods: int
    change: float


def step_of(experiment: BaseShake, time_step: float) -> float:
    """Step that divides the sampling interval and is no longer than ``time_step``, s."""
    rate = experiment.frequency * experiment.samples_per_period
    return 1.0 / (rate * steps_per_sample(rate, time_step))


def orbits(
    models: Sequence[mujoco.MjModel], data: Sequence[mujoco.MjData], experiments: Sequence[BaseShake]
) -> list[Orbit | None]:
    """Steady orbits of mechanisms of one structure, extrapolated to no step; None where a run is not stable.

    Parameters
    ----------
    models
        One per experiment, with the step that ``step_of`` tells; they have as many markers.
    data
        Scratch, one per thread.
    """
    coarse = _until_steady(models, data, experiments)
    with halved(models):
        fine = _until_steady(models, data, experiments)
    return [
        Orbit(2.0 * f.path - c.path, max(f.periods, c.periods), max(f.change, c.change)) if f and c else None
        for f, c in zip(fine, coarse, strict=True)
    ]


@dataclass
class _Shaken:
    """A run on its way to the steady orbit.

    Parameters
    ----------
    stride
        Steps per sample.
    state
        The simulator's, (size,).
    rest
        Places of tip and markers at rest, (1 + markers, 3), m.
    kept
        Displacements that may still be needed, (n, 1 + markers, 3), m; the first is ``dropped`` periods after t = 0.
    """

    experiment: BaseShake
    model: mujoco.MjModel
    stride: int
    state: Array
    rest: Array
    kept: Array
    steps: int = 0
    dropped: int = 0
    orbit: Orbit | None = None
    lost: bool = False

    @classmethod
    def begin(cls, experiment: BaseShake, model: mujoco.MjModel, data: mujoco.MjData) -> "_Shaken":
        """At rest."""
        chain = Chain(model, data)
        stride = round(experiment.period / (experiment.samples_per_period * model.opt.timestep))
        state, rest = full_states(model, chain.laws.with_hidden(chain.slack)[None])[0], chain.sites(chain.slack)
        lost = not is_stable(model, data, chain.slack)
        return cls(experiment, model, stride, state, rest, np.empty((0, *rest.shape)), lost=lost)

    @property
    def done(self) -> bool:
        return self.lost or self.orbit is not None

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
        sampled = places[-self.steps % self.stride :: self.stride].reshape(-1, *self.rest.shape) - self.rest
        self.kept, self.state, self.steps = np.concatenate([self.kept, sampled]), states[-1], self.steps + count
        while not (self.done or len(self.kept) <= 2 * self.experiment.samples_per_period):
            self._compare()

    def _compare(self) -> None:
        whole, e = self.experiment.samples_per_period, self.experiment
        before, after = self.kept[: whole + 1], self.kept[whole : 2 * whole + 1]
        change, periods = e.change(before[:, 1:], after[:, 1:]), self.dropped + 2
        if (self.dropped >= e.ramp_periods and change < e.tolerance) or periods >= e.max_periods:
            self.orbit = Orbit(after, periods, change)
        self.kept, self.dropped = self.kept[whole:], self.dropped + 1


def _until_steady(
    models: Sequence[mujoco.MjModel], data: Sequence[mujoco.MjData], experiments: Sequence[BaseShake]
) -> list[Orbit | None]:
    runs = [_Shaken.begin(e, model, data[0]) for e, model in zip(experiments, models, strict=True)]
    while active := [run for run in runs if not run.done]:
        forces, begin = np.array([run.forces(_ROUND) for run in active]), np.array([run.state for run in active])
        states, places = roll([r.model for r in active], data, begin, _ROUND, control=forces, control_spec=_FORCES)
        for run, after, before in zip(active, states, places, strict=True):
            run.advance(after, before)
    return [run.orbit for run in runs]


def base_shake(specimen: Specimen, experiment: BaseShake, model: PrbModel) -> Record:
    """Clamp shaken until the orbit is steady; seen from the clamp, where every link feels its inertial force.

    Returns
    -------
    record
        Channels ``time`` (samples,), ``markers`` (samples, markers, 3) and ``tip`` (samples, 3) over the last
        period, relative to the clamp, m; scalar ``periods``.
    """
    step = step_of(experiment, model.time_step)
    compiled = compile_mechanism(model.mechanism(specimen).in_motion, experiment.markers, step)
    head = heading(specimen, experiment, model)
    begin = perf_counter()
    if reason := refusal(compiled):
        facts = how(specimen, model, perf_counter() - begin, time_step=step)
        return Record(**head, how=facts, status="unsupported", reason=reason)
    [orbit] = orbits([compiled], [mujoco.MjData(compiled)], [experiment])
    facts = how(specimen, model, perf_counter() - begin, time_step=step)
    if orbit is None:
        return Record(**head, how=facts, status="diverged", reason=unstable(step))
    facts |= {"seconds_per_10_s": facts["wall_time_s"] * 10.0 / (orbit.periods * experiment.period)}
    return Record(
        **head,
        channels=_channels(experiment, orbit.path),
        scalars={
            "periods": Scalar(
                float(orbit.periods), "1", "periods until the orbit was steady, those of the rise included"
            ),
            "change": Scalar(orbit.change, "1", "largest change of the path in the last period over its size"),
        },
        how=facts,
        **unsteady(experiment, orbit),
    )


def unsteady(experiment: BaseShake, orbit: Orbit) -> dict[str, Any]:
    """Status and reason of an orbit that still changes; empty for a steady one."""
    if orbit.change < experiment.tolerance:
        return {}
    reason = (
        f"not steady after {orbit.periods} periods: the last one still changed the path by "
        f"{100 * orbit.change:.3g} % of its size, {100 * experiment.tolerance:.3g} % is allowed"
    )
    return {"status": "diverged", "reason": reason}


def _channels(experiment: BaseShake, path: Array) -> dict[str, Channel]:
    return channels(
        Channel("time", "s", experiment.times, ("time",), "time since the clamp passed its middle along +z"),
        Channel("markers", "m", path[:, 1:], ("time", "marker", "axis"), "marker displacement relative to the clamp"),
        Channel("tip", "m", path[:, 0], ("time", "axis"), "displacement of the tip's centre relative to the clamp"),
    )
