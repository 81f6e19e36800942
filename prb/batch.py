"""Many runs at once: the inner loop of every fit."""

import copy
from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from lab.experiments import PaddleThrust, RingDown, StaticStiffness
from lab.requests import Request, Response
from prb.experiments.base_shake import unsteady
from prb.experiments.natural_modes import LOOSE, tip_of
from prb.experiments.ring_down import load_of
from prb.experiments.static_stiffness import held_tip
from prb.fin_curves import FinCurves
from prb.mechanism import Mechanism, Vector
from prb.model import TIME_STEP
from prb.mujoco_model import compile_mechanism, write_mechanism
from prb.release import extrapolated, refusal, steps_per_sample, unstable
from prb.shaking import orbits, rest_of, step_of
from prb.statics import Chain, NotConverged, hang, is_sprung
from prb.topologies import Topology
from prb.vibration import vibrations
from prb.water import Water

Array = NDArray[np.float64]
#: Runs simulated together; bounds the memory, and the models that are kept.
_CHUNK = 64


@dataclass(frozen=True)
class _Run:
    """A request with its place in the answer and the mechanism that stands for the specimen."""

    place: int
    request: Request
    mechanism: Mechanism

    @property
    def experiment(self) -> Any:
        return self.request.experiment


class Batch:
    """Runs of one topology, for any specimens, experiments and candidate values.

    Mechanisms of equal structure share compiled models, which are kept between calls and rewritten for each
    candidate.

    Parameters
    ----------
    topology
        Kind of mechanism.
    time_step
        Longest step of the simulator, s.
    threads
        Threads that share the runs; they do not change the result.
    fin
        Learned curves of a paddling device.
    water
        Law of the water that it paddles in.

    Attributes
    ----------
    failures
        Why requests of the last call have no response, by their place.
    """

    def __init__(
        self,
        topology: Topology,
        *,
        time_step: float = TIME_STEP,
        threads: int = 1,
        fin: FinCurves | None = None,
        water: Water = "plate",
    ) -> None:
        self.topology, self.time_step, self.threads = topology, time_step, threads
        self.fin, self.water = fin, water
        self.failures: dict[int, str] = {}
        self._pools: dict[Hashable, _Pool] = {}

    def __call__(self, requests: Sequence[Request]) -> list[Response]:
        """Responses in the order of the requests.

        Returns
        -------
        responses
            ``RingDown`` and ``BaseShake``: ``time`` (samples,), ``markers`` (samples, markers, 3).
            ``StaticStiffness``: ``leg`` (n,), ``motion`` and ``wrench`` (n, 6).  ``NaturalModes``: ``frequency``
            (modes,), ``tip`` (modes, 6).  ``PaddleThrust``: its channels.  None where the run failed: see ``failures``.
        """
        self.failures = {}
        responses: list[Response] = [None] * len(requests)
        paddling = [place for place, request in enumerate(requests) if isinstance(request.experiment, PaddleThrust)]
        for place, (response, reason) in zip(paddling, self._paddles([requests[i] for i in paddling]), strict=True):
            responses[place] = response
            if reason:
                self.failures[place] = reason
        groups: dict[Hashable, list[_Run]] = {}
        perform = {
            "RingDown": self._ring_downs, "BaseShake": self._shakes,
            "StaticStiffness": self._statics, "NaturalModes": self._modes,
        }  # fmt: skip
        for run in self._runs(requests):
            if run.experiment.kind in perform:
                groups.setdefault(_alike(run), []).append(run)
            else:
                self.failures[run.place] = (
                    f"a {run.experiment.kind} has no searched parameters; use a fit of kind hinge"
                )
        for runs in groups.values():
            for begin in range(0, len(runs), _CHUNK):
                for place, response in perform[runs[0].experiment.kind](runs[begin : begin + _CHUNK]):
                    responses[place] = response
        return responses

    def _paddles(self, requests: Sequence[Request]) -> list[tuple[Response, str]]:
        if not requests:
            return []
        from prb.paddler_batch import paddle_all  # compiled code, which only these need

        return paddle_all(requests, self.topology, self.fin, self.water, self.time_step, self.threads)

    def _runs(self, requests: Sequence[Request]) -> Iterator[_Run]:
        """Every request with its mechanism, which is built once for all experiments of a candidate."""
        built: dict[Hashable, Mechanism] = {}
        for place, request in enumerate(requests):
            if isinstance(request.experiment, PaddleThrust):
                continue
            moves = not isinstance(request.experiment, StaticStiffness)
            key = (id(request.specimen), moves, *request.values.items())
            if key not in built:
                try:
                    mechanism = self.topology.build(request.specimen, request.values)
                except ValueError as error:
                    self.failures[place] = str(error)
                    continue
                built[key] = mechanism.in_motion if moves else mechanism
            yield _Run(place, request, built[key])

    def _pool(self, run: _Run) -> "_Pool":
        markers: Sequence[Vector] = run.experiment.markers if run.experiment.in_motion else ()
        key = (run.mechanism.structure, len(markers))
        if key not in self._pools:
            model = compile_mechanism(run.mechanism, markers)
            self._pools[key] = _Pool([model], [mujoco.MjData(model) for _ in range(self.threads)])
        return self._pools[key]

    def _statics(self, runs: Sequence[_Run]) -> Iterator[tuple[int, Response]]:
        pool = self._pool(runs[0])
        for run in runs:
            channels, reason = held_tip(Chain(pool.model(0, run.mechanism, ()), pool.data[0]), run.experiment)
            if reason:
                self.failures[run.place] = reason
            else:
                yield run.place, channels

    def _modes(self, runs: Sequence[_Run]) -> Iterator[tuple[int, Response]]:
        pool = self._pool(runs[0])
        for run in runs:
            chain = Chain(pool.model(0, run.mechanism, ()), pool.data[0])
            if is_sprung(chain):
                modes = vibrations(run.mechanism, chain, run.experiment.count)
                yield run.place, {"frequency": modes.frequencies, "tip": tip_of(chain, modes, run.request.specimen)}
            else:
                self.failures[run.place] = LOOSE

    def _ring_downs(self, runs: Sequence[_Run]) -> Iterator[tuple[int, Response]]:
        pool, first = self._pool(runs[0]), runs[0].experiment
        stride = steps_per_sample(first.rate, self.time_step)
        step, time = 1.0 / (first.rate * stride), np.arange(first.samples) / first.rate
        ready: list[tuple[_Run, mujoco.MjModel, Array, Array]] = []
        written: dict[Hashable, mujoco.MjModel] = {}
        for run in runs:
            # Experiments of one candidate share a model as far as they can.
            key = (id(run.mechanism), run.experiment.markers, run.experiment.own_weight, run.experiment.gravity)
            try:
                if key not in written:
                    gravity = run.experiment.own_gravity
                    written[key] = pool.moving(len(written), run.mechanism, run.experiment.markers, step, gravity)
                chain, load = Chain(written[key], pool.data[0]), load_of(run.experiment)
                rest = chain.sites(hang(chain, load.own_weight))
                ready.append((run, written[key], hang(chain, load), rest))
            except NotConverged as failure:
                self.failures[run.place] = str(failure)
        if not ready:
            return
        models, starts = [model for _, model, *_ in ready], np.array([start for *_, start, _ in ready])
        motion = extrapolated(models, pool.data, starts, first.samples, stride)
        for (run, _, _, rest), places, completed in zip(ready, motion.positions, motion.completed, strict=True):
            if completed:
                yield run.place, {"time": time, "markers": places[:, 1:] - rest[1:]}
            else:
                self.failures[run.place] = unstable(step)

    def _shakes(self, runs: Sequence[_Run]) -> Iterator[tuple[int, Response]]:
        pool = self._pool(runs[0])
        ready: list[tuple[_Run, mujoco.MjModel, Array]] = []
        for run in runs:
            e = run.experiment
            step = step_of(e, self.time_step)
            try:
                model = pool.moving(len(ready), run.mechanism, e.markers, step, e.own_gravity)
                ready.append((run, model, rest_of(Chain(model, pool.data[0]), e)))
            except NotConverged as failure:
                self.failures[run.place] = str(failure)
        models, experiments = [model for _, model, _ in ready], [run.experiment for run, *_ in ready]
        found = orbits(models, pool.data, experiments, [rest for *_, rest in ready])
        for (run, model, _), orbit in zip(ready, found, strict=True):
            e = run.experiment
            if orbit is None:
                self.failures[run.place] = unstable(model.opt.timestep)
            elif outcome := unsteady(orbit):
                self.failures[run.place] = outcome["reason"]
            else:
                yield run.place, {"time": e.times, "markers": orbit.path[:, 1:]}


@dataclass
class _Pool:
    """Models of one structure, rewritten for each candidate, and scratch for each thread."""

    models: list[mujoco.MjModel]
    data: list[mujoco.MjData]

    def model(self, number: int, mechanism: Mechanism, markers: Sequence[Vector]) -> mujoco.MjModel:
        """The model ``number`` of the pool as that of ``mechanism``."""
        while len(self.models) <= number:
            self.models.append(copy.copy(self.models[0]))
        write_mechanism(self.models[number], self.data[0], mechanism, markers)
        return self.models[number]

    def moving(
        self, number: int, mechanism: Mechanism, markers: Sequence[Vector], step: float, gravity: Vector | None
    ) -> mujoco.MjModel:
        """``model`` with a step (s) and gravity (m/s^2); NotConverged when it cannot move freely."""
        model = self.model(number, mechanism, markers)
        model.opt.timestep, model.opt.gravity[:] = step, gravity or (0.0, 0.0, 0.0)
        if reason := refusal(model, self.data[0]):
            raise NotConverged(reason)
        return model


def _alike(run: _Run) -> Hashable:
    """What runs share that are simulated together."""
    e = run.experiment
    sampling = (e.samples, e.rate) if isinstance(e, RingDown) else ()
    return e.kind, run.mechanism.structure, len(e.markers) if e.in_motion else 0, sampling
