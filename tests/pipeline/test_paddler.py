"""A paddling device as a study: its numbers fitted to the published thrust, its performer, and its MJCF."""

import copy
import json
from pathlib import Path

import mujoco
import pytest
import yaml

import pipeline.plan as plans
from pipeline.cli import main
from pipeline.plan import load_plan
from pipeline.study import StudyError, check_study
from results.store import read_record

STUDY = yaml.safe_load("""
study: paddled
specimens:
  device: {kind: FinnedTube}
  loaded: {kind: FinnedTube, load_fin: {mass: 2.05 g, length: 30.9 mm, width: 45 mm}}
  beam: {kind: TwistedBeam}
experiments:
  paddle: {kind: PaddleThrust, pressure: 60 psi, cycles: 2}
performers:
  nominal: {kind: prb, topology: paddler, parameters: {piston: 30 mm^2}}
  fitted: {kind: prb, topology: paddler, fit: thrust}
  elliptic: {kind: prb, topology: paddler, fit: thrust, water: ellipsoid}
campaigns:
  paddle: {specimen: loaded, experiment: paddle, performers: [nominal, fitted, elliptic]}
fits:
  thrust:
    kind: paddler
    model: fitted
    specimen: loaded
    free: {piston: [20 mm^2, 120 mm^2], fill: [20 ms, 100 ms]}
    sets: 0
    search: {population: 5, generations: 1}
""")


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """The study carried out."""
    folder = tmp_path_factory.mktemp("paddled")
    path = folder / "paddled.yaml"
    path.write_text(yaml.safe_dump(STUDY, sort_keys=False), encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(plans, "RUNS", folder / "runs")
        assert main(["fit", str(path), "thrust"]) == 0
        for name in load_plan(path).batches:
            assert main(["prb", str(path), name]) == 0
        yield path


def thrust_of(plan, performer):
    record = read_record(Path(plan.jobs["prb"][f"paddle.{performer}.single"].output))
    assert record.completed, record.reason
    return record["thrust"].max()


def test_the_fit_is_what_its_performer_paddles_with(study):
    plan = load_plan(study)
    result = json.loads(Path(plan.fit_output("thrust")).read_text(encoding="utf-8"))
    assert (result["status"], result["kind"]) == ("completed", "paddler")
    found = {p["name"]: p["value"] for p in result["parameters"]}
    record = read_record(Path(plan.jobs["prb"]["paddle.fitted.single"].output))
    assert record.how["parameters"]["piston"]["value"] == pytest.approx(found["piston"])
    # Published: 2.6 N with the load fin.
    assert abs(thrust_of(plan, "fitted") - 2.6) < abs(thrust_of(plan, "nominal") - 2.6)


def test_another_water_is_an_option_of_the_performer(study, tmp_path):
    """The numbers of the fit, which followed the plate law, in MuJoCo's fluid: record and model."""
    plan = load_plan(study)
    usual, other = (read_record(Path(plan.jobs["prb"][f"paddle.{n}.single"].output)) for n in ("fitted", "elliptic"))
    assert (other.how["water"], other.how["run_by"]) == ("ellipsoid", f"MuJoCo {mujoco.__version__}")
    assert other.how["parameters"] == usual.how["parameters"]
    assert list(other.channels) == list(usual.channels)
    assert thrust_of(plan, "elliptic") < 0.8 * thrust_of(plan, "fitted")
    file = tmp_path / "paddler.xml"
    assert main(["model", str(study), "elliptic", "--specimen", "loaded", "-o", str(file)]) == 0
    assert mujoco.MjModel.from_xml_path(str(file)).opt.density == 1000.0


def test_water_is_refused_where_nothing_paddles(tmp_path):
    data = copy.deepcopy(STUDY)
    data["performers"]["elliptic"]["topology"] = "five-hinge"
    with pytest.raises(StudyError) as caught:
        check_study(data, tmp_path)
    (line,) = str(caught.value).splitlines()
    assert "elliptic" in line
    assert "water: topology five-hinge does not paddle; leave water out" in line


def test_the_model_is_written_for_other_simulators(study, tmp_path):
    file = tmp_path / "paddler.xml"
    assert main(["model", str(study), "fitted", "--specimen", "loaded", "-o", str(file)]) == 0
    model = mujoco.MjModel.from_xml_path(str(file))
    assert [model.joint(i).name for i in range(model.njnt)] == ["swim", "widen", "turn", "buckle"]
    assert model.neq == 2


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"specimen": "beam"}, "the thrust is that of a FinnedTube"),
        ({"specimen": "none"}, "no 'none'"),
        ({"free": {"nothing": None}}, "no parameter 'nothing'"),
        ({"free": {}}, "nothing to fit"),
    ],
)
def test_wrong_fits_are_refused_where_they_stand(changed, message, tmp_path):
    data = copy.deepcopy(STUDY)
    data["fits"]["thrust"] |= changed
    with pytest.raises(StudyError, match=message):
        check_study(data, tmp_path)
