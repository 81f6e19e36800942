"""A user's own recordings: from CSV files through the lab performer and a fit to the accuracy table."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from lab.experiments import RingDown
from lab.specimens import TwistedBeam
from pipeline import plan as plans
from pipeline.plan import Plan
from pipeline.stages.compare import compare
from pipeline.stages.fit import fit
from pipeline.stages.perform import perform
from pipeline.study import StudyError, check_study
from prb import perform as perform_prb
from prb.model import PrbModel
from results.store import read_record

TRUE = {"k": 0.3, "b": 0.002}
STUDY = {
    "study": "own",
    "specimens": {"beam": {"kind": "TwistedBeam", "twist": "90 deg", "mass": "5.17 g"}},
    "experiments": {"release": {"kind": "RingDown", "duration": "0.1 s"}},
    "performers": {
        "bench": {
            "kind": "lab",
            "reader": {"kind": "markers", "columns": "{marker}_{axis}_mm", "unit": "mm", "rate": "360 Hz"},
            "files": {"direction=0deg": "$TAKES/y.csv", "direction=90deg": "$TAKES/z.csv"},
            "markers": ["A", "B", "C"],
            "steps": [
                {"do": "release", "at": "0.0472222 s"},  # one sample before the truth
                {"do": "rest", "last": "0.2 s"},
                {"do": "crop", "start": "0 s", "end": "0.1 s"},
            ],
        },
        "model": {"kind": "prb", "topology": "five-hinge", "fit": "own-fit"},
    },
    "campaigns": {
        "release": {
            "specimen": "beam",
            "experiment": "release",
            "performers": ["bench", "model"],
            "sweep": {"experiment.direction": ["0 deg", "90 deg"]},
        }
    },
    "fits": {
        "own-fit": {
            "kind": "fit",
            "model": "model",
            "free": {"k": None, "b": None},
            "data": [
                {"campaign": "release", "reference": "bench", "used": ["direction=0deg"],
                 "held_out": ["direction=90deg"], "nuisances": {"release_time": ["-10 ms", "10 ms"]}},
            ],
            "search": {"method": "least-squares", "starts": 8},
        }
    },
    "comparisons": [{"campaign": "release", "reference": "bench"}],
}  # fmt: skip
#: Samples before the release.
BEFORE = 18


@pytest.fixture
def plan(tmp_path, monkeypatch):
    """The study with two files as a camera would write them, made by a model with known parameters."""
    monkeypatch.setattr(plans, "RUNS", tmp_path / "runs")
    monkeypatch.setenv("TAKES", str(tmp_path))
    rng = np.random.default_rng(3)
    model = PrbModel.model_validate({"topology": "five-hinge", "parameters": TRUE})
    for name, direction in (("y", 0.0), ("z", np.pi / 2)):
        experiment = RingDown(direction=direction, duration=1.0)
        path = perform_prb(TwistedBeam(mass=5.17e-3), experiment, model)["markers"]
        held = np.repeat(path[:1], BEFORE, axis=0)
        places = np.concatenate([held, path]) + np.array(experiment.markers) + rng.normal(0, 2e-5, (1, 1, 3))
        noisy = places + rng.normal(0.0, 5e-5, places.shape)
        with open(tmp_path / f"{name}.csv", "w", newline="", encoding="utf-8") as handle:
            writer = csv.writer(handle)
            writer.writerow([f"{marker}_{axis}_mm" for marker in "ABC" for axis in "xyz"])
            writer.writerows((noisy * 1e3).reshape(len(noisy), -1).round(6).tolist())
    return Plan(check_study(STUDY, tmp_path))


def test_recordings_are_fitted_and_compared(plan):
    for job in plan.jobs["lab"]:
        assert "completed" in perform(plan, job, Path(plan.jobs["lab"][job].output))
    assert "completed" in fit(plan, "own-fit", Path(plan.fit_output("own-fit")))
    result = json.loads(Path(plan.fit_output("own-fit")).read_text(encoding="utf-8"))
    found = {p["name"]: p["value"] for p in result["parameters"]}
    assert found["k"] == pytest.approx(TRUE["k"], rel=0.01)
    assert found["b"] == pytest.approx(TRUE["b"], rel=0.02)
    late = {t["name"]: t["nuisances"]["release_time"] for t in result["targets"]}
    assert late == pytest.approx(dict.fromkeys(late, 1 / 360), abs=2e-4)
    uses = {t["name"]: t["use"] for t in result["targets"]}
    assert uses == {"release.bench.direction=0deg": "in sample", "release.bench.direction=90deg": "held out"}
    for job in plan.jobs["prb"].values():
        perform(plan, job.id, Path(job.output))
    compare(plan)
    with open(plan.folder / "accuracy.csv", encoding="utf-8", newline="") as handle:
        rows = [row for row in csv.DictReader(handle) if row["quantity"] == "tracking_error"]
    mine = {row["sample"]: row for row in rows if row["campaign"] == "release"}
    assert {row["reference_origin"] for row in mine.values()} == {"lab"}
    assert mine["direction=0deg"]["use"] == "in sample"
    assert mine["direction=90deg"]["use"] == "held out"
    # Made on the recordings' clocks: a sample off would cost some 20 %.
    assert all(float(row["value"]) < 0.03 for row in mine.values())
    model = read_record(Path(plan.output(plan.samples["release.model.direction=90deg"])))
    assert model.how["sensors"]["release_time"] == late["release.bench.direction=90deg"]
    assert len(model["time"]) == len(model["markers"]) == RingDown(duration=0.1).samples


def test_a_changed_file_runs_its_sample_again(plan):
    (job,) = (j for j in plan.jobs["lab"].values() if j.id.endswith("direction=90deg"))
    assert [Path(path).name for path in job.inputs] == ["z.csv"]


def test_a_missing_file_stops_before_anything_runs(tmp_path, monkeypatch):
    monkeypatch.setenv("TAKES", str(tmp_path / "elsewhere"))
    with pytest.raises(StudyError, match=r"performers\.bench\.files\.direction=0deg: no file .*elsewhere/y\.csv"):
        check_study(STUDY, tmp_path)


def test_a_sample_without_a_file_is_named(plan, tmp_path):
    fewer = json.loads(json.dumps(STUDY))
    del fewer["performers"]["bench"]["files"]["direction=90deg"]
    fewer["fits"]["own-fit"]["data"][0]["held_out"] = []
    with pytest.raises(StudyError, match=r"performers\.bench\.files: none for the sample 'direction=90deg'"):
        _ = Plan(check_study(fewer, tmp_path)).jobs
