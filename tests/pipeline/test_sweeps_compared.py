"""Tables of sweeps through the stages: orbits, their symmetry, natural frequencies; a finer PRB is the reference."""

import csv
import math
from pathlib import Path

import pytest

from pipeline import plan as plans
from pipeline.plan import Plan
from pipeline.stages.compare import compare
from pipeline.stages.gather import entries
from pipeline.stages.perform import perform
from pipeline.study import check_study
from results.mirror import MIRROR, pairs
from results.slugs import short
from results.tables import from_json

STUDY = {
    "study": "sweeps",
    "specimens": {"beam": {"kind": "TwistedBeam", "mass": "5.17 g"}},
    "experiments": {"shake": {"kind": "BaseShake", "tolerance": 0.01}, "modes": {"kind": "NaturalModes", "count": 2}},
    "performers": {
        "strip": {"kind": "prb", "topology": "gauss-strip"},
        "chain": {"kind": "prb", "topology": "gauss-chain"},
    },
    "campaigns": {
        "shake": {
            "specimen": "beam", "experiment": "shake", "performers": ["strip", "chain"],
            "sweep": {"specimen.twist": ["90 deg", "-90 deg"], "experiment.frequency": ["10 Hz", "15 Hz", "20 Hz"]},
        },
        "modes": {
            "specimen": "beam", "experiment": "modes", "performers": ["strip", "chain"],
            "sweep": {"specimen.twist": ["0 deg", "90 deg"]},
        },
    },
    "comparisons": [{"campaign": "shake", "reference": "strip"}, {"campaign": "modes", "reference": "strip"}],
}  # fmt: skip


@pytest.fixture(scope="module")
def plan(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sweeps")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(plans, "RUNS", folder / "runs")
        found = Plan(check_study(STUDY, folder, "study"))
        for sample in found.samples:
            assert "completed" in perform(found, sample, Path(found.output(found.samples[sample])))
        compare(found)
        yield found


@pytest.fixture(scope="module")
def tables(plan):
    return {table.title: table for table in from_json((plan.folder / "tables.json").read_text(encoding="utf-8"))}


@pytest.fixture(scope="module")
def rows(plan):
    with open(plan.folder / "accuracy.csv", encoding="utf-8", newline="") as handle:
        return list(csv.DictReader(handle))


def test_every_sweep_has_its_tables(tables):
    assert list(tables) == [
        "In short: shake against strip (prb)",
        "Errors: orbits of shake against strip (prb)",
        "where the sense of travel reverses over frequency: shake against strip",
        "orbits of shake, twist 90 deg against strip",
        "orbits of shake, twist -90 deg against strip",
        "Errors: modes against strip (prb)",
        "modes against strip (prb)",
        "Errors: modes against beam-theory",
        "modes against beam-theory",
        "symmetry of the orbits",
    ]


def test_the_summary_puts_all_samples_of_a_sweep_together(tables, rows):
    errors = {row["sample"]: float(row["value"]) for row in rows if row["quantity"] == "tracking_error"}
    assert len(errors) == 6
    rms = 100 * math.sqrt(sum(error**2 for error in errors.values()) / 6)
    worst = max(errors, key=errors.get)
    (line,) = tables["In short: shake against strip (prb)"].rows
    assert line[4].startswith(f"{rms:.3g} %")
    assert line[6] == f"{100 * errors[worst]:.3g} % at {short(worst)}"


def test_tables_of_orbits_hold_the_tracking_error_of_every_sample(tables, rows):
    errors = [100 * float(row["value"]) for row in rows if row["quantity"] == "tracking_error"]
    orbits = [table for title, table in tables.items() if title.startswith("orbits of")]
    shown = [float(line[-1]) for table in orbits for line in table.rows]
    assert shown == pytest.approx(errors, rel=5e-3)


def test_opposite_twists_mirror_each_other(plan, tables):
    assert [line[:4] for line in tables["symmetry of the orbits"].rows] == [
        ("shake", "strip", "mirror", "3"),
        ("shake", "chain", "mirror", "3"),
    ]
    found = pairs([entry for entry in entries(plan) if entry.performer == "strip"], MIRROR)
    # Up to what is left of the transient at a tolerance of 1 %.
    assert all(pair.deviation < 0.02 and pair.senses_agree for pair in found)


def test_frequencies_stand_beside_beam_theory(rows):
    theory = [row for row in rows if row["reference"] == "beam-theory"]
    assert len(theory) == 2 * 2 * 2
    first = [abs(float(row["relative_error"])) for row in theory if row["quantity"] == "f_1"]
    assert max(first) < 0.05
