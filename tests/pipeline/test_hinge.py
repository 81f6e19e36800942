"""A hinge fitted in a study to records of a known one, and all that follows from it; no finite elements."""

import copy
import csv
import json
import math
import os
from pathlib import Path

import mujoco
import numpy as np
import pytest
import yaml

from lab.specimens import PinchedTube
from pipeline import plan as plans
from pipeline.cli import main
from pipeline.plan import Plan, load_plan
from pipeline.stages.fit import fit
from pipeline.study import StudyError, check_study
from prb.hinge_curves import COLUMNS, TOUCH, HingeCurves, HingeTable
from results.store import read_record

TUBE = PinchedTube()
#: Ends of the known hinge's columns, open and closed; what is not named is nought.
ENDS = {
    "travel": (0.0, 0.04), "force": (0.0, 12.0), "gap": (0.04, 0.0), "flat_along": (0.0, 0.8), "strain": (0.0, 0.1),
    "bend_mean": (60.0, 3.0), "bend_along": (0.0, 2.0), "torsion": (40.0, 2.0), "lever": (0.05, 0.05),
    "give_across": (1e-5, 1e-4), "give_along": (1e-5, 1e-4),
}  # fmt: skip


def known():
    shares = np.linspace(0.0, 1.0, 21)
    columns = {name: np.interp(shares, [0.0, 1.0], ENDS.get(name, (0.0, 0.0))) for name in COLUMNS}
    columns["contact"] = np.interp(shares, [0.0, TOUCH, 1.0], [0.0, 0.0, 1.3])  # a tenth of the force ends a pinch
    plain = {name: tuple(column.tolist()) for name, column in columns.items()}
    tables = tuple(HingeTable(pinch_angle=angle, touches=True, columns=plain) for angle in (0.0, np.pi / 3))
    return HingeCurves(pairs=3, shares=tuple(shares.tolist()), tables=tables, specimen=TUBE.model_dump(mode="json"))


STUDY = yaml.safe_load("""
study: hinged
specimens:
  tube: {kind: PinchedTube}
experiments:
  pinch: {kind: Pinch}
  bend: {kind: PinchedBending, load: 0.1 N}
  recover: {kind: ShapeRecovery}
performers:
  truth: {kind: prb, topology: tube-shear}
  hinge: {kind: prb, topology: tube-shear, fit: hinge}
campaigns:
  axis:
    specimen: tube
    experiment: pinch
    performers: [truth, hinge]
    sweep: {experiment.pinch_angle: [0 deg, 15 deg, 60 deg, 120 deg]}
  bend: {specimen: tube, experiment: bend, performers: [truth, hinge]}
  recover: {specimen: tube, experiment: recover, performers: [truth]}
fits:
  hinge:
    kind: hinge
    model: hinge
    data:
      - {campaign: axis, reference: truth, used: [pinch_angle=0deg, pinch_angle=60deg], held_out: [pinch_angle=15deg]}
      - {campaign: bend, reference: truth, held_out: [single]}
      - {campaign: recover, reference: truth, held_out: [single]}
comparisons:
  - {campaign: axis, reference: truth}
  - {campaign: bend, reference: truth}
""")


def edited(**fit):
    data = copy.deepcopy(STUDY)
    data["fits"]["hinge"] |= fit
    return data


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """The study carried out as far as its fit's performer."""
    folder = tmp_path_factory.mktemp("hinged")
    data = copy.deepcopy(STUDY)
    data["performers"]["truth"]["hinge"] = known().model_dump(mode="json")
    path = folder / "hinged.yaml"
    path.write_text(yaml.safe_dump(data, sort_keys=False), encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(plans, "RUNS", folder / "runs")
        for batch in ("axis.truth", "bend.truth", "recover.truth"):
            for name in [name for name in load_plan(path).batches if name.partition("+")[0] == batch]:
                assert main(["prb", str(path), name]) == 0
        assert main(["fit", str(path), "hinge"]) == 0
        for batch in ("axis.hinge", "bend.hinge"):
            assert main(["prb", str(path), batch]) == 0
        yield path


def record_of(plan, id):
    return read_record(Path(plan.jobs["prb"][id].output))


def test_the_fit_finds_the_hinge_behind_its_records(study):
    plan = load_plan(study)
    result = json.loads(Path(plan.fit_output("hinge")).read_text(encoding="utf-8"))
    assert (result["status"], result["kind"]) == ("completed", "hinge")
    found = HingeCurves.model_validate(result["hinge"])
    for angle in (0.0, 60.0):
        ours, theirs = (c.state(math.radians(angle), 1.0).parameters for c in (found, known()))
        assert ours["k_soft"] == pytest.approx(theirs["k_soft"], rel=0.01)
        assert ours["axis"] == pytest.approx(theirs["axis"], abs=1e-3)


def test_a_held_out_record_without_a_result_is_named_and_left_out(study):
    result = json.loads(Path(load_plan(study).fit_output("hinge")).read_text(encoding="utf-8"))
    assert "recover.truth.single unsupported: not scored" in result["notes"]
    assert {score["use"] for score in result["scores"]} == {"in sample", "held out"}


def test_the_fitted_model_performs_between_and_beyond_the_fitted_angles(study):
    plan = load_plan(study)
    for slug in ("pinch_angle=15deg", "pinch_angle=120deg"):
        ours, truth = (record_of(plan, f"axis.{performer}.{slug}") for performer in ("hinge", "truth"))
        assert ours.completed, ours.reason
        assert ours["force"].max() == pytest.approx(truth["force"].max(), rel=0.02)
    assert "warnings" not in record_of(plan, "bend.hinge.single").how


def test_tables_ledger_and_report_take_what_came_out(study):
    for stage in ("collect", "compare", "ledger"):
        assert main([stage, str(study)]) == 0
    folder = load_plan(study).folder
    rows = list(csv.DictReader((folder / "accuracy.csv").open(encoding="utf-8")))
    uses = {row["sample"]: row["use"] for row in rows if row["campaign"] == "axis" and row["model"] == "hinge"}
    assert uses["pinch_angle=0deg"] == "in sample"
    assert uses["pinch_angle=120deg"] == "held out"
    report = (folder / "accuracy.md").read_text(encoding="utf-8")
    assert "fit hinge: the hinge" in report
    assert "axis.truth.pinch_angle=15deg | held out" in report


def test_any_state_is_written_as_mjcf(study, tmp_path, capsys):
    file = tmp_path / "closed.xml"
    assert main(["model", str(study), "hinge", "--pinch", "75 deg", "-o", str(file)]) == 0
    said = capsys.readouterr().out
    assert "tube, pinched at 75 deg by 1 of its travel" in said
    model = mujoco.MjModel.from_xml_path(os.fspath(file))
    soft = model.joint("soft").stiffness[0]
    main(["model", str(study), "hinge", "--pinch", "75 deg", "--share", "0", "-o", str(file)])
    assert soft < 0.1 * mujoco.MjModel.from_xml_path(os.fspath(file)).joint("soft").stiffness[0]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--pinch", "400 deg"], "--pinch 400 deg must lie between 0 and 360 deg"),
        (["--pinch", "3 mm"], "--pinch: '3 mm' has the unit"),
        (["--share", "1.5"], "--share 1.5 must lie between 0, open, and 1, closed"),
        (["--set", "pairs=2"], "pairs is 2, but was 3 in the fit"),
    ],
)
def test_wrong_states_are_refused_in_one_line(study, words, said, tmp_path, capsys):
    code = main(["model", str(study), "hinge", *words, "-o", str(tmp_path / "x.xml")])
    shown = capsys.readouterr()
    assert said in (shown.err or shown.out)
    assert code == (0 if words[0] == "--set" else 2)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"model": "fea"}, "fits.hinge.model: 'fea' is FEA; a hinge is fitted for a PRB model"),
        (
            {"data": [{"campaign": "axis", "reference": "table", "used": ["0 deg"]}]},
            "fits.hinge.data.0.reference: no",
        ),
        ({"data": [{"campaign": "axis", "reference": "truth"}]}, "fits.hinge: data: no record is used"),
    ],
)
def test_wrong_fits_are_refused_in_one_line(changes, words):
    data = edited(**changes)
    data["performers"]["fea"] = {"kind": "fea", "element": "shell"}
    data["lab"] = {"table": {"file": "published:table_5_1"}}
    with pytest.raises(StudyError) as caught:
        check_study(data, Path(), "hinged.yaml")
    assert len(str(caught.value).splitlines()) == 1
    assert str(caught.value).startswith(f"hinged.yaml: {words}")


def test_a_fit_does_without_some_of_its_records_but_not_without_all(study, tmp_path):
    data = yaml.safe_load(study.read_text(encoding="utf-8"))
    items = data["fits"]["hinge"]["data"]
    items[2] = {"campaign": "recover", "reference": "truth", "used": ["single"]}
    file = tmp_path / "hinge.json"
    assert fit(Plan(check_study(data, Path())), "hinge", file) == "fit hinge: completed"
    notes = json.loads(file.read_text(encoding="utf-8"))["notes"]
    assert "recover.truth.single unsupported: left out of the fit" in notes
    data["fits"]["hinge"]["data"] = items[2:]
    said = fit(Plan(check_study(data, Path())), "hinge", file)
    assert "failed no reference: recover.truth.single unsupported" in said
