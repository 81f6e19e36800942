"""What the text says of pinched tubes, judged on numbers that are made up."""

import math

import pytest

from lab.experiments import PinchedBending, StaticStiffness
from lab.formulas import FORMULAS
from lab.ledger import Input, ledger
from lab.pinching import first_order, pair_shares
from lab.records import Record
from lab.specimens import TwistedBeam
from results.accuracy import Entry
from results.ledger import Finding, evaluate
from results.ledger.tubes import tube_facts
from results.tubes import sized


def judged(*findings):
    return {row.id: row for row in evaluate(ledger(), findings, "./scram run mine.yaml")}


def told(experiment, numbers, size="printed-tpu", role="fea", model="fea", campaign="c", swept=0, **facts):
    """Findings of one record."""
    known = {
        "size": size, "pinch_angle": 0.0, "law": "published", "swept": swept, "tube_pinched": True, "tube_load": None,
        "tube_push": None, "tube_direction": -math.pi / 2,
    }  # fmt: skip
    return [
        Finding(name, "N/m", value, model, role, campaign, experiment, f"{known | facts}", facts=known | facts)
        for name, value in numbers.items()
    ]


def pinch(degrees, force=8.0, axis=None, size="fea-tube", **more):
    line = math.radians(degrees / 2 if axis is None else axis)
    numbers = {"closing_force": force, "deformation_axis": line}
    return told("Pinch", numbers, size, pinch_angle=math.radians(degrees), **more)


def push(k, pinched, **more):
    return told("PinchedBending", {"k": k}, tube_push=2e-3, tube_pinched=pinched, **more)


def test_without_a_tube_the_command_of_its_study_is_told():
    row = judged()["c3-k-pinched"]
    assert (row.verdict, row.command) == ("not in this study", "./scram run config/pinched_tube.yaml")
    assert "1833" not in judged()["c3-k-unpinched"].others
    assert "cantilever with shear 2351 (+30%)" in judged()["c3-k-unpinched"].others


def test_nothing_of_chapter_3_is_to_come():
    assert {row.verdict for id, row in judged().items() if id.startswith("c3-")} <= {
        "reproduced", "not in this study", "input", "cannot be tested"
    }  # fmt: skip


@pytest.mark.parametrize(("force", "verdict"), [(8.0 * 1.41, "reproduced"), (8.0 * 1.36, "differs")])
def test_the_force_half_way_between_two_pairs(force, verdict):
    row = judged(*pinch(0), *pinch(60, force), *pinch(0, size="printed-tpu"))["c3-fp-increase"]
    assert row.verdict == verdict
    assert row.ours == pytest.approx(100 * (force / 8.0 - 1))
    assert "tube fea-tube: 8 N at 0 deg" in row.why
    assert "second harmonic of the forces alone 41.42 (-17%)" in row.others


def test_the_printed_tube_answers_where_the_fea_tube_is_missing_and_equivalents_count():
    row = judged(*pinch(0, 8, size="printed-tpu"), *pinch(120, 10, size="printed-tpu"),
                 *pinch(180, 13.5, size="printed-tpu"), *pinch(60, 99, size="pet"))["c3-fp-increase"]  # fmt: skip
    assert row.ours == pytest.approx(50.0)
    assert row.verdict == "reproduced"


def test_other_laws_and_swept_tubes_do_not_answer():
    row = judged(*pinch(0), *pinch(60, law="even"), *pinch(60, law="own"))["c3-fp-increase"]
    assert row.verdict == "not in this study"
    row = judged(*pinch(0, 9.0, swept=1, campaign="a"), *pinch(0), *pinch(60, 12.0))["c3-fp-increase"]
    assert row.ours == pytest.approx(50.0)


def test_a_tube_that_never_closes_cannot_be_judged():
    row = judged(*pinch(0), *pinch(60, math.nan))["c3-fp-increase"]
    assert row.verdict == "cannot be tested"
    assert "the walls never touch at 60 deg" in row.why


def theory(degrees):
    return math.degrees(first_order(pair_shares(math.radians(degrees))).axis)


@pytest.mark.parametrize(
    ("axes", "verdict", "ours"),
    [
        ({a: theory(a) for a in (0, 15, 30, 45, 60)}, "reproduced", [60, 180, 300]),
        ({a: a / 2 for a in (0, 15, 30, 45, 60)}, "differs", "no rapid transition"),
        # One of two mirrored shapes: the jump is on one side.
        ({0: 0, 15: 4, 30: 8, 45: 12, 60: 18}, "reproduced", [67.5, 187.5, 307.5]),
        # Fast just behind and just before a pair.
        ({0: 0, 15: 12, 30: 18, 45: 24, 60: 30}, "differs", [7.5, 127.5, 247.5]),
    ],
)
def test_where_the_axis_turns_fast(axes, verdict, ours):
    row = judged(*(f for a, axis in axes.items() for f in pinch(a, axis=axis)))["c3-transition-angles"]
    assert row.verdict == verdict
    assert row.ours == (ours if isinstance(ours, str) else pytest.approx(ours))


def test_a_coarse_sweep_shows_no_transition():
    assert judged(*pinch(0), *pinch(30), *pinch(60))["c3-transition-angles"].verdict == "not in this study"


def test_push_tests_and_their_ratio():
    rows = judged(
        *push(1700.0, False), *push(155.0, True), *push(300.0, True, pinch_angle=1.0, campaign="other"),
        *push(900.0, False, campaign="walls", swept=1), *push(140.0, True, role="prb fitted", model="hinge"),
    )  # fmt: skip
    assert (rows["c3-k-unpinched"].ours, rows["c3-k-unpinched"].verdict) == (1700.0, "reproduced")
    assert (rows["c3-k-pinched"].ours, rows["c3-k-pinched"].verdict) == (155.0, "reproduced")
    assert "hinge 140 (-6%)" in rows["c3-k-pinched"].others
    assert rows["c3-k-ratio"].ours == pytest.approx(1700 / 155)
    assert "1700 over 155 N/m" in rows["c3-k-ratio"].why
    assert rows["c3-k-ratio"].verdict == "reproduced"
    assert judged(*push(1600.0, False))["c3-k-unpinched"].verdict == "differs"


def loaded(degrees, way, load=4.905):
    along = math.radians(-90 + way)
    numbers = {"move_x": 5e-3 * math.cos(along), "move_y": 5e-3 * math.sin(along)}
    return told("PinchedBending", numbers, tube_load=load, pinch_angle=math.radians(degrees))


def test_directions_of_hanging_weights():
    row = judged(*loaded(0, 0), *loaded(120, 45), *loaded(240, -45))["c3-hinge-angles"]
    assert row.ours == pytest.approx([-45, 0, 45])
    assert row.verdict == "reproduced"
    assert judged(*loaded(0, 0), *loaded(120, 20), *loaded(240, -20))["c3-hinge-angles"].verdict == "differs"
    assert judged(*loaded(0, 0), *loaded(120, 45))["c3-hinge-angles"].verdict == "not in this study"
    assert judged(*(f for a in (0, 120, 240) for f in loaded(a, 0, 1.0)))["c3-hinge-angles"].ours is None


def recovery(load, alone, helped):
    return told("ShapeRecovery", {"flat_after_release": alone, "flat_after_let_go": helped}, tube_load=load)


@pytest.mark.parametrize(
    ("id", "load", "alone", "helped", "verdict"),
    [
        ("c3-load-500", 4.905, 0.02, 0.0, "reproduced"),
        ("c3-load-500", 4.905, 0.4, 0.0, "differs"),
        ("c3-load-500", 9.81, 0.02, 0.0, "not in this study"),
        ("c3-load-1000", 9.81, 0.4, 0.03, "reproduced"),
        ("c3-load-1000", 9.81, 0.02, 0.02, "differs"),
        ("c3-load-1000", 9.81, 0.4, 0.4, "differs"),
        ("c3-load-1000", 9.81, 0.4, math.nan, "not in this study"),
    ],
)
def test_recovery(id, load, alone, helped, verdict):
    row = judged(*recovery(load, alone, helped))[id]
    assert row.verdict == verdict
    if verdict != "not in this study":
        assert "of the flattening left" in row.ours


def test_inputs_come_from_the_sizes():
    rows = judged()
    for id in ("fea-tube-radius", "fea-tube-length", "fea-tube-wall", "pet-diameter", "tpu-diameter", "tpu-length"):
        assert rows[f"c3-{id}"].relative_difference == pytest.approx(0, abs=1e-12)
        assert rows[f"c3-{id}"].verdict == "input"
    assert any(isinstance(j, Input) and j.field == "size:pet.diameter" for j in ledger().judgements.values())


def test_formulas_beside_exist():
    names = {name for j in ledger().judgements.values() for name in getattr(j, "beside", {}).values()}
    assert names <= set(FORMULAS)
    assert FORMULAS["pinch_force_increase"]() == pytest.approx(100 * (math.sqrt(2) - 1))


def test_facts_of_records():
    bending = PinchedBending(load=4.905, pinch_angle=1.0)
    record = Record("fea", "fea", sized("printed-tpu").model_dump(mode="json"), bending.model_dump(mode="json"))
    facts = tube_facts(Entry("c", "fea", "pinch_angle=60deg_place=10mm", "tpu", bending, record, "x"))
    assert facts["size"] == "printed-tpu"
    assert (facts["swept"], facts["tube_load"], facts["pinch_angle"]) == (1, 4.905, 1.0)
    static = StaticStiffness()
    record = Record("fea", "fea", TwistedBeam().model_dump(mode="json"), static.model_dump(mode="json"))
    assert tube_facts(Entry("c", "fea", "single", "beam", static, record, "x")) == {}
