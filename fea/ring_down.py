"""``RingDown`` by finite elements."""

from dataclasses import dataclass, field
from functools import cache
from math import ceil
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray
from skfem import MeshQuad2

from fea.case import Case
from fea.dynamics import Blend, Dynamics, StoppedError
from fea.model import FeaModel
from fea.newton import Options
from fea.parts import Deformable
from fea.pictures import fields
from fea.rigid_part import mean_rigid_motion
from fea.setting_up import Mesh, how, make_part, said, warm_up
from fea.shell import Shell
from fea.statics import static
from lab.experiments import RingDown
from lab.materials import Material
from lab.records import Channel, Record, channels
from lab.specimens import Specimen

Array = NDArray[np.float64]

#: Deformed states kept for pictures, spread over the first ``_SHOWN_UNTIL`` seconds.
_SHOWN, _SHOWN_UNTIL = 12, 0.060
#: Dynamics: residual relative to the largest reaction so far; 1e-5 of it moved the markers by 2 um of 18 mm.
_DYNAMIC_TOLERANCE = 1e-5


class Carrier:
    """Light carrier of the markers, riding on the mean rigid motion of the tip face."""

    def __init__(self, part: Deformable, places: Array) -> None:
        self.places = places
        self.nodes = part.boundary("tip")
        self.shares = part.shares("tip")[self.nodes]
        points = part.points[self.nodes]
        self.arms = points - self.shares @ points / self.shares.sum()

    def read(self, displacement: Array) -> tuple[Array, Array]:
        """Displacements of the markers (marker, 3) and of the tip's centre (3,), m."""
        shift, turn = mean_rigid_motion(self.arms, self.shares, displacement[self.nodes])
        return shift + self.places @ (turn - np.eye(3)).T, shift


@dataclass
class _Sensed:
    """Samples of the record as they come in."""

    carrier: Carrier
    markers: list[Array] = field(default_factory=list)
    tip: list[Array] = field(default_factory=list)
    kinetic: list[float] = field(default_factory=list)
    strain: list[float] = field(default_factory=list)
    states: list[tuple[float, Array]] = field(default_factory=list)

    def read(self, experiment: RingDown, displacement: Array, kinetic: float, strain: float) -> None:
        number = len(self.tip)
        markers, tip = self.carrier.read(displacement)
        self.markers.append(markers)
        self.tip.append(tip)
        self.kinetic.append(kinetic)
        self.strain.append(strain)
        shown = np.linspace(0, min(_SHOWN_UNTIL, experiment.duration) * experiment.rate, _SHOWN).round()
        if number in shown:
            self.states.append((number / experiment.rate, displacement))


def perform(specimen: Specimen, experiment: RingDown, model: FeaModel, mesh: Mesh) -> Record:
    """Hang the load, cut it, and follow the free motion; see ``fea.perform``."""
    warm_up(model.linear_solver, model.element)
    if model.element == "shell":
        _warm_up_motion()
    began = perf_counter()
    part = make_part(specimen, model, mesh)
    hanging = Case(part, solver=model.linear_solver).fix("root").force("tip", experiment.load)
    hung = static(hanging, [1.0], options=Options(tolerance=model.tolerance))
    sensed, reason = _Sensed(Carrier(part, np.array(experiment.markers))), ""
    history: dict[str, Any] = {"static": hung.history}
    if hung.completed:
        swing = _swing_shell if isinstance(part, Shell) else _swing
        try:
            history["dynamic"] = swing(part, hung.field(), specimen, experiment, model, sensed)
        except StoppedError as error:
            reason = f"the motion stopped at {error.time:.6g} s of {experiment.duration:g} s: {error}"
    else:
        sensed.states.append((0.0, hung.field()))
        reason = f"the hanging load was reached to {100 * hung.reached:.3g} % only: {hung.reason}"
    seconds = perf_counter() - began
    return Record(
        **said(specimen, experiment, model),
        channels=_channels(experiment, model, sensed, history),
        how=how(part, model, hung.problem.linear, seconds, history),
        status="diverged" if reason else "completed",
        reason=reason,
        fields=fields(part, *map(list, zip(*sensed.states, strict=True))),
    )


@cache
def _warm_up_motion() -> None:
    """Compile or load the steps of shells on one element."""
    from fea.shell_motion import ShellMotion

    mesh = MeshQuad2().with_boundaries({"root": lambda x: x[0] < 0.1})
    ShellMotion(Shell(mesh, 0.1, Material())).run(1e-4, 2)


def _steps(experiment: RingDown, model: FeaModel) -> tuple[float, int]:
    """Interval between samples, s, and the number of steps that fill it."""
    interval = 1.0 / experiment.rate
    # A hair of tolerance, so that 0.7 ms times 4 may fill an interval of 2.8 ms.
    return interval, ceil(interval / model.time_step - 1e-9)


def _swing(
    part: Deformable, hung: Array, specimen: Specimen, experiment: RingDown, model: FeaModel, sensed: _Sensed
) -> dict[str, Any]:
    """Motion from rest at ``hung`` (nodes, 3), m; returns what the integrator did."""
    swinging = Dynamics(part, {"tip": specimen.tip_mass}, None, model.linear_solver, _DYNAMIC_TOLERANCE)
    interval, substeps = _steps(experiment, model)
    start = hung.reshape(-1)[swinging.free]
    begin = swinging.start(start, np.zeros_like(start))
    for motion in swinging.samples(begin, interval, experiment.samples, substeps):
        moved = swinging.nodal(motion.u)
        sensed.read(experiment, moved, swinging.kinetic_energy(motion), swinging.strain_energy(motion))
    return swinging.summary()


def _swing_shell(
    part: Deformable, hung: Array, specimen: Specimen, experiment: RingDown, model: FeaModel, sensed: _Sensed
) -> dict[str, Any]:
    """The same by compiled steps."""
    from fea.shell_motion import ShellMotion

    assert isinstance(part, Shell)
    swinging = ShellMotion(part, {"tip": specimen.tip_mass}, tolerance=_DYNAMIC_TOLERANCE)
    interval, substeps = _steps(experiment, model)
    path = swinging.run(interval, experiment.samples, substeps, u=hung)
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
