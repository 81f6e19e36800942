"""Speed of the pseudo-rigid-body performer.

Evaluations are ring-downs of 0.25 s, static start and extrapolation included, as a fit runs them.  The peer in the
same run is the plain way: compile each candidate and step it from Python, with the step and with half of it.  The
dissertation needed 1.2 s for 10 s of motion (5.4.2, on another machine).
"""

from collections.abc import Iterator
from functools import partial
from typing import Any

import mujoco
import numpy as np

import fea
from benchmarks._measure import best_of, row
from fea.model import FeaModel
from lab.experiments import BaseShake, RingDown
from lab.requests import Request
from lab.specimens import TwistedBeam
from lab.specimens.load_frame import LoadFrame
from meshes.block import beam_surface
from prb.batch import Batch
from prb.experiments.ring_down import load_of
from prb.model import PrbModel
from prb.mujoco_model import compile_mechanism, write_mechanism
from prb.release import extrapolated, steps_per_sample
from prb.statics import Chain, hang
from prb.topologies import TOPOLOGIES

BEAM = TwistedBeam(mass=0.00517)
EXPERIMENTS = [RingDown(direction=0.0), RingDown(direction=np.pi / 2)]
COMPARED = ("five-hinge", "gauss-chain")
SHAKEN = (*COMPARED, "gauss-strip")
PUBLISHED_SECONDS = 1.2
STEPS = (1e-3, 0.5e-3, 0.25e-3, 0.1e-3)


def candidates(topology: str, count: int) -> list[dict[str, float]]:
    nominal, random = TOPOLOGIES[topology].values(BEAM, {}), np.random.default_rng(0)
    return [{name: value * random.uniform(0.8, 1.25) for name, value in nominal.items()} for _ in range(count)]


def plain_way(topology: str, values: list[dict[str, float]], time_step: float) -> None:
    for candidate in values:
        for experiment in EXPERIMENTS:
            for step in (time_step, time_step / 2.0):
                stride = steps_per_sample(experiment.rate, step)
                mechanism = TOPOLOGIES[topology].build(BEAM, candidate).in_motion
                model = compile_mechanism(mechanism, experiment.markers, 1 / (experiment.rate * stride))
                data = mujoco.MjData(model)
                data.qpos[:] = hang(Chain(model), load_of(experiment))
                for _ in range((experiment.samples - 1) * stride):
                    mujoco.mj_step(model, data)


def evaluations(topology: str, time_step: float = 0.5e-3) -> list[dict[str, Any]]:
    values = candidates(topology, 45)
    requests = [Request(BEAM, e, candidate) for candidate in values for e in EXPERIMENTS]
    few = values[:10]
    peer = len(few) * len(EXPERIMENTS) / best_of(lambda: plain_way(topology, few, time_step), 2)
    result = []
    for threads in (1, 2):
        batch = Batch(TOPOLOGIES[topology], time_step=time_step, threads=threads)
        batch(requests)
        rate = len(requests) / best_of(partial(batch, requests))
        name = f"{topology}, evaluations at {1e3 * time_step:g} ms, {threads} thread(s)"
        result.append(row(name, rate, "1/s", "", "compiled and stepped from Python", peer, rate / peer))
    return result


def orbits() -> Iterator[dict[str, Any]]:
    """The published frequencies of 5.4.1, 1 to 45 Hz, to steady orbits; the peer is FEA, 15 times three of them."""
    # Damped as in config/twisted_beam.yaml: with little of it a heavy tip takes long to settle.
    damped = BEAM.material.model_copy(update={"viscous_time": 8.5e-3})
    framed = BEAM.model_copy(update={"load_frame": LoadFrame(), "material": damped})
    shake, gentle = BaseShake(tolerance=2e-3), BaseShake(tolerance=5e-3, rise=0.3, samples_per_period=32)
    for what, beam, experiment in (("bare", BEAM, shake), ("with a load frame", framed, gentle)):
        peer = 15.0 * sum(_by_elements(beam, experiment, frequency) for frequency in (5.0, 20.0, 40.0))
        for topology in SHAKEN:
            values = TOPOLOGIES[topology].values(beam, {})
            each = [experiment.model_copy(update={"frequency": float(f)}) for f in range(1, 46)]
            requests = [Request(beam, e, values) for e in each]
            wall = best_of(partial(Batch(TOPOLOGIES[topology], threads=2), requests), 2)
            name = f"{topology}, steady orbits at 45 frequencies, {what}, 2 threads"
            yield row(name, wall, "s", "", "shells, extrapolated from 5, 20 and 40 Hz", peer, peer / wall)


def _by_elements(beam: TwistedBeam, experiment: BaseShake, frequency: float) -> float:
    """Seconds of one shake by finite elements."""
    model = FeaModel(element="shell", time_step=0.7e-3)
    shake = experiment.model_copy(update={"frequency": frequency})
    record = fea.perform(beam, shake, model, beam_surface(beam, model.mesh_for(shake)))
    return float(record.how["wall_time_s"])


def ten_seconds(topology: str) -> list[dict[str, Any]]:
    """Forty releases of 0.25 s: a beam at rest would end in denormal numbers, which are slow."""
    experiment, releases = EXPERIMENTS[0], 40
    mechanism = PrbModel(topology=topology).mechanism(BEAM).in_motion
    result = []
    for time_step in STEPS:
        stride = steps_per_sample(experiment.rate, time_step)
        model = compile_mechanism(mechanism, experiment.markers, 1 / (experiment.rate * stride))
        starts = np.tile(hang(Chain(model), load_of(experiment)), (releases, 1))
        run = partial(extrapolated, [model] * releases, [mujoco.MjData(model)], starts, experiment.samples, stride)
        wall, name = best_of(run), f"{topology}, 10 s of motion at {1e3 * model.opt.timestep:.3f} ms, one thread"
        result.append(row(name, wall, "s", "", "published", PUBLISHED_SECONDS, PUBLISHED_SECONDS / wall))
    return result


def building(topology: str) -> dict[str, Any]:
    mechanism = PrbModel(topology=topology).mechanism(BEAM).in_motion
    model = compile_mechanism(mechanism)
    data = mujoco.MjData(model)
    compiling = best_of(lambda: compile_mechanism(mechanism), 20)
    editing = best_of(lambda: write_mechanism(model, data, mechanism, ()), 20)
    return row(f"{topology}, edit of a model", editing, "s", "", "compile anew", compiling, compiling / editing)


def rows() -> list[dict[str, Any]]:
    return [
        *(line for name in COMPARED for line in (building(name), *evaluations(name), *ten_seconds(name))),
        *orbits(),
    ]
