"""PRB samples that one job makes together."""

from pathlib import Path

import pytest
import yaml

import prb
from pipeline import plan as plans
from pipeline.batches import MOST_IN_BATCH
from pipeline.cli import main
from pipeline.plan import Plan, load_plan
from pipeline.run import forget_failed
from pipeline.study import check_study
from results.store import read_record

STUDY = """
study: batched
specimens:
  beam: {kind: TwistedBeam, twist: 90 deg, mass: 5.17 g}
experiments:
  stiffness: {kind: StaticStiffness, increments: 1}
  release: {kind: RingDown, duration: 0.02 s}
performers:
  truth: {kind: prb, topology: gauss-chain, parameters: {E: 60 MPa}}
  chain: {kind: prb, topology: gauss-chain}
  fitted: {kind: prb, topology: gauss-chain, fit: to-truth}
campaigns:
  table: {specimen: beam, experiment: stiffness, performers: [chain]}
  release:
    specimen: beam
    experiment: release
    performers: [truth, chain, fitted]
    sweep: {experiment.direction: [0 deg, 45 deg, 90 deg]}
fits:
  to-truth:
    kind: fit
    model: fitted
    free: {E: null}
    data: [{campaign: release, reference: truth, used: [direction=0deg], held_out: [direction=45deg]}]
"""


def edited(*directions, **campaign):
    study = yaml.safe_load(STUDY)
    if directions:
        study["campaigns"]["release"]["sweep"] = {"experiment.direction": list(directions)}
    study["campaigns"]["release"] |= campaign
    return study


def plan_of(study):
    return Plan(check_study(study, Path()))


def slugs(batch):
    return [job.id.partition(".")[2].partition(".")[2] for job in batch.jobs]


def test_every_sample_stands_in_one_batch_of_its_campaign_and_performer():
    plan = plan_of(edited())
    assert list(plan.batches) == ["table.chain", "release.truth", "release.truth+2", "release.chain", "release.fitted"]
    assert [id for batch in plan.batches.values() for id in (job.id for job in batch.jobs)] == list(plan.jobs["prb"])
    assert all(job.id.startswith(f"{id.partition('+')[0]}.") for id, b in plan.batches.items() for job in b.jobs)
    assert plan.batches["release.chain"].outputs == tuple(
        plan.jobs["prb"][f"release.chain.direction={angle}deg"].output for angle in (0, 45, 90)
    )
    assert plan.batches["release.chain"].inputs == ()
    assert plan.batches["release.fitted"].inputs == (plan.fit_output("to-truth"),)
    assert plan.size() == "1 fit, 10 prb in 5 jobs"


def test_a_longer_sweep_leaves_alone_what_a_fit_follows():
    before = plan_of(edited()).batches
    after = plan_of(edited("0 deg", "45 deg", "90 deg", "15 deg")).batches
    assert slugs(before["release.truth"]) == ["direction=0deg", "direction=45deg"]
    assert before["release.truth"] == after["release.truth"]
    assert slugs(after["release.truth+2"]) == ["direction=90deg", "direction=15deg"]
    assert before["release.chain"].digest != after["release.chain"].digest


def test_models_with_and_without_a_fit_stay_apart():
    """A fit may follow the one and stand behind the other."""
    study = edited(sweep={"performer.fit": [None, "to-truth"], "experiment.direction": ["0 deg", "45 deg"]})
    study["fits"]["to-truth"]["data"][0]["used"] = ["fit=none_direction=0deg"]
    study["fits"]["to-truth"]["data"][0]["held_out"] = []
    study["campaigns"]["release"]["performers"] = ["truth"]
    found = plan_of(study).batches
    assert [(slugs(b), len(b.inputs)) for id, b in found.items() if id.startswith("release")] == [
        (["fit=none_direction=0deg"], 0),
        (["fit=none_direction=45deg"], 0),
        (["fit=to-truth_direction=0deg", "fit=to-truth_direction=45deg"], 1),
    ]


def test_long_sweeps_are_cut():
    count = 2 * MOST_IN_BATCH + 1
    plain = {"chain": {"kind": "prb", "topology": "gauss-chain"}}
    sweep = {"experiment.direction": {"from": "-90 deg", "to": "90 deg", "count": count}}
    found = plan_of(edited(sweep=sweep, performers=["chain"]) | {"fits": {}, "performers": plain}).batches
    assert {id: len(b.jobs) for id, b in found.items()} == {
        "table.chain": 1,
        "release.chain": MOST_IN_BATCH,
        "release.chain+2": MOST_IN_BATCH,
        "release.chain+3": 1,
    }


def test_the_digest_holds_values_and_code(monkeypatch):
    plain = plan_of(edited()).batches["release.chain"]
    assert plan_of(edited()).batches["release.chain"].digest == plain.digest
    heavier = edited()
    heavier["specimens"]["beam"]["mass"] = "6 g"
    assert plan_of(heavier).batches["release.chain"].digest != plain.digest
    monkeypatch.setattr(plans, "source_hash", lambda *names: "edited" if "prb" in names else "same")
    assert plan_of(edited()).batches["release.chain"].digest != plain.digest


def test_the_written_plan_has_the_same_batches():
    plan = plan_of(edited())
    again = Plan.from_json(plan.to_json())
    assert again.batches == plan.batches
    assert [b.digest for b in again.batches.values()] == [b.digest for b in plan.batches.values()]


@pytest.fixture
def study(tmp_path, monkeypatch):
    monkeypatch.setattr(plans, "RUNS", tmp_path / "runs")
    path = tmp_path / "batched.yaml"
    path.write_text(STUDY, encoding="utf-8")
    return path


def test_a_failing_sample_is_a_hole_in_its_batch_and_is_tried_again(study, monkeypatch, capsys):
    whole = prb.perform

    def perform(specimen, experiment, model):
        if 0.1 < experiment.direction < 1:
            raise FloatingPointError("made to fail")
        return whole(specimen, experiment, model)

    monkeypatch.setattr(prb, "perform", perform)
    assert main(["prb", str(study), "release.chain"]) == 0
    plan = load_plan(study)
    files = [Path(path) for path in plan.batches["release.chain"].outputs]
    assert [read_record(file).status for file in files] == ["completed", "failed", "completed"]
    assert "release.chain.direction=45deg: failed FloatingPointError: made to fail" in capsys.readouterr().out
    files[2].write_bytes(b"not a record")
    forget_failed(plan)
    assert [file.exists() for file in files] == [True, False, True]


def test_one_sample_alone_gives_the_same_record(study, tmp_path):
    assert main(["prb", str(study), "release.chain"]) == 0
    alone = tmp_path / "alone.vtkhdf"
    assert main(["prb", str(study), "release.chain.direction=90deg", "-o", str(alone)]) == 0
    with_others = read_record(Path(load_plan(study).jobs["prb"]["release.chain.direction=90deg"].output))
    assert (read_record(alone)["markers"] == with_others["markers"]).all()


def test_wrong_ids_end_with_2_and_a_line(study, tmp_path, capsys):
    assert main(["prb", str(study), "release.chain", "-o", str(tmp_path / "x.vtkhdf")]) == 2
    assert "release.chain is a batch" in capsys.readouterr().err
    assert main(["prb", str(study), "release.chian"]) == 2
    said = capsys.readouterr().err
    assert "no prb job 'release.chian'; there is table.chain, release.truth," in said
    assert "and 5 more, see plan" in said


def test_plan_lists_batches_with_their_samples(study, capsys):
    assert main(["plan", str(study)]) == 0
    said = capsys.readouterr().out.splitlines()
    place = said.index("prb   release.chain: 3 samples")
    assert said[place + 1].strip() == "release.chain.direction=0deg"
    assert "prb   table.chain: 1 sample" in said
    assert said[-1] == "fit   to-truth"
