"""Speed of the pseudo-rigid-body performer.

Evaluations are ring-downs of 0.25 s, static start included, as a fit runs them.  The peer in the
same run is the plain way: compile each candidate and step it from Python.  The dissertation needed 1.2 s for
10 s of motion (5.4.2, on another machine).
"""

from functools import partial
from typing import Any

import mujoco
import numpy as np

from benchmarks._measure import best_of, row
from lab.experiments import RingDown
from lab.specimens import TwistedBeam
from prb.batch import RingDownBatch
from prb.model import PrbModel
from prb.mujoco_model import compile_mechanism, write_mechanism
from prb.release import release, steps_per_sample
from prb.statics import Chain, hang
from prb.topologies import TOPOLOGIES

BEAM = TwistedBeam(mass=0.00517)
EXPERIMENTS = [RingDown(direction=0.0), RingDown(direction=np.pi / 2)]
PUBLISHED_SECONDS = 1.2
STEPS = (1e-3, 0.5e-3, 0.25e-3, 0.1e-3)


def candidates(topology: str, count: int) -> np.ndarray:
    nominal = np.array([p.nominal for p in TOPOLOGIES[topology].declare(BEAM)])
    return nominal * np.random.default_rng(0).uniform(0.8, 1.25, (count, len(nominal)))


def plain_way(topology: str, values: np.ndarray, time_step: float) -> None:
    for candidate in values:
        named = dict(zip(TOPOLOGIES[topology].names, candidate.tolist(), strict=True))
        for experiment in EXPERIMENTS:
            stride = steps_per_sample(experiment.rate, time_step)
            mechanism = TOPOLOGIES[topology].build(BEAM, named).in_motion
            model = compile_mechanism(mechanism, experiment.markers, 1 / (experiment.rate * stride))
            data = mujoco.MjData(model)
            data.qpos[:] = hang(Chain(model), np.array(experiment.load))
            for _ in range((experiment.samples - 1) * stride):
                mujoco.mj_step(model, data)


def evaluations(topology: str, time_step: float = 0.5e-3) -> list[dict[str, Any]]:
    values = candidates(topology, 45)
    runs, few = len(values) * len(EXPERIMENTS), values[:10]
    peer = len(few) * len(EXPERIMENTS) / best_of(lambda: plain_way(topology, few, time_step), 2)
    result = []
    for threads in (1, 2):
        batch = RingDownBatch(BEAM, EXPERIMENTS, topology, time_step=time_step, threads=threads)
        batch(values)
        rate = runs / best_of(partial(batch, values))
        name = f"{topology}, evaluations at {1e3 * time_step:g} ms, {threads} thread(s)"
        result.append(row(name, rate, "1/s", "", "compiled and stepped from Python", peer, rate / peer))
    return result


def ten_seconds(topology: str) -> list[dict[str, Any]]:
    """Forty releases of 0.25 s: a beam at rest would end in denormal numbers, which are slow."""
    experiment, releases = EXPERIMENTS[0], 40
    mechanism = PrbModel(topology=topology).mechanism(BEAM).in_motion
    result = []
    for time_step in STEPS:
        stride = steps_per_sample(experiment.rate, time_step)
        model = compile_mechanism(mechanism, experiment.markers, 1 / (experiment.rate * stride))
        starts = np.tile(hang(Chain(model), np.array(experiment.load)), (releases, 1))
        run = partial(release, [model] * releases, [mujoco.MjData(model)], starts, experiment.samples, stride)
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
    return [line for name in TOPOLOGIES for line in (building(name), *evaluations(name), *ten_seconds(name))]
