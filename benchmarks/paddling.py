"""Speed of the paddling device: one second in water, and how thrust follows frequency and load fin.

The peer in the same run is MuJoCo with the plate law as a Python callback, stepped at 0.1 ms, at which its peaks agree
with the compiled motion to a few thousandths.
"""

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from benchmarks._measure import best_of, processor_time, row
from lab.experiments import PaddleThrust
from lab.requests import Request
from lab.specimens import FinnedTube
from lab.specimens.finned_tube import LoadFin
from prb.batch import Batch
from prb.model import PrbModel
from prb.paddler import Paddler, Stroke, paddle, paddler_of, stroke_of
from prb.paddler_mujoco import paddle_in_mujoco

MODEL = PrbModel(topology="paddler")
LOADED = FinnedTube(load_fin=LoadFin())
SECOND = Stroke(PaddleThrust().pressure, 1.0, 1)
STEPS = (0.5e-3, 0.2e-3, 0.1e-3)
#: "One second of paddling in under 20 ms".
GOAL = 20e-3
FREQUENCIES = np.geomspace(0.25, 4.0, 17)
REACHES = np.linspace(0.0, 0.08, 9)


def device(specimen: FinnedTube = LOADED) -> Paddler:
    return paddler_of(specimen, MODEL.values(specimen))


def one_second() -> list[dict[str, Any]]:
    paddler = device()
    peer = best_of(lambda: paddle_in_mujoco(paddler, SECOND, time_step=0.1e-3), 1)
    found = []
    for step in STEPS:
        work = partial(paddle, paddler, SECOND, step)
        work()
        wall, processor = best_of(work), processor_time(work)
        name = f"one second of paddling at {1e3 * step:g} ms"
        found.append(row(name, wall, "s", f"value <= {GOAL:g}", "MuJoCo, callback, 0.1 ms", peer, peer / wall))
        found.append(row(f"{name}, processor", processor, "s", f"value <= {GOAL:g}"))
    return found


def agreement() -> list[dict[str, Any]]:
    paddler = device()
    ours = paddle(paddler, SECOND, 0.1e-3)
    found = []
    for step in (0.2e-3, 0.1e-3):
        theirs = paddle_in_mujoco(paddler, SECOND, time_step=step)
        window = round(10e-3 / step)
        peaks = [np.convolve(f, np.ones(window) / window, "valid") for f in
                 (theirs.thrust, np.interp(theirs["time"], ours["time"], ours.thrust))]  # fmt: skip
        for name, pick in (("peak", np.max), ("least", np.min)):
            apart = float(pick(peaks[0]) / pick(peaks[1]) - 1.0)
            found.append(row(f"MuJoCo at {1e3 * step:g} ms, {name} thrust off by", 100 * apart, "%", "-2 to 2"))
    return found


def convergence() -> list[dict[str, Any]]:
    paddler = device()
    exact = paddle(paddler, SECOND, 0.02e-3).sensed
    return [
        row(
            f"peak thrust at {1e3 * step:g} ms off by",
            100 * float(paddle(paddler, SECOND, step).sensed.max() / exact.max() - 1),
            "%",
        )
        for step in STEPS
    ]


def sweep() -> list[dict[str, Any]]:
    """Frequency and load fin, three cycles of each device."""
    requests = []
    for reach in REACHES:
        load = LoadFin(length=float(reach), mass=0.00205 * reach / 0.0309) if reach > 0 else None
        for frequency in FREQUENCIES:
            e = PaddleThrust(frequency=float(frequency), cycles=3, warm_up=2)
            specimen = FinnedTube(load_fin=load)
            requests.append(Request(specimen, e, MODEL.values(specimen)))
    wall = best_of(partial(Batch(MODEL.topology, threads=2), requests), 1)
    seconds = sum(r.experiment.cycles / r.experiment.frequency for r in requests)
    return [row(f"{len(requests)} devices, {seconds:.0f} s of paddling, 2 threads", wall, "s")]


def swims() -> list[dict[str, Any]]:
    e = PaddleThrust(body="free", cycles=12, warm_up=8)
    motion = paddle(device(), replace(stroke_of(e), cycles=e.cycles))
    return [row("swimming speed of the nominal device", 1e3 * float(np.ptp(motion["body"])) / e.cycles, "mm/s")]


def rows() -> list[dict[str, Any]]:
    return [*one_second(), *agreement(), *convergence(), *sweep(), *swims()]
