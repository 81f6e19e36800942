"""``RingDown`` by finite elements."""

from dataclasses import dataclass, field
from math import ceil
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fea.carrier import Carrier
from fea.dynamics import Blend, Dynamics, StoppedError
from fea.hanging import Hung, hang
from fea.model import FeaModel
from fea.parts import Deformable
from fea.pictures import fields
from fea.setting_up import Mesh, how, make_part, said, warm_up, warm_up_motion
from fea.shell import Shell
from lab.experiments import RingDown
from lab.records import Channel, Record, channels
from lab.specimens import TwistedBeam

Array = NDArray[np.float64]

#: Deformed states kept for pictures, spread over the first ``_SHOWN_UNTIL`` seconds.
_SHOWN, _SHOWN_UNTIL = 12, 0.060
#: Dynamics: residual relative to the largest reaction so far; 1e-5 of it moved the markers by 2 um of 18 mm.
_DYNAMIC_TOLERANCE = 1e-5


@dataclass
class _Sensed:
    """Samples of the record as they come in; ``rest`` (nodes, 3), m, is what markers are measured from."""

    carrier: Carrier
    rest: Array
    markers: list[Array] = field(default_factory=list)
    tip: list[Array] = field(default_factory=list)
    kinetic: list[float] = field(default_factory=list)
    strain: list[float] = field(default_factory=list)
    states: list[tuple[float, Array]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._markers_at_rest, self._tip_at_rest = self.carrier.read(self.rest)

    def read(self, experiment: RingDown, displacement: Array, kinetic: float, strain: float) -> None:
        number = len(self.tip)
        markers, tip = self.carrier.read(displacement)
        self.markers.append(markers - self._markers_at_rest)
        self.tip.append(tip - self._tip_at_rest)
        self.kinetic.append(kinetic)
        self.strain.append(strain)
        shown = np.linspace(0, min(_SHOWN_UNTIL, experiment.duration) * experiment.rate, _SHOWN).round()
        if number in shown:
            self.states.append((number / experiment.rate, displacement))


def perform(specimen: TwistedBeam, experiment: RingDown, model: FeaModel, mesh: Mesh) -> Record:
    """Hang the load, cut it, and follow the free motion; see ``fea.perform``."""
    warm_up(model.linear_solver, model.element)
    if model.element == "shell":
        warm_up_motion()
    began = perf_counter()
    part = make_part(specimen, model, mesh)
    carrier = Carrier(part, np.array(experiment.markers))
    start = hang(part, specimen, model, experiment.own_gravity, hanging_load(carrier, part, experiment))
    sensed, reason = _Sensed(carrier, start.rest), start.reason
    history: dict[str, Any] = {"static": start.run.history}
    if reason:
        sensed.states.append((0.0, start.hung))
    else:
        swing = _swing_shell if isinstance(part, Shell) else _swing
        try:
            history["dynamic"] = swing(part, start, specimen, experiment, model, sensed)
        except StoppedError as error:
            reason = f"the motion stopped at {error.time:.6g} s of {experiment.duration:g} s: {error}"
    seconds = perf_counter() - began
    return Record(
        **said(specimen, experiment, model),
        channels=_channels(experiment, model, sensed, history),
        how=how(part, model, start.run.problem.linear, seconds, history),
        status="diverged" if reason else "completed",
        reason=reason,
        fields=fields(part, *map(list, zip(*sensed.states, strict=True))),
    )


def hanging_load(carrier: Carrier, part: Deformable, experiment: RingDown) -> Array:
    """Nodal forces (nodes, 3), N, of the weight at its place on the tip face."""
    load = np.zeros_like(part.points)
    load[carrier.nodes] = np.outer(carrier.hung_at(np.array(experiment.load_place)), experiment.load)
    return load


def _steps(experiment: RingDown, model: FeaModel) -> tuple[float, int]:
    """Interval between samples, s, and the number of steps that fill it."""
    interval = 1.0 / experiment.rate
    # A hair of tolerance, so that 0.7 ms times 4 may fill an interval of 2.8 ms.
    return interval, ceil(interval / model.time_step - 1e-9)


def _swing(
    part: Deformable, start: Hung, specimen: TwistedBeam, experiment: RingDown, model: FeaModel, sensed: _Sensed
) -> dict[str, Any]:
    """Motion after the release; returns what the integrator did."""
    swinging = Dynamics(part, {"tip": specimen.tip_mass}, start.weight, model.linear_solver, _DYNAMIC_TOLERANCE)
    interval, substeps = _steps(experiment, model)
    hung = start.hung.reshape(-1)[swinging.free]
    begin = swinging.start(hung, np.zeros_like(hung))
    for motion in swinging.samples(begin, interval, experiment.samples, substeps):
        moved = swinging.nodal(motion.u)
        sensed.read(experiment, moved, swinging.kinetic_energy(motion), swinging.strain_energy(motion))
    return swinging.summary()


def _swing_shell(
    part: Deformable, start: Hung, specimen: TwistedBeam, experiment: RingDown, model: FeaModel, sensed: _Sensed
) -> dict[str, Any]:
    """The same by compiled steps."""
    from fea.shell_motion import ShellMotion

    assert isinstance(part, Shell)
    swinging = ShellMotion(part, {"tip": specimen.tip_mass}, start.weight, tolerance=_DYNAMIC_TOLERANCE)
    interval, substeps = _steps(experiment, model)
    path = swinging.run(interval, experiment.samples, substeps, u=start.hung)
    for moved, kinetic, strain in zip(path.displacement, path.kinetic, path.strain, strict=True):
        sensed.read(experiment, moved, float(kinetic), float(strain))
    if path.stopped:
        raise StoppedError(path.stopped, float(path.times[-1]))
    return {
        "method": "generalised-alpha", "rho_inf": Blend().rho, "tolerance": _DYNAMIC_TOLERANCE,
        "steps": substeps * (experiment.samples - 1),
    }  # fmt: skip


def _channels(experiment: RingDown, model: FeaModel, sensed: _Sensed, history: dict[str, Any]) -> dict[str, Channel]:
    n = len(sensed.tip)
    markers = np.reshape(sensed.markers, (n, len(experiment.markers), 3))
    if model.noise > 0:
        markers = markers + np.random.default_rng(model.seed).normal(0.0, model.noise, markers.shape)
        history["noise"] = f"Gaussian, {model.noise:g} m on every marker coordinate, seed {model.seed}"
    return channels(
        Channel("time", "s", np.arange(n) / experiment.rate, ("time",), "time since the release"),
        Channel("markers", "m", markers, ("time", "marker", "axis"), "displacement of the markers from rest"),
        Channel("tip", "m", np.reshape(sensed.tip, (n, 3)), ("time", "axis"), "displacement of the tip's centre"),
        Channel("kinetic_energy", "J", np.array(sensed.kinetic), ("time",), "kinetic energy"),
        Channel("strain_energy", "J", np.array(sensed.strain), ("time",), "strain energy"),
    )
