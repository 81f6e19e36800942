"""A study of tubes with fins through the stages that read records; the records are made up."""

import json
from pathlib import Path

import numpy as np
import pytest
import yaml

from lab.records import Channel, Record, channels
from pipeline.plan import Plan, load_plan
from pipeline.stages.collect import collect
from pipeline.stages.compare import compare
from pipeline.stages.ledger import ledger
from pipeline.stages.pictures import pictures
from pipeline.stages.report import assumptions, report
from pipeline.study import check_study
from results.collection import read_study
from results.store import write_record
from results.tables import from_json

CONFIG = Path(__file__).resolve().parents[2] / "config"
STUDY = """
study: fins
specimens:
  prototype: &prototype {kind: FinnedTube}
  loaded: {<<: *prototype, load_fin: {}}
experiments:
  pinch: {kind: ShapePropagation, increments: 4}
  inflate: {kind: ShapePropagation, drive: pressure, increments: 4}
  push: {kind: FinPush}
  paddle: {kind: PaddleThrust, pressure: 60 psi}
performers:
  fea: {kind: fea, element: shell}
  fine: {kind: fea, element: shell, fin_mesh: {across: 14}}
  paddler: {kind: prb, topology: paddler}
  other: {kind: prb, topology: paddler, parameters: {plate: '1.5 1'}}
campaigns:
  propagation: {specimen: prototype, experiment: pinch, performers: [fea, fine]}
  alpha:
    specimen: prototype
    experiment: pinch
    performers: [fea]
    sweep: {specimen.fin_arc: [35 deg, 55 deg, 75 deg], specimen.attachment_angle: [75 deg]}
  pressure: {specimen: prototype, experiment: inflate, performers: [fea]}
  push: {specimen: prototype, experiment: push, performers: [fea], sweep: {experiment.sense: [opposite, equal]}}
  thrust: {specimen: prototype, experiment: paddle, performers: [paddler, other]}
  thrust-loaded: {specimen: loaded, experiment: paddle, performers: [paddler]}
comparisons:
  - {campaign: propagation, reference: fine}
  - {campaign: thrust, reference: paddler}
"""


def made(sample):
    """Channels of a record whose numbers grow evenly."""
    experiment, share = sample.experiment, np.linspace(0.0, 1.0, 5)
    if experiment.kind == "PaddleThrust":
        time, most = experiment.times, {"paddler": 1.3, "other": 2.0}[sample.performer]
        wave = np.sin(2 * np.pi * time)
        columns = {name: np.abs(wave) for name in ("x1", "fin_angle", "buckling", "tip_speed", "input_force")}
        columns["thrust"] = np.where(wave > 0, most, 0.9) * wave
        return channels(*(Channel(n, "N", v, ("time",)) for n, v in ({"time": time} | columns).items()))
    columns = {
        "increment": np.arange(5), "travel": 0.033 * share, "p": np.outer(share, [-0.016, -0.006, 0.012]),
        "fin_angle": 1.0 - 0.5 * share, "fin_radius": 0.02 / (1 + share), "pressure": experiment.pressure * share,
        "force": 4.8 * share, "strain": 0.1 * share,
    }  # fmt: skip
    if experiment.kind == "FinPush":
        columns |= {"stage": np.array([0, 1, 2, 2, 2]), "travel": 0.033 * np.array([0, 1, 1, 1, 1.0])}
        columns |= {"push": 0.02 * np.array([0, 0, 0, 0.5, 1.0])}
    dims = {"p": ("increment", "axis")}
    return channels(*(Channel(n, "m", np.asarray(v), dims.get(n, ("increment",))) for n, v in columns.items()))


@pytest.fixture(scope="module")
def plan(tmp_path_factory):
    plan = Plan(check_study(yaml.safe_load(STUDY), Path()))
    plan.folder = tmp_path_factory.mktemp("fins")
    for sample in plan.samples.values():
        about = (sample.specimen.model_dump(mode="json"), sample.experiment.model_dump(mode="json"))
        lost = "35deg" in sample.slug
        record = Record(sample.stage, sample.performer, *about, {} if lost else made(sample), how={"wall_time_s": 30.0},
                        status="failed" if lost else "completed", reason="by hand" if lost else "")  # fmt: skip
        write_record(Path(plan.output(sample)), record, {})
    return plan


def test_all_stages_read_it(plan):
    assert compare(plan).endswith("1 samples failed")
    assert ledger(plan).startswith("220 published figures")
    collect(plan)
    assert read_study(plan.folder / "study.h5").sizes["sample"] == len(plan.samples)
    drawn = pictures(plan)
    assert drawn.endswith("left out: none")
    assert report(plan).startswith(str(plan.folder / "report.html"))
    index = json.loads((plan.folder / "pictures" / "index.json").read_text(encoding="utf-8"))
    assert [file["file"] for file in index["files"]] == [
        "propagation_travel.png", "alpha_travel.png", "alpha_designs.png", "pressure_pressure.png",
        "push_prototype-by-fea_pushes.png", "thrust_thrust.png",
    ]  # fmt: skip
    tables = {t.title: t for t in from_json((plan.folder / "tables.json").read_text(encoding="utf-8"))}
    accuracy = tables["lab, dissertation, FEA and PRB: tube with fins"]
    rows = {row[0]: dict(zip(accuracy.header, row, strict=True)) for row in accuracy.rows}
    assert rows["s at full pinch [mm]"]["fea (fea)"] == "20"
    assert rows["limit load, opposite sense [N]"]["fea (fea)"] == "4.8 (-4%)"
    assert rows["peak thrust, without load fin [N]"]["other (prb)"] == "2 (+67%)"
    assert "Errors: propagation against fine (fea)" in tables
    judged = json.loads((plan.folder / "ledger.json").read_text(encoding="utf-8"))
    verdicts = {row["id"]: (row["verdict"], row["ours"]) for row in judged["rows"]}
    assert verdicts["c4-f-opposite"] == ("reproduced", pytest.approx(4.8))
    assert verdicts["c4-thrust-max-nofin"] == ("reproduced", pytest.approx(1.3))
    assert verdicts["t4.1-n"] == ("input", 9)
    assert verdicts["c4-loadfin-mass"] == ("input", 0.00205)


def test_every_assumption_is_told(plan):
    told = "\n".join(assumptions(plan))
    for words in ("no drawing", "the load fin only the mass", "the plate meets the fin at 0.85", "'at the midpoint'",
                  "air is on for 50%", "all chambers have one pressure"):  # fmt: skip
        assert words in told.replace("The plate", "the plate").replace("Of the", "the"), words


def test_the_chapter_is_one_study():
    """Two sweeps of six designs for each held angle, five states in both senses."""
    plan = load_plan(CONFIG / "finned_tube.yaml")
    shapes = [s for s in plan.samples.values() if s.campaign in ("alpha", "theta")]
    angles = {(round(np.rad2deg(s.specimen.fin_arc)), round(np.rad2deg(s.specimen.attachment_angle))) for s in shapes}
    for held in (75, 60):
        assert len({arc for arc, theta in angles if theta == held}) == 6
    for held in (75, 65):
        found = sorted(theta for arc, theta in angles if arc == held and theta != 60)
        assert found == [35, 43, 51, 59, 67, 75]
    pushes = [s.experiment for s in plan.samples.values() if s.campaign == "push"]
    assert len({(e.travel, e.sense) for e in pushes}) == 10
    waters = {(s.model.water, s.model.fit, s.specimen.load_fin is None) for s in plan.samples.values()
              if s.campaign in ("water", "water-loaded")}  # fmt: skip
    assert waters == {(w, "thrust", bare) for w in ("ellipsoid", "inertia-box", "none") for bare in (True, False)}
    assert plan.study.experiments["pinch"].increments == 200
    assert [d.sample.campaign for d in plan.data("fin")] == ["propagation", *["push"] * 10]
