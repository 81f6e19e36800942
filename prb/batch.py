"""Ring-downs of many candidates at once: the inner loop of every fit."""

import copy
from collections.abc import Sequence

import mujoco
import numpy as np
from numpy.typing import NDArray

from lab.experiments import RingDown
from lab.specimens import Specimen
from prb.mujoco_model import compile_mechanism, write_mechanism
from prb.release import refusal, release, steps_per_sample
from prb.statics import Chain, NotConverged, hang
from prb.topologies import TOPOLOGIES

Array = NDArray[np.float64]
#: Candidates simulated together; bounds the memory, and the models that are kept.
_CHUNK = 64


class RingDownBatch:
    """Ring-downs of one specimen in several directions or under several loads, for many candidates.

    Models are compiled once and rewritten for each candidate; keep the object between calls.

    Parameters
    ----------
    specimen, topology
        What is modelled, and the name of the kind of mechanism.
    experiments
        Ring-downs with the same rate, duration and markers.
    time_step
        Longest step, s.
    threads
        Threads that share the runs.
    """

    def __init__(
        self,
        specimen: Specimen,
        experiments: Sequence[RingDown],
        topology: str,
        *,
        time_step: float = 0.25e-3,
        threads: int = 1,
    ) -> None:
        first = experiments[0]
        if any((e.samples, e.rate, e.markers) != (first.samples, first.rate, first.markers) for e in experiments):
            raise ValueError("ring-downs of one batch must share rate, duration and markers")
        self.specimen, self.experiments = specimen, tuple(experiments)
        self.topology = TOPOLOGIES[topology]
        self.samples, self.markers = first.samples, first.markers
        self.stride = steps_per_sample(first.rate, time_step)
        nominal = {p.name: p.nominal for p in self.topology.declare(specimen)}
        mechanism = self.topology.build(specimen, nominal).in_motion
        model = compile_mechanism(mechanism, self.markers, 1.0 / (first.rate * self.stride))
        if reason := refusal(model):
            raise ValueError(f"{topology}: {reason}")
        self._models = [model]
        self._data = [mujoco.MjData(model) for _ in range(threads)]
        self._rest = mechanism.nodes[-1] + np.array(self.markers)

    def __call__(self, values: Array) -> Array:
        """Marker displacements from rest.

        Parameters
        ----------
        values
            Candidates in the order of the topology's parameters, (p, parameters), SI units.

        Returns
        -------
        markers
            (p, experiments, samples, markers, 3), m; NaN where a run failed.
        """
        values = np.atleast_2d(values)
        shape = (len(self.experiments), self.samples, len(self.markers), 3)
        result = np.full((len(values), *shape), np.nan)
        for begin in range(0, len(values), _CHUNK):
            chunk = values[begin : begin + _CHUNK]
            self._run(chunk, result[begin : begin + len(chunk)])
        return result

    def _run(self, values: Array, result: Array) -> None:
        while len(self._models) < len(values):
            self._models.append(copy.copy(self._models[0]))
        models, starts, places = [], [], []
        for i, candidate in enumerate(values):
            named = dict(zip(self.topology.names, map(float, candidate), strict=True))
            mechanism = self.topology.build(self.specimen, named).in_motion
            write_mechanism(self._models[i], self._data[0], mechanism, self.markers)
            chain = Chain(self._models[i], self._data[0])
            for j, experiment in enumerate(self.experiments):
                try:
                    starts.append(hang(chain, np.array(experiment.load)))
                except NotConverged:
                    continue
                models.append(self._models[i])
                places.append((i, j))
        if not models:
            return
        motion = release(models, self._data, np.array(starts), self.samples, self.stride)
        for place, positions, completed in zip(places, motion.positions, motion.completed, strict=True):
            if completed:
                result[place] = positions[:, 1:] - self._rest
