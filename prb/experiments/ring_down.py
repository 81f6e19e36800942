"""Free decay after a weight at the tip is cut."""

from dataclasses import dataclass
from time import perf_counter

import mujoco
import numpy as np
from numpy.typing import NDArray

from lab.experiments import RingDown
from lab.records import Channel, Record, channels
from lab.specimens import Specimen
from prb.experiments.common import heading, how, links_as_lines
from prb.model import PrbModel
from prb.mujoco_model import compile_mechanism
from prb.release import Motion, extrapolated, refusal, steps_per_sample, unstable
from prb.statics import Chain, Load, NotConverged, hang

Array = NDArray[np.float64]
#: States kept for pictures, and the time they cover, s.
_STATES, _PICTURED = 12, 0.060


@dataclass(frozen=True)
class _Bench:
    """A compiled mechanism with the sampling of its experiment."""

    experiment: RingDown
    model: mujoco.MjModel
    stride: int

    def run(self, start: Array) -> Motion:
        data = [mujoco.MjData(self.model)]
        return extrapolated([self.model], data, start[None], self.experiment.samples, self.stride)


def load_of(experiment: RingDown) -> Load:
    """What hangs on the mechanism before the release."""
    gravity = None if experiment.own_gravity is None else np.array(experiment.own_gravity)
    return Load(np.array(experiment.load), np.array(experiment.load_place), gravity)


def ring_down(specimen: Specimen, experiment: RingDown, model: PrbModel) -> Record:
    """Static start under the load, released at t = 0, markers sampled at the experiment's rate.

    Returns
    -------
    record
        Channels ``time`` (samples,), ``markers`` (samples, markers, 3) and ``tip`` (samples, 3):
        displacements from rest, m.  Fields: the links as lines over the first 60 ms.
    """
    stride = steps_per_sample(experiment.rate, model.time_step)
    step = 1.0 / (experiment.rate * stride)
    compiled = compile_mechanism(model.mechanism(specimen).in_motion, experiment.markers, step)
    compiled.opt.gravity[:] = experiment.own_gravity or (0.0, 0.0, 0.0)
    bench, head = _Bench(experiment, compiled, stride), heading(specimen, experiment, model)
    begin = perf_counter()
    if reason := refusal(compiled):
        facts = how(specimen, model, perf_counter() - begin, time_step=step)
        return Record(**head, how=facts, status="unsupported", reason=reason)
    try:
        chain, load = Chain(compiled), load_of(experiment)
        rest, start = hang(chain, load.own_weight), hang(chain, load)
    except NotConverged as failure:
        facts = how(specimen, model, perf_counter() - begin, time_step=step)
        return Record(**head, how=facts, status="diverged", reason=str(failure))
    motion = bench.run(start)
    wall_time = perf_counter() - begin
    if not motion.completed[0]:
        facts = how(specimen, model, wall_time, time_step=step)
        return Record(**head, how=facts, status="diverged", reason=unstable(step))
    facts = how(specimen, model, wall_time, time_step=step, seconds_per_10_s=_seconds_per_10_s(bench, start))
    time = np.arange(experiment.samples) / experiment.rate
    pictured = int(np.searchsorted(time, _PICTURED, side="right"))
    return Record(
        **head,
        channels=_channels(time, motion.positions[0] - chain.sites(rest)),
        how=facts,
        fields=links_as_lines(chain, time[:pictured], motion.joints[0, :pictured], rest, _STATES),
    )


def _seconds_per_10_s(bench: _Bench, start: Array) -> float:
    """Wall time for 10 s of motion, scaled from a repeat without the static start."""
    begin = perf_counter()
    bench.run(start)
    return (perf_counter() - begin) * 10.0 * bench.experiment.rate / (bench.experiment.samples - 1)


def _channels(time: Array, displacements: Array) -> dict[str, Channel]:
    return channels(
        Channel("time", "s", time, ("time",), "time since the release"),
        Channel("markers", "m", displacements[:, 1:], ("time", "marker", "axis"), "marker displacement from rest"),
        Channel("tip", "m", displacements[:, 0], ("time", "axis"), "displacement of the tip's centre"),
    )
