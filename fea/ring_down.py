"""``RingDown`` by finite elements."""

from dataclasses import dataclass, field
from math import ceil
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray
from skfem import MeshHex2

from fea.body import Body
from fea.dead_load import DeadLoad
from fea.dynamics import Dynamics, Motion, StoppedError
from fea.model import FeaModel
from fea.newton import Branch, DivergedError, History, Options, follow
from fea.pictures import fields
from fea.rigid_face import mean_rigid_motion
from fea.setting_up import how, make_body, said, warm_up
from lab.experiments import RingDown
from lab.records import Channel, Record, channels
from lab.specimens import Specimen

Array = NDArray[np.float64]

#: Deformed states kept for pictures, spread over the first ``_SHOWN_UNTIL`` seconds.
_SHOWN, _SHOWN_UNTIL = 12, 0.060
#: Dynamics: residual relative to the largest reaction so far; 1e-5 of it moved the markers by 2 um of 18 mm.
_DYNAMIC_TOLERANCE = 1e-5


class Carrier:
    """Light carrier of the markers, riding on the mean rigid motion of the tip face."""

    def __init__(self, body: Body, places: Array) -> None:
        self.places = places
        self.nodes = body.boundary("tip")
        self.shares = body.shares("tip")[self.nodes]
        points = body.points[self.nodes]
        self.arms = points - self.shares @ points / self.shares.sum()

    def read(self, displacement: Array) -> tuple[Array, Array]:
        """Displacements of the markers (marker, 3) and of the tip's centre (3,), m."""
        shift, turn = mean_rigid_motion(self.arms, self.shares, displacement[self.nodes])
        return shift + self.places @ (turn - np.eye(3)).T, shift


@dataclass
class _Sensed:
    """Samples of the record as they come in."""

    markers: list[Array] = field(default_factory=list)
    tip: list[Array] = field(default_factory=list)
    kinetic: list[float] = field(default_factory=list)
    strain: list[float] = field(default_factory=list)
    states: list[tuple[float, Array]] = field(default_factory=list)


def perform(specimen: Specimen, experiment: RingDown, model: FeaModel, mesh: MeshHex2) -> Record:
    """Hang the load, cut it, and follow the free motion; see ``fea.perform``."""
    warm_up(model.linear_solver)
    began = perf_counter()
    body = make_body(specimen, model, mesh)
    share = body.shares("tip")
    hanging = DeadLoad(body, np.outer(share / share.sum(), experiment.load), model.linear_solver)
    swinging = Dynamics(body, {"tip": specimen.tip_mass}, None, model.linear_solver, _DYNAMIC_TOLERANCE)
    static, sensed, reason = History(), _Sensed(), ""
    try:
        hung = follow(hanging, Branch.start(hanging.rest, 0.1), 1.0, Options(tolerance=model.tolerance), static)
        _swing(swinging, swinging.start(hung, np.zeros_like(hung)), experiment, model, sensed)
    except DivergedError as error:
        sensed.states.append((0.0, hanging.displacement(error.state)))
        reason = f"the hanging load was reached to {100 * error.reached:.3g} % only: {error}"
    except StoppedError as error:
        reason = f"the motion stopped at {error.time:.6g} s of {experiment.duration:g} s: {error}"
    seconds = perf_counter() - began
    history: dict[str, Any] = {"static": static.summary(), "dynamic": swinging.summary()}
    return Record(
        **said(specimen, experiment, model),
        channels=_channels(experiment, model, sensed, history),
        how=how(body, model, swinging.solver, seconds, history),
        status="diverged" if reason else "completed",
        reason=reason,
        fields=fields(body, *map(list, zip(*sensed.states, strict=True))),
    )


def _swing(swinging: Dynamics, begin: Motion, experiment: RingDown, model: FeaModel, sensed: _Sensed) -> None:
    carrier = Carrier(swinging.body, np.array(experiment.markers))
    interval = 1.0 / experiment.rate
    shown = np.linspace(0, min(_SHOWN_UNTIL, experiment.duration) * experiment.rate, _SHOWN).round()
    # A hair of tolerance, so that 0.7 ms times 4 may fill an interval of 2.8 ms.
    substeps = ceil(interval / model.time_step - 1e-9)
    for number, motion in enumerate(swinging.samples(begin, interval, experiment.samples, substeps)):
        displacement = swinging.nodal(motion.u)
        markers, tip = carrier.read(displacement)
        sensed.markers.append(markers)
        sensed.tip.append(tip)
        sensed.kinetic.append(swinging.kinetic_energy(motion))
        sensed.strain.append(swinging.strain_energy(motion))
        if number in shown:
            sensed.states.append((number * interval, displacement))


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
