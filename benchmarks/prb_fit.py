"""Speed of the published three-parameter fit (k, b, l2 to ring-downs), to its optimum.

The reference is a chain of eight anisotropic hinges with noise, so that the fit has to live with an error of the
model.  The peer in the same run is SciPy's differential evolution as most scripts call it: one candidate after the
other, each run of the model by itself.
"""

from typing import Any

import numpy as np
from scipy.optimize import differential_evolution

from benchmarks._measure import best_of, row
from calibrate.fitting import fit
from calibrate.spec import DataSpec, Fit, Search
from calibrate.targets import Target, target
from lab.experiments import RingDown
from lab.measures import tracking_rms
from lab.records import Channel, Record, channels
from lab.specimens import TwistedBeam
from prb import perform
from prb.model import PrbModel

BEAM = TwistedBeam(mass=0.00517)
MODEL = PrbModel.model_validate({"topology": "five-hinge"})
BOUNDS = ((0.02, 5.0), (1e-4, 0.05), (1e-3, 0.049))
PEER_EVALUATIONS = 60


def targets() -> list[Target]:
    truth = PrbModel.model_validate({"topology": "hinge-chain-anisotropic", "settings": {"segments": 8}})
    random, found = np.random.default_rng(0), []
    for direction in (0.0, np.pi / 2):
        experiment = RingDown(direction=direction)
        record = perform(BEAM, experiment, truth)
        markers = record["markers"] + random.normal(0.0, 1e-4, record["markers"].shape)
        noisy = Channel("markers", "m", markers, ("time", "marker", "axis"))
        data = DataSpec(campaign="release", reference="chain", used=["all"])
        measured = Record(
            "virtual-lab", "chain", BEAM.model_dump(), experiment.model_dump(),
            channels(record.channels["time"], noisy),
        )  # fmt: skip
        found.append(target(f"{np.degrees(direction):.0f} deg", BEAM, experiment, measured, data))
    return found


def one_by_one(used: list[Target]) -> None:
    """As many candidates as the peer may try, through ``perform``."""

    def objective(values: np.ndarray) -> float:
        parameters = dict(zip(("k", "b", "l2"), values, strict=True))
        model = PrbModel.model_validate({"topology": "five-hinge", "parameters": parameters})
        runs = [perform(BEAM, t.experiment, model) for t in used]
        pairs = zip(runs, used, strict=True)
        return float(sum(tracking_rms(r["markers"], t.record["markers"]) if r.completed else 1.0 for r, t in pairs))

    differential_evolution(objective, BOUNDS, maxiter=PEER_EVALUATIONS // 15 - 1, popsize=5, polish=False, rng=1)


def rows() -> list[dict[str, Any]]:
    used = targets()
    one_by_one(used[:1])
    peer = best_of(lambda: one_by_one(used), 1) / PEER_EVALUATIONS
    result = []
    for method in ("differential-evolution", "least-squares"):
        search = Search.model_validate({"method": method})
        spec = Fit(
            model="m", free={"k": None, "b": None, "l2": None}, search=search, advice=False,
            data=[DataSpec(campaign="release", reference="chain", used=["all"])],
        )  # fmt: skip
        for count in (1, 2):
            found = fit(spec, MODEL, used[:count], threads=2)
            wall = best_of(lambda spec=spec, count=count: fit(spec, MODEL, used[:count], threads=2), 2)
            scripts = peer * found.evaluations / 2
            name = f"{method}, {count} ring-down(s) of 0.25 s, {found.evaluations} runs, 2 threads"
            result.append(row(name, wall, "s", "", "the same runs one by one", scripts, scripts / wall))
    return result
