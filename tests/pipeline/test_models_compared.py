"""Choice of a topology, and parameters over the design, through the stages; a finer PRB is the reference."""

import json
from pathlib import Path

import pytest

from pipeline import plan as plans
from pipeline.plan import Plan
from pipeline.stages.compare import compare
from pipeline.stages.fit import fit
from pipeline.stages.model import model
from pipeline.stages.perform import perform
from pipeline.study import StudyError, check_study
from results.store import read_record
from results.tables import from_json

TWISTS = ("40 deg", "60 deg", "80 deg")
DATA = {"campaign": "release", "reference": "truth"}
SEARCH = {"method": "least-squares", "starts": 6, "polished": 1}
STUDY = {
    "study": "compared",
    "specimens": {"beam": {"kind": "TwistedBeam", "mass": "5.17 g"}},
    "experiments": {"release": {"kind": "RingDown", "duration": "0.05 s"}},
    "performers": {
        "truth": {"kind": "prb", "topology": "hinge-chain-anisotropic", "settings": {"segments": 5}},
        "one": {"kind": "prb", "topology": "hinge-chain-anisotropic", "settings": {"segments": 1}, "fit": "one"},
        "three": {"kind": "prb", "topology": "hinge-chain-anisotropic", "settings": {"segments": 3}, "fit": "three"},
        "chosen": {"kind": "prb", "topology": "five-hinge", "fit": "choice"},
        "designed": {
            "kind": "prb", "topology": "hinge-chain-anisotropic", "settings": {"segments": 3}, "fit": "over-twist",
        },
    },
    "campaigns": {
        "release": {
            "specimen": "beam", "experiment": "release", "performers": ["truth", "one", "three", "chosen", "designed"],
            "sweep": {"specimen.twist": list(TWISTS), "experiment.direction": ["0 deg", "90 deg"]},
        }
    },
    "fits": {
        "one": {
            "kind": "fit", "model": "one", "free": {"flat": None, "tau": None}, "search": SEARCH, "advice": False,
            "data": [{**DATA, "used": ["twist=60deg_direction=90deg"], "held_out": ["twist=60deg_direction=0deg"]}],
        },
        "three": {
            "kind": "fit", "model": "three", "free": {"flat": None, "tau": None}, "search": SEARCH, "advice": False,
            "data": [{**DATA, "used": ["twist=60deg_direction=90deg"], "held_out": ["twist=60deg_direction=0deg"]}],
        },
        "choice": {"kind": "selection", "fits": ["one", "three"]},
        "over-twist": {
            "kind": "parametric", "model": "designed", "free": {"flat": None, "tau": None}, "search": SEARCH,
            "data": [{**DATA, "used": [f"twist={t.replace(' ', '')}_direction=90deg" for t in TWISTS]}],
        },
    },
    "comparisons": [{"campaign": "release", "reference": "truth"}],
}  # fmt: skip


@pytest.fixture(scope="module")
def plan(tmp_path_factory):
    folder = tmp_path_factory.mktemp("compared")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(plans, "RUNS", folder / "runs")
        made = Plan(check_study(STUDY, folder))
    jobs = made.jobs["prb"]
    for job in jobs.values():
        if ".truth." in job.id:
            perform(made, job.id, Path(job.output))
    for name in STUDY["fits"]:
        assert "completed" in fit(made, name, Path(made.fit_output(name)))
    for job in jobs.values():
        if ".truth." not in job.id:
            perform(made, job.id, Path(job.output))
    return made


def result(plan, name):
    return json.loads(Path(plan.fit_output(name)).read_text(encoding="utf-8"))


def test_the_model_with_more_hinges_is_chosen_and_performs(plan):
    found = result(plan, "choice")
    assert (found["chosen"], found["chosen_model"]) == ("three", "three")
    chosen, three = (
        read_record(Path(plan.output(plan.samples[f"release.{name}.twist=60deg_direction=0deg"])))
        for name in ("chosen", "three")
    )
    assert (chosen["markers"] == three["markers"]).all()
    assert chosen.how["topology"] == "hinge-chain-anisotropic"


def test_parameters_follow_the_design_and_doubts_are_kept(plan):
    found = result(plan, "over-twist")
    assert len(found["left_out"]) == len(TWISTS)
    assert len(found["sampled"]["curves"]["flat"]) == len(found["sampled"]["places"])
    inside = read_record(Path(plan.output(plan.samples["release.designed.twist=60deg_direction=0deg"])))
    assert "warnings" not in inside.how


def test_a_model_for_a_new_design_is_written_with_its_doubts(plan, tmp_path):
    import mujoco

    said = model(plan, "designed", "", ["twist=70 deg"], tmp_path / "in.xml")
    assert "twist 70deg" in said
    assert "doubt" not in said
    assert mujoco.MjModel.from_xml_path(str(tmp_path / "in.xml")).nbody > 3
    assert "doubt: twist 110 deg is outside of the designs" in model(
        plan, "designed", "", ["twist=110 deg"], tmp_path / "out.xml"
    )


@pytest.mark.parametrize(
    ("performer", "change", "words"),
    [
        ("truht", "twist=70 deg", "no PRB performer 'truht'"),
        ("designed", "twist", "is no change; write it like"),
        ("designed", "twits=70 deg", "TwistedBeam has no parameter 'twits'"),
        ("designed", "twist=70 kg", "'twist=70 kg': '70 kg' has the unit kilogram"),
    ],
)
def test_a_wrong_request_is_one_line(plan, tmp_path, performer, change, words):
    with pytest.raises(StudyError, match=words):
        model(plan, performer, "", [change], tmp_path / "x.xml")
    assert not (tmp_path / "x.xml").exists()


def test_tables_show_ranking_spread_and_designs(plan):
    compare(plan)
    tables = {table.title: table for table in from_json((plan.folder / "tables.json").read_text(encoding="utf-8"))}
    assert [row[0] for row in tables["fit choice: ranked by held-out error"].rows] == ["three", "one"]
    assert len(tables["fit over-twist: designs left out"].rows) == len(TWISTS)
    short = {row[0]: row for row in tables["In short: release against truth (prb)"].rows}
    assert all(short["three"][2:4])


def test_a_selection_among_other_kinds_is_refused(tmp_path):
    wrong = json.loads(json.dumps(STUDY))
    wrong["fits"]["choice"]["fits"] = ["one", "over-twist"]
    with pytest.raises(StudyError, match=r"fits\.choice\.fits: 'over-twist' is of kind parametric; needed: fit"):
        check_study(wrong, tmp_path)
