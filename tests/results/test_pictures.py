"""The stage that draws: which figures a study gets."""

import json
from pathlib import Path

import pytest
import yaml

from pipeline import plan as planning
from pipeline.stages.perform import perform
from pipeline.stages.pictures import pictures
from pipeline.study import check_study

STUDY = """
study: drawn
specimens:
  beam: {kind: TwistedBeam, mass: 5.17 g, material: {viscous_time: 10 ms}}
experiments:
  shake: {kind: BaseShake, tolerance: 0.05, samples_per_period: 16}
  modes: {kind: NaturalModes, count: 2}
  stiffness: {kind: StaticStiffness, increments: 1}
performers:
  chain: {kind: prb, topology: gauss-chain, settings: {stations: 2}}
  hinges: {kind: prb, topology: five-hinge}
campaigns:
  frequencies:
    specimen: beam
    experiment: shake
    performers: [chain, hinges]
    sweep: {specimen.twist: [90 deg, -90 deg], experiment.frequency: {from: 5 Hz, to: 30 Hz, count: 6}}
  twists:
    specimen: beam
    experiment: shake
    performers: [chain]
    sweep: {specimen.twist: [30 deg, 60 deg]}
  one: {specimen: beam, experiment: shake, performers: [chain]}
  modes:
    specimen: beam
    experiment: modes
    performers: [chain, hinges]
    sweep: {specimen.twist: &twists [0 deg, 30 deg, 60 deg, 90 deg]}
  stiffness:
    specimen: beam
    experiment: stiffness
    performers: [chain, hinges]
    sweep: {specimen.twist: *twists}
lab:
  table-5-1: {file: "published:table_5_1"}
comparisons:
  - {campaign: frequencies, reference: chain}
  - {campaign: stiffness, reference: table-5-1}
"""


@pytest.fixture
def plan(tmp_path, monkeypatch):
    monkeypatch.setattr(planning, "RUNS", tmp_path)
    made = planning.Plan(check_study(yaml.safe_load(STUDY), tmp_path))
    for sample in made.samples.values():
        said = perform(made, sample.id, Path(made.output(sample)))
        assert "failed" not in said
    return made


def test_every_experiment_gets_its_figures_under_its_campaign(plan):
    said = pictures(plan)
    index = json.loads((plan.folder / "pictures/index.json").read_text(encoding="utf-8"))
    files = {name: [p["file"] for p in index["files"] if p["group"] == name] for name in plan.study.campaigns}
    assert files == {
        "frequencies": [
            "frequencies_senses_frequency.png",
            "frequencies_axes_twist-90-deg.png", "frequencies_orbits_twist-90-deg.png",
            "frequencies_axes_twist--90-deg.png", "frequencies_orbits_twist--90-deg.png",
        ],
        "twists": ["twists_family_15-Hz.png", "twists_orbits_15-Hz.png"],
        "one": ["one_orbits.png"],
        "modes": ["modes_modes.png"],
        "stiffness": ["stiffness_bars.png", "stiffness_twist.png", "stiffness_chain_curves.png"],
    }  # fmt: skip
    assert said.startswith(f"{len(index['files'])} pictures")
    for picture in index["files"]:
        drawn = plan.folder / "pictures" / picture["file"]
        assert drawn.read_bytes()[:4] == b"\x89PNG"
        assert drawn.with_suffix(".csv").read_text(encoding="utf-8").count("\n") > 1
    assert not any(p["folded"] for p in index["files"])
