"""Fits from specification to result: scores, notes, nuisances, joint data."""

import json
from dataclasses import replace

import numpy as np
import pytest

from calibrate.fitting import fit_performer
from calibrate.spec import DataSpec, Fit, Search
from lab.experiments import RingDown, StaticStiffness
from lab.measures import TRACKING_ERROR_DEFINITION, tracking_error, tracking_rms

NOISE = 1e-4
DATA = DataSpec(campaign="c", reference="lab", used=["a"])
LOCAL = Search(method="least-squares", starts=12)


def spec(free, data=DATA, **changes) -> Fit:
    bounds = free if isinstance(free, dict) else dict.fromkeys(free)
    return Fit(model="m", free=bounds, data=[data], **{"search": LOCAL, "advice": False, **changes})


def test_scores_are_those_of_the_fitted_model(bench):
    ring, unseen = RingDown(duration=0.2), RingDown(duration=0.1, direction=1.0)
    used = [bench.target("y", ring, noise=NOISE, seed=1)]
    held = [bench.target("d", unseen, noise=NOISE, seed=2)]
    result = fit_performer(spec(("k", "c", "m")), bench.performer, used, held)
    assert [(t.name, t.use) for t in result.targets] == [("y", "in sample"), ("d", "held out")]
    for scored, made in zip(result.targets, [*used, *held], strict=True):
        model = bench.record(made.experiment, **result.values())["markers"]
        assert scored.error == pytest.approx(tracking_error(model, made.record["markers"]))
        assert scored.rms == pytest.approx(tracking_rms(model, made.record["markers"]))
    assert result.tracking_error == pytest.approx(result.targets[0].error)
    assert result.objective == pytest.approx(result.targets[0].rms)
    assert TRACKING_ERROR_DEFINITION in result.notes


def test_the_result_is_plain_data(bench):
    used = [bench.target("y", RingDown(duration=0.2), noise=NOISE, seed=1)]
    result = fit_performer(spec(("k", "c", "kt"), profile=True, bootstrap=10, advice=True), bench.performer, used)
    data = json.loads(json.dumps(result.to_json(), allow_nan=False))
    assert [p["name"] for p in data["parameters"]] == ["k", "c", "kt"]
    assert data["parameters"][2]["standard_error"] is None
    assert np.array(data["correlation"]).shape == (3, 3)
    assert (data["objective_unit"], data["seed"], data["used"], data["kind"]) == ("m", 1, ["y"], "fit")
    assert data["history"] == sorted(data["history"], reverse=True)
    assert [p["name"] for p in data["profiles"]] == ["k", "c", "kt"]
    assert data["bootstrap"]["count"] == 10
    assert data["advice"][0]["sentence"]
    assert data["targets"][0]["use"] == "in sample"


def test_nuisances_come_back_and_stay_with_their_record(bench):
    data = DATA.model_copy(update={"nuisances": {"release_time": None, "offset": None}})
    used = [
        bench.target("y", RingDown(duration=0.25), data, noise=NOISE, seed=1, late=0.0041, offset=0.001),
        bench.target("z", RingDown(duration=0.25, direction=1.5), data, noise=NOISE, seed=2, late=-0.002),
    ]
    held = [bench.target("d", RingDown(duration=0.25, direction=0.8), data, noise=NOISE, seed=3, late=0.0033)]
    result = fit_performer(spec(("k", "c", "m"), data), bench.performer, used, held)
    assert result.values() == pytest.approx({n: bench.truth[n] for n in ("k", "c", "m")}, rel=0.01)
    late = [t.nuisances["release_time"] for t in result.targets]
    assert late == pytest.approx([0.0041, -0.002, 0.0033], abs=5e-5)
    assert np.array(result.targets[0].nuisances["offset"]) == pytest.approx(np.full((3, 3), 1e-3), abs=5e-5)
    assert [n.name for n in result.nuisances] == ["y: release_time", "z: release_time"]
    assert result.targets[2].note == "release_time, offset of this record fitted to it, nothing else."
    # Offsets are no displacement: the error is that of the noise alone.
    assert [t.rms for t in result.targets] == pytest.approx([np.sqrt(3) * NOISE] * 3, rel=0.1)


def test_a_shared_rig_compliance_is_found_from_static_tests(bench):
    data = DataSpec(
        campaign="c", reference="lab", used=["a"], nuisances={"experiment.rig_stiffness": None},
        shared=["experiment.rig_stiffness"], quantities=["k_yy", "k_zz", "n_xx"],
    )  # fmt: skip
    rig, guess = StaticStiffness(rig_stiffness=2000.0), StaticStiffness(rig_stiffness=1500.0)
    made = [
        replace(bench.target("soft", guess, data), record=bench.record(rig)),
        replace(bench.target("ring", RingDown(duration=0.2), noise=NOISE, seed=1)),
    ]
    # A second device on the same rig keeps the rig that was found: nothing is left to fit for it.
    stiffer = replace(bench.target("stiffer", guess, data), record=bench.record(rig, k=300.0))
    result = fit_performer(spec(("k", "c", "m", "kt"), data, objective="relative"), bench.performer, made, [stiffer])
    (found,) = result.nuisances
    assert found.name == "c/lab: experiment.rig_stiffness"
    assert found.value == pytest.approx(2000.0, rel=0.05)
    assert result.values()["k"] == pytest.approx(150.0, rel=0.01)
    assert result.objective_unit == "1"
    assert set(result.targets[0].entries) == {"k_yy", "k_zz", "n_xx"}
    held = result.targets[2]
    assert held.nuisances == {"experiment.rig_stiffness": found.value}
    assert held.note == ""
    assert held.error > 0.1


def test_a_failing_held_out_record_is_a_hole_and_not_the_end(bench):
    class Refusing(type(bench.performer)):
        def _one(self, request):
            return super()._one(request) if request.experiment.in_motion else None

    used = [bench.target("y", RingDown(duration=0.2), noise=NOISE, seed=1)]
    held = [bench.target("k", StaticStiffness())]
    result = fit_performer(spec(("k", "c")), Refusing(), used, held)
    assert np.isnan(result.targets[1].error)
    assert result.targets[1].note == "the model could not perform it"
    json.dumps(result.to_json(), allow_nan=False)
