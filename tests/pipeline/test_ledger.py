import csv
import json
import math
from pathlib import Path

import numpy as np
import pytest
import yaml

from lab.records import Channel, Record, channels
from pipeline.plan import Plan
from pipeline.stages.ledger import findings, ledger
from pipeline.study import check_study
from results.ledger.tables import from_json
from results.store import write_record

STUDY = """
study: made-up
specimens:
  short: {kind: TwistedBeam, length: 40 mm, twist: 90 deg}
  beam: {kind: TwistedBeam, twist: 90 deg, mass: 5.17 g}
experiments:
  stiffness: {kind: StaticStiffness, increments: 1}
  release: {kind: RingDown, duration: 0.1 s}
performers:
  fea: {kind: fea}
  fea-calibrated: {kind: fea, fit: modulus}
  five: {kind: prb, topology: five-hinge}
campaigns:
  table:
    specimen: beam
    experiment: stiffness
    performers: [fea, fea-calibrated]
    sweep: {specimen.twist: [0 deg, 90 deg]}
  motion: {specimen: beam, experiment: release, performers: [fea-calibrated, fea, five]}
  short-motion: {specimen: short, experiment: release, performers: [fea-calibrated, fea, five]}
lab:
  table-5-1: {file: "published:table_5_1"}
fits:
  modulus: {kind: modulus, model: fea, campaign: table, reference: table-5-1, used: [0 deg]}
comparisons:
  - {campaign: table, reference: table-5-1}
  - {campaign: motion, reference: fea-calibrated}
  - {campaign: short-motion, reference: fea-calibrated}
"""


def stiffness_record(sample, k):
    """A beam with K' = diag(k, k, k / 1e4): each leg's increment at its end."""
    legs = sample.experiment.legs()
    motion = np.zeros((len(legs), 6))
    for line, (dof, end) in zip(motion, legs, strict=True):
        line[dof] = end
    return channels(
        Channel("increment", "1", np.arange(len(legs)), ("increment",)),
        Channel("leg", "1", np.arange(len(legs)), ("increment",)),
        Channel("motion", "m", motion, ("increment", "dof")),
        Channel("wrench", "N", motion * np.array([0, k, k, k / 1e4, 0, 0]), ("increment", "dof")),
    )


def motion_record(sample, scale):
    time = np.arange(sample.experiment.samples) / sample.experiment.rate
    markers = np.zeros((len(time), 3, 3))
    markers[:, :, 1] = (scale * np.exp(-5 * time) * np.cos(200 * time))[:, None]
    return channels(Channel("time", "s", time, ("time",)), Channel("markers", "m", markers, ("time", "marker", "axis")))


def perform(plan, sample):
    if sample.experiment.kind == "StaticStiffness":
        found = stiffness_record(sample, 1000.0 if sample.performer == "fea" else 2200.0)
    else:
        found = motion_record(sample, {"fea-calibrated": 1e-3, "fea": 1.5e-3, "five": 1.1e-3}[sample.performer])
    how = {"wall_time_s": 2.0} | ({"topology": "five-hinge", "seconds_per_10_s": 0.5} if sample.stage == "prb" else {})
    about = (sample.specimen.model_dump(mode="json"), sample.experiment.model_dump(mode="json"))
    record = Record(sample.stage, sample.performer, *about, found, how=how)
    write_record(Path(plan.output(sample)), record, {})


@pytest.fixture(scope="module")
def plan(tmp_path_factory):
    plan = Plan(check_study(yaml.safe_load(STUDY), Path()))
    plan.folder = tmp_path_factory.mktemp("made-up")
    for sample in plan.samples.values():
        perform(plan, sample)
    fit = {"name": "youngs_modulus", "unit": "Pa", "value": 50e6, "standard_error": 5e6}
    Path(plan.fit_output("modulus")).parent.mkdir()
    Path(plan.fit_output("modulus")).write_text(json.dumps({"status": "completed", "parameters": [fit]}))
    return plan


@pytest.fixture(scope="module")
def rows(plan):
    ledger(plan)
    with (plan.folder / "ledger.csv").open(encoding="utf-8") as file:
        return {row["id"]: row for row in csv.DictReader(file)}


def test_the_stage_writes_its_three_files_and_says_what_it_found(plan):
    said = ledger(plan)
    assert said.startswith("220 published figures: ")
    assert (plan.folder / "ledger.md").read_text(encoding="utf-8").startswith("# Published figures")
    shown = from_json((plan.folder / "ledger.json").read_text(encoding="utf-8"))
    assert f"{shown.counts['reproduced']} reproduced" in said


def test_entries_of_table_5_1_come_from_the_calibrated_fea(rows):
    row = rows["t5.1-90-k_yy"]
    assert float(row["ours"]) == pytest.approx(2200)
    assert (row["origin"], row["model"], row["use"]) == ("fea fitted", "fea-calibrated", "held out")
    assert row["verdict"] == "reproduced"
    assert "fea 1000 (-55%)" in row["others"]
    assert rows["t5.1-0-k_yy"]["use"] == "in sample"
    assert rows["t5.1-45-k_yy"]["verdict"] == "not in this study"
    assert rows["t5.1-45-k_yy"]["command"] == "./scram run config/quick.yaml"


def test_commands_name_the_study_in_hand(rows):
    assert rows["t5.1-90-k_yy"]["command"] == "./scram run (the study made-up)"


def test_tracking_errors_and_times_come_from_the_records(rows):
    assert float(rows["c5-fea-error"]["ours"]) == pytest.approx(50.0)
    assert rows["c5-fea-error"]["origin"] == "fea against fea fitted"
    assert rows["c5-prb-error"]["verdict"] == "not in this study"  # nothing is fitted to a motion
    assert float(rows["c5-prb-time"]["ours"]) == 0.5
    assert float(rows["c5-fea-time"]["ours"]) == pytest.approx(2.0 * 10 / 0.1)


def test_fits_bring_their_standard_errors(rows):
    row = rows["c5-tpu-E"]
    assert (float(row["ours"]), row["verdict"]) == (50e6, "differs")  # 24 MPa off, 10 MPa allowed
    assert "fit modulus" in row["why"]


def test_inputs_are_those_of_the_published_beam(rows):
    assert float(rows["t5.2-l"]["ours"]) == 0.05
    assert float(rows["c5-markers"]["ours"]) == 3


def test_beams_of_another_size_say_nothing_about_published_figures(plan):
    assert not [f for f in findings(plan) if f.campaign == "short-motion"]
    assert [f for f in findings(plan) if f.campaign == "motion"]


def test_the_dissertations_own_numbers_are_no_findings(plan):
    assert not [f for f in findings(plan) if "dissertation" in f.model]
    assert all(f.role for f in findings(plan) if f.campaign)
    assert any(math.isfinite(f.reference_value) for f in findings(plan))
