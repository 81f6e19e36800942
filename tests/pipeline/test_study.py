import copy
import json
from pathlib import Path

import pytest
import yaml

from pipeline.cli import main
from pipeline.plan import Plan
from pipeline.study import Study, StudyError, check_study, load_study

CONFIG = Path(__file__).resolve().parents[2] / "config"
TINY = yaml.safe_load((CONFIG / "tiny.yaml").read_text(encoding="utf-8"))


def edited(path, value):
    """The tiny study with one entry replaced; ``...`` removes it."""
    data = copy.deepcopy(TINY)
    *parents, last = path.split("/")
    here = data
    for part in parents:
        here = here[part]
    if value is ...:
        del here[last]
    else:
        here[last] = value
    return data


SHIPPED = [*CONFIG.glob("*.yaml"), *(CONFIG.parent / "examples").glob("*_study.yaml")]


@pytest.mark.parametrize("file", sorted(SHIPPED), ids=lambda file: file.stem)
def test_shipped_studies_are_correct(file):
    plan = Plan(load_study(file))
    assert plan.jobs["fea"]


DATA = {"campaign": "ring-down", "reference": "fea", "used": ["direction=7deg"]}


@pytest.mark.parametrize(
    ("path", "value", "words"),
    [
        ("specimens/beam/lenght", "50 mm", "specimens.beam.lenght: unknown key"),
        ("specimens/beam/length", "50 kg", "specimens.beam.length: '50 kg' has the unit kilogram; expected one like m"),
        ("specimens/beam/length", 50, "specimens.beam.length: 50 has no unit"),
        ("specimens/beam/thickness", "-3 mm", "specimens.beam.thickness: must be greater than 0 (is '-3 mm')"),
        ("lab/table-5-1/file", "mine.csv", "lab.table-5-1.file: lab file 'mine.csv' not found"),
        ("experiments/stiffness/kind", "Stiffness", "experiments.stiffness"),
        ("campaigns/table/performers", ["fae"], "campaigns.table.performers: no 'fae'; there is fea,"),
        ("campaigns/table/sweep", {"twist": [1]}, "'twist' must start with specimen., experiment. or performer."),
        ("performers/prb-fitted/fit", "none", "performers.prb-fitted.fit: no 'none'; there is modulus, five-hinge"),
        ("performers/prb-published/parameters", {"q": "1 m"}, "performers.prb-published"),
        ("fits/five-hinge/free", {"q": None}, "fits.five-hinge.free: topology five-hinge has no parameter 'q'"),
        ("fits/five-hinge/free", {"k": ["1 m", "2 m"]}, "fits.five-hinge.free: bounds of k: '1 m' has the unit meter"),
        ("fits/five-hinge/data", [{**DATA, "reference": "fae"}], "fits.five-hinge.data.0.reference: no 'fae'"),
        ("fits/five-hinge/data", [{**DATA, "uesd": []}], "fits.five-hinge.data.0.uesd: unknown key"),
        ("performers/fea/mesh/alog", 3, "performers.fea.mesh.alog: unknown key"),
        ("campaigns", ..., "campaigns: Field required"),
        ("study", "a/b", "the name 'a/b' must be letters"),
    ],
)
def test_each_fault_is_one_line(path, value, words):
    with pytest.raises(StudyError) as caught:
        check_study(edited(path, value), CONFIG, "tiny.yaml")
    lines = str(caught.value).splitlines()
    assert len(lines) == 1, lines
    assert lines[0].startswith("tiny.yaml: ")
    assert words in lines[0]


@pytest.mark.parametrize(
    ("path", "value", "words"),
    [
        (
            "campaigns/table/sweep",
            {"specimen.twits": ["1 deg"]},
            "campaigns.table.sweep.specimen.twits: TwistedBeam has no",
        ),
        ("campaigns/table/sweep", {"specimen.twist": [45]}, "campaigns.table.sweep.specimen.twist: 45 has no unit"),
        ("campaigns/table/sweep", {"specimen.twist": ["1 deg", "1 deg"]}, "twist=1deg stands in it twice"),
        ("fits/five-hinge/data", [DATA], "fits.five-hinge.data.0.used: no sample 'direction=7deg'"),
    ],
)
def test_faults_of_sweeps_are_found_before_anything_runs(path, value, words):
    plan = Plan(check_study(edited(path, value), CONFIG))
    with pytest.raises(StudyError) as caught:
        _ = plan.jobs
    assert words in str(caught.value)


def test_a_faulty_lab_table_is_found_before_anything_runs(tmp_path):
    """With or without a fit that reads it; and an own table is an input of the jobs that compare with it."""
    table = tmp_path / "own.csv"
    table.write_text("phi [deg],k_yy [N/m]\n0,1\n", encoding="utf-8")
    data = edited("lab/table-5-1/file", "own.csv")
    del data["fits"]["modulus"]
    data["performers"]["fea-calibrated"].pop("fit")
    plan = Plan(check_study(data, tmp_path))
    assert plan.own_lab_files() == [str(table)]
    with pytest.raises(StudyError, match=r"lab.table-5-1.file: own.csv: column .* is missing"):
        _ = plan.jobs


def test_several_faults_are_all_listed():
    data = edited("specimens/beam/lenght", "50 mm")
    data["experiments"]["stiffness"]["increments"] = 0
    with pytest.raises(StudyError) as caught:
        check_study(data, CONFIG)
    assert len(str(caught.value).splitlines()) == 2


def test_the_command_line_ends_with_2_and_the_line(tmp_path, capsys):
    path = tmp_path / "wrong.yaml"
    path.write_text(yaml.safe_dump(edited("specimens/beam/thickness", "-3 mm")), encoding="utf-8")
    assert main(["check", str(path)]) == 2
    assert "specimens.beam.thickness" in capsys.readouterr().err
    assert main(["check", str(tmp_path / "absent.yaml")]) == 2
    assert main(["mesh", str(CONFIG / "tiny.yaml"), "no-such-mesh"]) == 2


def test_the_written_plan_says_the_same():
    """Jobs read the written plan, which is SI: the same jobs must come out of it."""
    plan = Plan(load_study(CONFIG / "quick.yaml"))
    again = Plan.from_json(plan.to_json())
    assert again.study.digest() == plan.study.digest()
    assert again.samples == plan.samples
    assert again.jobs == plan.jobs


def test_the_exported_schema_is_in_sync():
    """After a change of the models: python -m pipeline schema > config/study.schema.json"""
    written = json.loads((CONFIG / "study.schema.json").read_text(encoding="utf-8"))
    assert written == json.loads(json.dumps(Study.model_json_schema(by_alias=True)))


def test_a_new_twist_adds_only_its_jobs():
    before = Plan(check_study(TINY, CONFIG)).jobs
    after = Plan(
        check_study(edited("campaigns/table/sweep", {"specimen.twist": ["0 deg", "90 deg", "45 deg"]}), CONFIG)
    ).jobs
    for stage in ("mesh", "fea", "prb"):
        assert before[stage].items() <= after[stage].items()
        assert all("45" in id or stage == "mesh" for id in after[stage].keys() - before[stage].keys())
    assert len(after["mesh"]) == len(before["mesh"]) + 1


def test_a_mesh_does_not_depend_on_the_material():
    before = Plan(check_study(TINY, CONFIG)).jobs
    after = Plan(check_study(edited("specimens/beam/mass", "4 g"), CONFIG)).jobs
    assert before["mesh"] == after["mesh"]
    assert before["fea"] != after["fea"]
