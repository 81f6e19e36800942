"""Pinched tubes in studies: what is refused before anything is meshed, and that the chain takes them."""

import copy
import re
from pathlib import Path

import pytest
import yaml

from lab.specimens import PinchedTube
from pipeline.cli import main
from pipeline.plan import Plan
from pipeline.stages.fit_readings import readings
from pipeline.stages.perform import perform
from pipeline.stages.report import assumptions
from pipeline.study import StudyError, check_study
from results.store import read_record

CONFIG = Path(__file__).resolve().parents[2] / "config"
STUDY = yaml.safe_load("""
study: tubes
specimens:
  printed: {kind: PinchedTube, size: printed-tpu}
  two: {kind: PinchedTube, size: printed-tpu, pairs: 2}
  beam: {kind: TwistedBeam, twist: 90 deg}
experiments:
  pinch: {kind: Pinch}
  equal: {kind: Pinch, pair_forces: [1, 1, 1]}
  push: {kind: PinchedBending, push: 4 mm}
  recover: {kind: ShapeRecovery}
  stiffness: {kind: StaticStiffness}
performers:
  fea: {kind: fea, element: shell}
campaigns:
  axis: {specimen: printed, experiment: pinch, performers: [fea], sweep: {experiment.pinch_angle: [0 deg, 60 deg]}}
  equal: {specimen: printed, experiment: equal, performers: [fea]}
  push: {specimen: printed, experiment: push, performers: [fea], sweep: {specimen.wall: [1 mm, 1.2 mm]}}
  table: {specimen: beam, experiment: stiffness, performers: [fea]}
lab:
  table-5-1: {file: "published:table_5_1"}
""")


def edited(**sections):
    data = copy.deepcopy(STUDY)
    for section, entries in sections.items():
        if isinstance(entries, list):
            data[section] = entries
        else:
            data.setdefault(section, {}).update(entries)
    return data


def plan_of(data):
    return Plan(check_study(data, CONFIG, "tubes.yaml"))


def refused(data):
    with pytest.raises(StudyError) as caught:
        _ = plan_of(data).jobs
    lines = str(caught.value).splitlines()
    assert len(lines) == 1, lines
    return lines[0]


@pytest.fixture(scope="module")
def plan():
    return plan_of(STUDY)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"pad_width": "40 mm"}, "specimens.tube: pads overlap: 6 pads of 40 mm"),
        ({"wall": "8 mm"}, "specimens.tube: wall 8 mm is too thick for radius 25 mm: at most a fifth"),
        ({"size": "printed"}, "specimens.tube: size 'printed' is unknown; there are fea-tube, printed-tpu, pet"),
        ({"wall": "-1 mm"}, "specimens.tube.wall: must be greater than 0"),
        ({"pair": 2}, "specimens.tube.pair: unknown key"),
    ],
)
def test_wrong_tubes_are_one_line_each(changes, words):
    tube = {"kind": "PinchedTube", "size": "printed-tpu", **changes}
    assert refused(edited(specimens={"tube": tube})).startswith(f"tubes.yaml: {words}")


def test_a_pinch_angle_outside_its_range_is_refused():
    wrong = edited(campaigns={"axis": {**STUDY["campaigns"]["axis"], "sweep": {"experiment.pinch_angle": ["400 deg"]}}})
    assert refused(wrong).startswith("campaigns.axis.sweep.experiment.pinch_angle: pinch_angle: Input should be")
    line = refused(edited(experiments={"pinch": {"kind": "Pinch", "pinch_angle": "-5 deg"}}))
    assert "experiments.pinch.pinch_angle: must be greater than or equal to 0" in line


@pytest.mark.parametrize(
    ("specimen", "experiment", "words"),
    [
        ("two", "equal", "pair_forces: 3 numbers for 2 pairs of pads"),
        ("printed", "stiffness", "StaticStiffness is no experiment for a PinchedTube; there is Pinch, PinchedBending,"),
        ("beam", "push", "PinchedBending is no experiment for a TwistedBeam; there is StaticStiffness,"),
    ],
)
def test_parts_that_do_not_fit_together_are_refused(specimen, experiment, words):
    campaign = {"specimen": specimen, "experiment": experiment, "performers": ["fea"]}
    assert words in refused(edited(campaigns={"wrong": campaign}))


def test_what_is_of_beams_alone_is_refused():
    line = refused(edited(comparisons=[{"campaign": "axis", "reference": "table-5-1"}]))
    assert "'table-5-1' is a table of twisted beams, and 'axis' tests a PinchedTube" in line
    thick = {"kind": "fea", "element": "shell", "thickness": "2 mm"}
    assert "thickness belongs to twisted beams" in refused(edited(performers={"fea": thick}))


def test_a_mesh_too_coarse_for_the_pads_is_refused():
    coarse = {"kind": "fea", "element": "shell", "tube_mesh": {"across": 3}}
    line = refused(edited(performers={"fea": coarse}))
    assert line.startswith("campaigns.axis: pinch_angle=0deg: across 3 is too coarse to follow pads")


def test_a_model_of_beams_stands_for_no_tube():
    campaign = {"specimen": "printed", "experiment": "pinch", "performers": ["five"]}
    wrong = edited(performers={"five": {"kind": "prb", "topology": "five-hinge"}}, campaigns={"wrong": campaign})
    assert refused(wrong) == (
        "campaigns.wrong: single: topology five-hinge is declared for a TwistedBeam, not for a PinchedTube"
    )


def test_the_pages_study_is_correct():
    page = (CONFIG.parent / "docs" / "tube.md").read_text(encoding="utf-8")
    study, more = (yaml.safe_load(text) for text in re.findall(r"```yaml\n(.*?)```", page, re.DOTALL))
    study["performers"] |= more["performers"]
    jobs = plan_of({**study, "fits": more["fits"]}).jobs
    assert len(jobs["fea"]) == 8
    assert "axis.fea.pinch_angle=30deg" in jobs["fea"]


def test_tubes_stand_behind_no_row_of_a_beams_table(plan):
    assert plan.rows_of_table("table-5-1", "axis", "fea") == {}


def test_readings_of_a_table_need_beams(plan):
    spec = {"kind": "readings", "model": "fea", "campaign": "axis", "reference": "table-5-1"}
    with pytest.raises(ValueError, match="static tests of twisted beams by FEA, not Pinch of a PinchedTube by fea"):
        readings(plan_of(edited(fits={"readings": spec})), "readings", {}, 1)


def test_pinches_of_one_tube_share_its_mesh(plan):
    meshes = {s.id: plan.mesh_job(s).id for s in plan.samples.values()}
    assert meshes["axis.fea.pinch_angle=0deg"] == meshes["axis.fea.pinch_angle=60deg"] == meshes["equal.fea.single"]
    assert meshes["push.fea.wall=1mm"] == meshes["equal.fea.single"]
    assert meshes["push.fea.wall=1.2mm"] != meshes["equal.fea.single"]


def test_the_written_plan_tells_beams_from_tubes(plan):
    again = Plan.from_json(plan.to_json())
    assert again.samples == plan.samples
    assert again.jobs == plan.jobs
    assert {type(s.specimen).__name__ for s in again.samples.values()} == {"PinchedTube", "TwistedBeam"}


def test_the_report_says_what_is_assumed_of_a_tube(plan):
    said = {text.partition(":")[0]: text for text in assumptions(plan)}
    assert "6mm around and along, 2mm high" in said["printed"]
    assert "0.1 times F_p" in said["pinch"]
    assert "0mm beyond its face, and how far, 4mm" in said["push"]
    assert "The dynamics use" in said["beam"]


def test_a_failing_tube_is_a_hole(plan, tmp_path, monkeypatch):
    import fea
    import meshes

    def lost(*_):
        raise FloatingPointError("made to fail")

    monkeypatch.setattr(meshes, "read_mesh", lambda path: None, raising=False)
    monkeypatch.setattr(fea, "perform", lost)
    perform(plan, "equal.fea.single", tmp_path / "x.vtkhdf")
    record = read_record(tmp_path / "x.vtkhdf")
    assert (record.status, record.reason) == ("failed", "FloatingPointError: made to fail")
    assert record.specimen["kind"] == "PinchedTube"


@pytest.fixture
def study(tmp_path):
    path = tmp_path / "tubes.yaml"
    path.write_text(yaml.safe_dump(STUDY, sort_keys=False), encoding="utf-8")
    return path


def test_cad_takes_a_specimen_with_changes(study, tmp_path, monkeypatch, capsys):
    import meshes

    drawn = []

    def write_cad(specimen, path, part):
        drawn.append((specimen, path, part))
        return {"volume": 2e-5}

    monkeypatch.setattr(meshes, "write_cad", write_cad, raising=False)
    file = tmp_path / "own" / "tube.step"
    assert main(["cad", str(study), "printed", "--set", "wall=1.2 mm", "--set", "pairs=2", "-o", str(file)]) == 0
    assert drawn == [(PinchedTube(wall=0.0012, pairs=2), file, "whole")]
    assert capsys.readouterr().out == f"{file}: printed, wall 1.2mm, pairs 2; 20 cm^3\n"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ((), "the study has several specimens; name one of printed, two, beam"),
        (("prnted",), "no specimen 'prnted'; there is printed, two, beam"),
        (("printed", "--set", "wall=9 mm"), "wall 9 mm is too thick"),
    ],
)
def test_cad_refuses_in_one_line(study, words, said, capsys):
    assert main(["cad", str(study), *words, "-o", "nowhere.step"]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1
    assert said in lines[0]
