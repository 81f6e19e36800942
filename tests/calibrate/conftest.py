"""A performer with a closed form: a tip on springs, which swings along y and z and turns about x."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import pytest

from calibrate.space import Coordinate
from calibrate.spec import DataSpec
from calibrate.targets import Target, target
from lab.experiments import Experiment, RingDown
from lab.records import Channel, Record, channels
from lab.requests import Request, Response
from lab.specimens import Specimen, TwistedBeam

BEAM = TwistedBeam()
#: Stiffness along z over that along y, and the moment of inertia about x, kg*m^2.
STIFFER, INERTIA = 3.0, 2e-7


@dataclass
class Oscillator:
    """Stiffness k and damping c along y, stiffness kt and damping ct about x, mass m beside the specimen's tip mass.

    ``held``: the tip is let go from 5 mm, whatever the stiffness, instead of hanging under the weight.
    """

    held: bool = False
    name: str = "oscillator"
    difference: float = 1e-4
    cheap: bool = True
    asked: list[int] = field(default_factory=list)
    broken_above: float = np.inf

    def declared(self, specimen: Specimen) -> Mapping[str, Coordinate]:
        return {
            c.name: c
            for c in (
                Coordinate("k", "N/m", "N/m", 200.0, 20.0, 2000.0),
                Coordinate("c", "N*s/m", "N*s/m", 0.1, 0.01, 1.0),
                Coordinate("m", "kg", "g", 0.004, 0.001, 0.02),
                Coordinate("kt", "N*m/rad", "N*m/rad", 0.02, 0.002, 0.2),
                Coordinate("ct", "N*m*s/rad", "N*m*s/rad", 5e-6, 1e-6, 1e-4),
            )
        }

    def request(self, specimen: Specimen, experiment: Experiment, values: Mapping[str, float]) -> Request:
        own = {name: c.nominal for name, c in self.declared(specimen).items()}
        return Request(specimen, experiment, {**own, **values})

    def run(self, requests: Sequence[Request]) -> list[Response]:
        self.asked.append(len(requests))
        return [self._one(request) for request in requests]

    def rough(self) -> "Oscillator":
        return self

    def _one(self, request: Request) -> Response:
        values, experiment = request.values, request.experiment
        if values["k"] > self.broken_above:
            return None
        stiffness = np.array([values["k"], STIFFER * values["k"], values["kt"]])
        if not isinstance(experiment, RingDown):
            return _static(experiment, stiffness)
        time = np.arange(experiment.samples) / experiment.rate
        mass = values["m"] + request.specimen.tip_mass
        masses, dampings = np.array([mass, mass, INERTIA]), np.array([values["c"], values["c"], values["ct"]])
        _, fy, fz = experiment.load
        _, ay, az = experiment.load_place
        start = np.array([fy, fz, ay * fz - az * fy]) / stiffness
        if self.held:
            start = 0.005 * np.array([fy, fz, 0.0]) / np.hypot(fy, fz)
        y, z, turn = decay(time, start, masses, dampings, stiffness).T
        places = np.array(experiment.markers)
        markers = np.zeros((len(time), len(places), 3))
        markers[:, :, 1] = y[:, None] - turn[:, None] * places[:, 2]
        markers[:, :, 2] = z[:, None] + turn[:, None] * places[:, 1]
        return {"time": time, "markers": markers}


def decay(time, start, mass, damping, stiffness):
    """Free decay of single masses, (samples, masses)."""
    rate = damping / (2 * mass)
    turning = np.emath.sqrt(stiffness / mass - rate**2)
    shape = np.cos(turning * time[:, None]) + rate / turning * np.sin(turning * time[:, None])
    return start * np.real(np.exp(-rate * time[:, None]) * shape)


def _static(experiment, stiffness):
    legs, motions = [], []
    for leg, (dof, end) in enumerate(experiment.legs()):
        for share in np.arange(1, experiment.increments + 1) / experiment.increments:
            legs.append(leg)
            motions.append(share * end * np.eye(6)[dof])
    motion = np.array(motions)
    compliance = (
        np.zeros(3) if experiment.rig_stiffness is None else np.array([1.0, 1.0, 0.0]) / experiment.rig_stiffness
    )
    wrench = np.zeros_like(motion)
    wrench[:, 1:4] = motion[:, 1:4] / (1.0 / stiffness + compliance)
    return {"leg": np.array(legs), "motion": motion, "wrench": wrench}


@dataclass(frozen=True)
class Bench:
    """Makes records and targets with known truth."""

    performer: Oscillator
    truth: Mapping[str, float]

    def record(self, experiment, noise=0.0, seed=0, specimen=BEAM, late=0.0, gain=1.0, offset=0.0, **truth):
        """A record; ``late``: the clock shows this when the release happens, s."""
        rng = np.random.default_rng(seed)
        sensed = experiment
        if late:
            sensed = experiment.model_copy(update={"rate": 1e5})
        response = self.performer.run([self.performer.request(specimen, sensed, {**self.truth, **truth})])[0]
        if isinstance(experiment, RingDown):
            time = np.arange(experiment.samples) / experiment.rate
            markers = response["markers"]
            if late:
                places = np.clip(np.rint((time - late) * 1e5), 0, len(markers) - 1).astype(int)
                markers = markers[places]
            markers = gain * markers + offset + noise * rng.standard_normal(markers.shape)
            made = channels(
                Channel("time", "s", time, ("time",)), Channel("markers", "m", markers, ("time", "marker", "axis"))
            )
        else:
            wrench = response["wrench"] * (1.0 + noise * rng.standard_normal(response["wrench"].shape))
            made = channels(
                Channel("leg", "1", response["leg"], ("increment",)),
                Channel("motion", "m, rad", response["motion"], ("increment", "dof")),
                Channel("wrench", "N, N*m", wrench, ("increment", "dof")),
            )
        data = {"kind": experiment.kind}
        return Record("virtual-lab", "oscillator", specimen.model_dump(mode="json"), data, made)

    def target(self, name, experiment, data=None, specimen=BEAM, **changes) -> Target:
        record = self.record(experiment, specimen=specimen, **changes)
        return target(name, specimen, experiment, record, data or DataSpec(campaign="c", reference="lab", used=[name]))


@pytest.fixture(scope="session")
def bench() -> Bench:
    return Bench(Oscillator(), {"k": 150.0, "c": 0.06, "m": 0.005, "kt": 0.012, "ct": 8e-6})


@pytest.fixture(scope="session")
def held_bench(bench) -> Bench:
    return Bench(Oscillator(held=True), bench.truth)
