"""Free decay after a weight at the tip is cut."""

from dataclasses import dataclass
from time import perf_counter

import mujoco
import numpy as np
from numpy.typing import NDArray

from lab.experiments import RingDown
from lab.records import Channel, Fields, Record, channels
from lab.specimens import Specimen
from prb.experiments.common import heading, how
from prb.mechanism import Mechanism
from prb.model import PrbModel
from prb.mujoco_model import compile_mechanism
from prb.release import Motion, refusal, release, steps_per_sample
from prb.statics import Chain, NotConverged, hang

Array = NDArray[np.float64]
#: States kept for pictures, and the time they cover, s.
_STATES, _PICTURED = 12, 0.060
_VTK_LINE = 3


@dataclass(frozen=True)
class _Bench:
    """A compiled mechanism with the sampling of its experiment."""

    mechanism: Mechanism
    experiment: RingDown
    model: mujoco.MjModel
    stride: int

    def start(self) -> Array:
        return hang(Chain(self.model), np.array(self.experiment.load))

    def run(self, start: Array) -> Motion:
        data = [mujoco.MjData(self.model)]
        return release([self.model], data, start[None], self.experiment.samples, self.stride)

    def times(self) -> Array:
        return np.arange(self.experiment.samples) / self.experiment.rate


def ring_down(specimen: Specimen, experiment: RingDown, model: PrbModel) -> Record:
    """Static start under the load, released at t = 0, markers sampled at the experiment's rate.

    Returns
    -------
    record
        Channels ``time`` (samples,), ``markers`` (samples, markers, 3) and ``tip`` (samples, 3):
        displacements from rest, m.  Fields: the links as lines over the first 60 ms.
    """
    stride = steps_per_sample(experiment.rate, model.time_step)
    mechanism = model.mechanism(specimen).in_motion
    step = 1.0 / (experiment.rate * stride)
    bench = _Bench(mechanism, experiment, compile_mechanism(mechanism, experiment.markers, step), stride)
    head = heading(specimen, experiment, model)
    begin = perf_counter()
    if reason := refusal(bench.model):
        spent = perf_counter() - begin
        return Record(**head, how=how(specimen, model, spent, time_step=step), status="unsupported", reason=reason)
    try:
        start = bench.start()
    except NotConverged as failure:
        spent = perf_counter() - begin
        return Record(**head, how=how(specimen, model, spent, time_step=step), status="diverged", reason=str(failure))
    motion = bench.run(start)
    wall_time = perf_counter() - begin
    if not motion.completed[0]:
        reason = f"the motion is not stable with a step of {1e3 * step:.3g} ms; shorten time_step"
        return Record(**head, how=how(specimen, model, wall_time, time_step=step), status="diverged", reason=reason)
    facts = how(specimen, model, wall_time, time_step=step, seconds_per_10_s=_seconds_per_10_s(bench, start))
    return Record(**head, channels=_channels(bench, motion), how=facts, fields=_fields(bench, motion))


def _seconds_per_10_s(bench: _Bench, start: Array) -> float:
    """Wall time for 10 s of motion, scaled from a repeat without the static start."""
    begin = perf_counter()
    bench.run(start)
    return (perf_counter() - begin) * 10.0 / bench.times()[-1]


def _channels(bench: _Bench, motion: Motion) -> dict[str, Channel]:
    rest = bench.mechanism.nodes[-1]
    markers = motion.positions[0, :, 1:] - (rest + np.array(bench.experiment.markers))
    return channels(
        Channel("time", "s", bench.times(), ("time",), "time since the release"),
        Channel("markers", "m", markers, ("time", "marker", "axis"), "marker displacement from rest"),
        Channel("tip", "m", motion.positions[0, :, 0] - rest, ("time", "axis"), "displacement of the tip's centre"),
    )


def _fields(bench: _Bench, motion: Motion) -> Fields:
    rest, times, chain = bench.mechanism.nodes, bench.times(), Chain(bench.model)
    last = np.searchsorted(times, _PICTURED, side="right") - 1
    shown = np.unique(np.linspace(0, last, _STATES).round().astype(int))
    displacement = np.array([chain.nodes(joints) - rest for joints in motion.joints[0, shown]])
    links = np.arange(len(rest) - 1)
    channel = Channel("displacement", "m", displacement, ("state", "point", "axis"), "displacement of the links' ends")
    cells = np.column_stack([links, links + 1]).astype(np.int64)
    return Fields(rest, cells, _VTK_LINE, times[shown], {"displacement": channel})
