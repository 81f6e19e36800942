"""``BaseShake`` by finite elements: shells, since only their steps are fast enough for a steady orbit."""

from dataclasses import dataclass
from math import ceil
from time import perf_counter
from typing import Any

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
from lab.specimens import Specimen

Array = NDArray[np.float64]

#: Deformed states kept for pictures, spread over the last period.
_SHOWN = 12
#: Residual relative to the largest reaction so far.
_TOLERANCE = 1e-5


@dataclass(frozen=True)
class _Orbit:
    """The last period: path of the shell, markers and tip, how many periods it took, and the last change."""

    path: Trajectory
    markers: Array
    tip: Array
    periods: int
    change: float
    reason: str = ""


def perform(specimen: Specimen, experiment: BaseShake, model: FeaModel, mesh: Mesh) -> Record:
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
    motion = ShellMotion(part, {"tip": specimen.tip_mass}, tolerance=_TOLERANCE)
    substeps = _substeps(experiment, model)
    orbit = _shaken(motion, Carrier(part, np.array(experiment.markers)), experiment, substeps)
    seconds = perf_counter() - began
    history: dict[str, Any] = {"dynamic": _said_of_steps(experiment, substeps, orbit)}
    shown = np.linspace(0, len(orbit.tip) - 1, min(_SHOWN, len(orbit.tip))).round().astype(int)
    return Record(
        **said(specimen, experiment, model),
        channels=_channels(experiment, model, orbit, history),
        scalars={
            "periods": Scalar(float(orbit.periods), "1", "periods, those of the rise included"),
            "change": Scalar(orbit.change, "1", "largest change of the path in the last period over its size"),
        },
        how=how(part, model, "compiled banded LDL", seconds, history),
        status="diverged" if orbit.reason else "completed",
        reason=orbit.reason,
        fields=fields(part, list(experiment.times[shown]), list(orbit.path.displacement[shown])),
    )


def _said_of_steps(experiment: BaseShake, substeps: int, orbit: _Orbit) -> dict[str, Any]:
    per_period = experiment.samples_per_period * substeps
    return {
        "method": "generalised-alpha", "rho_inf": Blend().rho, "tolerance": _TOLERANCE,
        "steps": orbit.periods * per_period, "time_step": experiment.period / per_period,
    }  # fmt: skip


def _substeps(experiment: BaseShake, model: FeaModel) -> int:
    """Steps between two samples."""
    interval = experiment.period / experiment.samples_per_period
    # A hair of tolerance, so that 0.7 ms times 4 may fill an interval of 2.8 ms.
    return ceil(interval / model.time_step - 1e-9)


def _shaken(motion: ShellMotion, carrier: Carrier, experiment: BaseShake, substeps: int) -> _Orbit:
    """Period after period, until two whole ones at full amplitude are alike."""
    interval, drive = experiment.period / experiment.samples_per_period, experiment.base.acceleration
    state = motion.begin(interval / substeps, drive(np.zeros(1))[0])
    before: Array | None = None
    change = float("nan")
    for period in range(experiment.max_periods):
        since = period * experiment.period
        path = motion.go_on(state, interval, experiment.samples, substeps, drive, since=since)
        read = [carrier.read(moved) for moved in path.displacement]
        markers, tip = (np.array(column) for column in zip(*read, strict=True))
        if path.stopped:
            reason = f"the motion stopped in period {period + 1}: {path.stopped}"
            return _Orbit(path, markers, tip, period, change, reason)
        if before is not None:
            change = experiment.change(before, markers)
            if change < experiment.tolerance:
                return _Orbit(path, markers, tip, period + 1, change)
        if period >= experiment.ramp_periods:
            before = markers
    reason = f"not steady after {experiment.max_periods} periods: the last one still changed the path by "
    reason += f"{100 * change:.3g} % of its size, {100 * experiment.tolerance:.3g} % is allowed"
    return _Orbit(path, markers, tip, experiment.max_periods, change, reason)


def _channels(experiment: BaseShake, model: FeaModel, orbit: _Orbit, history: dict[str, Any]) -> dict[str, Channel]:
    n, markers = len(orbit.tip), orbit.markers
    if model.noise > 0:
        markers = markers + np.random.default_rng(model.seed).normal(0.0, model.noise, markers.shape)
        history["noise"] = f"Gaussian, {model.noise:g} m on every marker coordinate, seed {model.seed}"
    of_markers = "displacement of the markers relative to the clamp"
    return channels(
        Channel("time", "s", experiment.times[:n], ("time",), "time since the last period began"),
        Channel("markers", "m", markers, ("time", "marker", "axis"), of_markers),
        Channel("tip", "m", orbit.tip, ("time", "axis"), "displacement of the tip's centre relative to the clamp"),
        Channel("kinetic_energy", "J", orbit.path.kinetic, ("time",), "kinetic energy of the motion about the clamp"),
        Channel("strain_energy", "J", orbit.path.strain, ("time",), "strain energy"),
    )
