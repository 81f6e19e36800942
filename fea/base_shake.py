"""``BaseShake`` by finite elements: shells, since only their steps are fast enough for a steady orbit."""

from collections import deque
from dataclasses import dataclass
from math import ceil
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fea.carrier import Carrier
from fea.dynamics import Blend
from fea.model import FeaModel
from fea.pictures import fields
from fea.setting_up import Mesh, how, make_part, said, warm_up, warm_up_motion
from fea.shell import Shell
from fea.shell_motion import ShellMotion, Trajectory
from lab.experiments import BaseShake
from lab.records import Channel, Record, Scalar, channels
from lab.settling import Settling
from lab.specimens import TwistedBeam

if TYPE_CHECKING:
    from fea.hanging import Hung

Array = NDArray[np.float64]

#: Deformed states kept for pictures, spread over the last period.
_SHOWN = 12
#: Below this rounding is felt.
_SMALLEST_TOLERANCE = 1e-9
#: Residual relative to the largest reaction so far, that of the motion: see ``_tolerance``.
_TOLERANCE = 1e-5


@dataclass(frozen=True)
class _Orbit:
    """The last period: path of the shell, markers and tip from rest; how many it took, how it settled."""

    path: Trajectory
    markers: Array
    tip: Array
    periods: int
    settling: Settling
    reason: str = ""


def perform(specimen: TwistedBeam, experiment: BaseShake, model: FeaModel, mesh: Mesh) -> Record:
    """Shake the clamp until the orbit of the tip is steady; see ``fea.perform``."""
    if model.element != "shell":
        return Record(
            **said(specimen, experiment, model), status="unsupported",
            reason="solids are not shaken: a steady orbit takes thousands of steps of a second each; "
                   "choose 'element: shell'",
        )  # fmt: skip
    warm_up(model.linear_solver, model.element)
    warm_up_motion()
    began = perf_counter()
    part = make_part(specimen, model, mesh)
    assert isinstance(part, Shell)
    start: Hung | None = None
    if experiment.own_gravity is not None:
        # Statics load a third of the engine, which a shake without gravity does not need.
        from fea.hanging import hang

        start = hang(part, specimen, model, experiment.own_gravity)
        if start.reason:
            return _not_begun(specimen, experiment, model, part, start, perf_counter() - began)
    motion = ShellMotion(
        part, {"tip": specimen.tip_mass}, start.weight if start else None, tolerance=_tolerance(experiment)
    )
    substeps = _substeps(experiment, model)
    carrier = Carrier(part, np.array(experiment.markers))
    orbit = _shaken(motion, carrier, start.rest if start else np.zeros_like(part.points), experiment, substeps)
    seconds = perf_counter() - began
    history: dict[str, Any] = {"dynamic": _said_of_steps(experiment, substeps, orbit)}
    if start:
        history["static"] = start.run.history
    shown = np.linspace(0, len(orbit.tip) - 1, min(_SHOWN, len(orbit.tip))).round().astype(int)
    return Record(
        **said(specimen, experiment, model),
        channels=_channels(experiment, model, orbit, history),
        scalars={
            "periods": Scalar(float(orbit.periods), "1", "periods, those of the rise included"),
            "change": Scalar(orbit.settling.change, "1", "largest change of the path in the last period over its size"),
            "remaining": Scalar(orbit.settling.remaining, "1", "transient that may be left over the size of the path"),
        },
        how=how(part, model, "compiled banded LDL", seconds, history),
        status="diverged" if orbit.reason else "completed",
        reason=orbit.reason,
        fields=fields(part, list(experiment.times[shown]), list(orbit.path.displacement[shown])),
    )


def _not_begun(
    specimen: TwistedBeam, experiment: BaseShake, model: FeaModel, part: Shell, start: "Hung", seconds: float
) -> Record:
    """Record of a beam that does not find its rest."""
    return Record(
        **said(specimen, experiment, model), status="diverged", reason=start.reason,
        how=how(part, model, start.run.problem.linear, seconds, {"static": start.run.history}),
        fields=fields(part, [0.0], [start.hung]),
    )  # fmt: skip


def _tolerance(experiment: BaseShake) -> float:
    """Residual relative to the reactions, which a weight enlarges: as small as if they were those of the motion."""
    if experiment.own_gravity is None:
        return _TOLERANCE
    shaken = experiment.amplitude * (2 * np.pi * experiment.frequency) ** 2
    return float(max(_TOLERANCE * shaken / (shaken + experiment.gravity), _SMALLEST_TOLERANCE))


def _said_of_steps(experiment: BaseShake, substeps: int, orbit: _Orbit) -> dict[str, Any]:
    per_period = experiment.samples_per_period * substeps
    return {
        "method": "generalised-alpha", "rho_inf": Blend().rho, "tolerance": _tolerance(experiment),
        "steps": orbit.periods * per_period, "time_step": experiment.period / per_period,
    }  # fmt: skip


def _substeps(experiment: BaseShake, model: FeaModel) -> int:
    """Steps between two samples."""
    interval = experiment.period / experiment.samples_per_period
    longest = max(model.time_step, experiment.period / model.steps_per_period)
    # A hair of tolerance, so that 0.7 ms times 4 may fill an interval of 2.8 ms.
    return ceil(interval / longest - 1e-9)


def _shaken(motion: ShellMotion, carrier: Carrier, rest: Array, experiment: BaseShake, substeps: int) -> _Orbit:
    """Period after period from ``rest`` (nodes, 3), m, until little is left of the transient."""
    interval, drive = experiment.period / experiment.samples_per_period, experiment.base.acceleration
    state = motion.begin(interval / substeps, drive(np.zeros(1))[0], rest)
    markers_at_rest, tip_at_rest = carrier.read(rest)
    # A speed counts as what it moves in 1 / (2 pi f).
    scale = np.repeat([1.0, experiment.period / (2 * np.pi)], len(state.u))
    settling = Settling(scale, experiment.tolerance)
    before, ends = np.empty(0), deque([np.concatenate([state.u, state.v])], maxlen=3)
    for period in range(experiment.max_periods):
        since = period * experiment.period
        path = motion.go_on(state, interval, experiment.samples, substeps, drive, since=since)
        read = [carrier.read(moved) for moved in path.displacement]
        markers, tip = np.array([m for m, _ in read]) - markers_at_rest, np.array([t for _, t in read]) - tip_at_rest
        if path.stopped:
            reason = f"the motion stopped in period {period + 1}: {path.stopped}"
            return _Orbit(path, markers, tip, period, settling, reason)
        ends.append(np.concatenate([state.u, state.v]))
        if len(before):
            # The end of a transient is not foreseen here: a state that is put together from others strains what is
            # stiff, and the steps then find no equilibrium.
            settling.add(experiment.change(before, markers), np.array(ends))
            if settling.is_steady:
                return _Orbit(path, markers, tip, period + 1, settling)
        if period >= experiment.rising_periods:
            before = markers
    reason = settling.reason(experiment.max_periods, experiment.tolerance)
    return _Orbit(path, markers, tip, experiment.max_periods, settling, reason)


def _channels(experiment: BaseShake, model: FeaModel, orbit: _Orbit, history: dict[str, Any]) -> dict[str, Channel]:
    n, markers = len(orbit.tip), orbit.markers
    if model.noise > 0:
        markers = markers + np.random.default_rng(model.seed).normal(0.0, model.noise, markers.shape)
        history["noise"] = f"Gaussian, {model.noise:g} m on every marker coordinate, seed {model.seed}"
    of_markers = "displacement of the markers from rest relative to the clamp"
    return channels(
        Channel("time", "s", experiment.times[:n], ("time",), "time since the last period began"),
        Channel("markers", "m", markers, ("time", "marker", "axis"), of_markers),
        Channel("tip", "m", orbit.tip, ("time", "axis"), "displacement of the tip's centre, likewise"),
        Channel("kinetic_energy", "J", orbit.path.kinetic, ("time",), "kinetic energy of the motion about the clamp"),
        Channel("strain_energy", "J", orbit.path.strain, ("time",), "strain energy"),
    )
