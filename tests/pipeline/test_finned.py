"""Tubes with fins in studies: what goes together, what is refused before anything is meshed, and meshes of parts."""

from pathlib import Path

import pytest
import yaml

import fea
from lab.experiments import FinPush, PaddleThrust, Pinch, RingDown, ShapePropagation
from lab.specimens import FinnedTube, PinchedTube, TwistedBeam
from meshes import read_mesh
from pipeline.cli import main
from pipeline.plan import Plan
from pipeline.stages.cad import cad
from pipeline.stages.mesh import mesh
from pipeline.study import StudyError, check_study
from pipeline.suiting import misfit
from results.store import read_record

CONFIG = Path(__file__).resolve().parents[2] / "config"


def study(experiment, performer=None, specimen=None):
    return {
        "study": "fins",
        "specimens": {"finned": {"kind": "FinnedTube", **(specimen or {})}},
        "experiments": {"one": experiment},
        "performers": {"fea": {"kind": "fea", "element": "shell", **(performer or {})}},
        "campaigns": {"one": {"specimen": "finned", "experiment": "one", "performers": ["fea"]}},
    }


def plan_of(*parts):
    return Plan(check_study(study(*parts), CONFIG, "fins.yaml"))


@pytest.mark.parametrize("experiment", [ShapePropagation(), FinPush(), PaddleThrust()])
def test_experiments_with_fins_are_for_tubes_with_fins(experiment):
    assert misfit(FinnedTube(), experiment) == ""
    for other in (TwistedBeam(), PinchedTube()):
        assert f"{experiment.kind} is no experiment for a {other.kind}" in misfit(other, experiment)


@pytest.mark.parametrize("experiment", [Pinch(), RingDown()])
def test_a_tube_with_fins_takes_no_others(experiment):
    assert misfit(FinnedTube(), experiment) == (
        f"{experiment.kind} is no experiment for a FinnedTube; there is ShapePropagation, FinPush, PaddleThrust"
    )
    record = fea.perform(FinnedTube(), experiment, fea.FeaModel(element="shell"), None)
    assert record.status == "unsupported"
    assert record.reason == f"{experiment.kind} is not for a FinnedTube by finite elements"


def test_a_sample_by_hand_makes_its_mesh(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    performer = {"fin_mesh": {"along": 6, "across": 4}, "material": {"law": "neo-hookean"}}
    text = yaml.safe_dump(study({"kind": "ShapePropagation", "travel": "2 mm", "increments": 4}, performer))
    (tmp_path / "fins.yaml").write_text(text, encoding="utf-8")
    assert main(["fea", "fins.yaml", "one.fea.single"]) == 0
    assert "one.fea.single: completed" in capsys.readouterr().out
    assert len(list((tmp_path / "runs/fins/meshes").glob("*.msh"))) == 1
    record = read_record(tmp_path / "runs/fins/fea/one.fea.single.vtkhdf")
    assert record["travel"][-1] == pytest.approx(2e-3)
    # It is there now.
    assert main(["fea", "fins.yaml", "one.fea.single"]) == 0
    assert "elements" not in capsys.readouterr().out


def test_finite_elements_do_not_paddle():
    record = fea.perform(FinnedTube(), PaddleThrust(), fea.FeaModel(element="shell"), None)
    assert record.status == "unsupported"
    assert record.reason.startswith("no finite-element performer for PaddleThrust")


@pytest.mark.parametrize(
    ("parts", "why"),
    [
        (({"kind": "ShapePropagation"}, {"element": "solid"}), "no mesh of hexahedra: set element: shell"),
        (({"kind": "ShapePropagation", "travel": "48 mm"},), "travel 48 mm is more than the inside"),
        (({"kind": "FinPush", "drive": "pressure"}, None, {"chambers": {"number": 0}}), "needs chambers"),
        (({"kind": "ShapePropagation"}, {"fin_mesh": {"across": 3}}), "across 3 and along 16 are too coarse"),
        (({"kind": "Pinch"},), "Pinch is no experiment for a FinnedTube"),
    ],
)
def test_what_does_not_go_together_is_refused_in_one_line(parts, why):
    with pytest.raises(StudyError, match=why) as caught:
        _ = plan_of(*parts).jobs
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("experiment", "bodies"), [("ShapePropagation", {"tube", "fin"}), ("FinPush", {"tube", "fin", "other fin"})]
)
def test_the_stage_meshes_the_part_that_the_experiment_needs(tmp_path, experiment, bodies):
    plan = plan_of({"kind": experiment}, {"fin_mesh": {"along": 8, "across": 6}}, {"fin_arc": "75 deg"})
    (job,) = plan.jobs_of("mesh")
    assert "shell_8x6" in mesh(plan, job, tmp_path / "finned.msh")
    found = read_mesh(tmp_path / "finned.msh")
    assert set(found.subdomains) == bodies
    assert "side" in found.boundaries


def test_cad_writes_a_part(tmp_path):
    chosen = check_study(study({"kind": "FinPush"}), CONFIG, "fins.yaml")
    said = cad(chosen, "finned", ["chambers.number=3"], tmp_path / "own.step", "actuator")
    assert said.startswith(f"{tmp_path / 'own.step'}: finned, chambers.number 3, actuator; ")
    assert (tmp_path / "own.step").stat().st_size > 10_000
    with pytest.raises(StudyError, match="part 'half': there is whole, bare, actuator"):
        cad(chosen, "finned", [], tmp_path / "other.step", "half")
