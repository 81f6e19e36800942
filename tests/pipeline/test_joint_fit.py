"""A fit that follows motions and rows of a measured stiffness table at once."""

import json
from pathlib import Path

import pytest

from pipeline import plan as plans
from pipeline.plan import Plan
from pipeline.stages.compare import compare
from pipeline.stages.fit import fit
from pipeline.stages.perform import perform
from pipeline.study import StudyError, check_study
from results.tables import from_json

STUDY = {
    "study": "joint",
    "specimens": {"beam": {"kind": "TwistedBeam", "mass": "5.17 g", "material": {"youngs_modulus": "60 MPa"}}},
    "experiments": {
        "release": {"kind": "RingDown", "duration": "0.05 s"},
        "stiffness": {"kind": "StaticStiffness", "increments": 1},
    },
    "performers": {
        "truth": {"kind": "prb", "topology": "gauss-chain", "parameters": {"E": "60 MPa"}},
        "chain": {"kind": "prb", "topology": "gauss-chain", "fit": "both"},
    },
    "campaigns": {
        "release": {
            "specimen": "beam", "experiment": "release", "performers": ["truth", "chain"],
            "sweep": {"experiment.direction": ["0 deg", "90 deg"]},
        },
        "table": {
            "specimen": "beam", "experiment": "stiffness", "performers": ["chain"],
            "sweep": {"specimen.twist": ["0 deg", "-90 deg"]},
        },
    },
    "lab": {"table-5-1": {"file": "published:table_5_1", "reading": {"twist_sense": -1}}},
    "fits": {
        "both": {
            "kind": "fit", "model": "chain", "free": {"E": ["20 MPa", "200 MPa"]}, "objective": "relative",
            "data": [
                {"campaign": "release", "reference": "truth", "used": ["direction=0deg"]},
                {"campaign": "table", "reference": "table-5-1", "used": ["90 deg"], "held_out": ["0 deg"]},
            ],
            "search": {"method": "least-squares", "starts": 5, "polished": 1}, "advice": False,
        }
    },
    "comparisons": [{"campaign": "table", "reference": "table-5-1"}],
}  # fmt: skip


@pytest.fixture
def plan(tmp_path, monkeypatch):
    monkeypatch.setattr(plans, "RUNS", tmp_path / "runs")
    made = Plan(check_study(STUDY, tmp_path))
    for job in made.jobs["prb"].values():
        if ".truth." in job.id:
            perform(made, job.id, Path(job.output))
    return made


def test_the_fit_lies_between_what_the_motion_and_the_table_say(plan):
    assert "completed" in fit(plan, "both", Path(plan.fit_output("both")))
    result = json.loads(Path(plan.fit_output("both")).read_text(encoding="utf-8"))
    names = {t["name"]: t["use"] for t in result["targets"]}
    assert names == {
        "release.truth.direction=0deg": "in sample",
        "table.table-5-1.90 deg": "in sample",
        "table.table-5-1.0 deg": "held out",
    }
    assert set(result["targets"][1]["entries"]) == {"k_yy", "k_yz", "k_zy", "k_zz", "n_xx"}
    # The motion wants the truth's 60 MPa, the published row another modulus: neither alone decides.
    (modulus,) = result["parameters"]
    assert modulus["value"] != pytest.approx(60e6, rel=0.01)
    assert 30e6 < modulus["value"] < 120e6
    for job in plan.jobs["prb"].values():
        perform(plan, job.id, Path(job.output))
    compare(plan)
    tables = {t.title: t for t in from_json((plan.folder / "tables.json").read_text(encoding="utf-8"))}
    (cells,) = [t for title, t in tables.items() if title.startswith("table against table-5-1")]
    marked = {row[0].split(":")[0] for row in cells.rows if row[-1].endswith("*")}
    assert marked == {"phi 90 deg"}


def test_a_row_without_a_sample_behind_it_is_named(tmp_path):
    wrong = json.loads(json.dumps(STUDY))
    wrong["fits"]["both"]["data"][1]["used"] = ["45 deg"]
    with pytest.raises(StudyError, match=r"fits\.both\.data\.1\.used: no sample '45 deg'; there is 0 deg, 90 deg"):
        _ = Plan(check_study(wrong, tmp_path)).jobs


def test_a_fit_without_held_out_records_says_so(tmp_path, monkeypatch):
    monkeypatch.setattr(plans, "RUNS", tmp_path / "runs")
    alone = json.loads(json.dumps(STUDY))
    alone["fits"]["both"]["data"] = alone["fits"]["both"]["data"][:1]
    made = Plan(check_study(alone, tmp_path))
    for job in made.jobs["prb"].values():
        if ".truth." in job.id:
            perform(made, job.id, Path(job.output))
    fit(made, "both", Path(made.fit_output("both")))
    result = json.loads(Path(made.fit_output("both")).read_text(encoding="utf-8"))
    assert result["parameters"][0]["value"] == pytest.approx(60e6, rel=1e-3)
    assert any("Nothing is held out" in note for note in result["notes"])
