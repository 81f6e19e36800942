"""What the text says of tubes with fins, judged on numbers that are made up."""

import math

import numpy as np
import pytest

from lab.ledger import ledger
from lab.specimens.finned_tube import LoadFin
from pipeline.stages.ledger import _numbers
from results.ledger import Finding, evaluate
from results.ledger.fin_rules import FIN_RULES
from results.ledger.fins import fin_facts

PSI = 6894.757293168


def judged(*findings):
    return {row.id: row for row in evaluate(ledger(), findings, "./scram run mine.yaml")}


def told(experiment, numbers, *, role="fea", model="fea", campaign="c", arc=65.0, theta=60.0, **facts):
    """Findings of one record."""
    known = {
        "size": "table-4-1", "prototype": (arc, theta) == (65.0, 60.0), "swept": 0, "fin_arc": math.radians(arc),
        "attachment_angle": math.radians(theta), "load_fin": False, "wall_time": 60.0, "fin_pressure": 60 * PSI,
    }  # fmt: skip
    facts = known | facts
    return [
        Finding(name, "N", value, model, role, campaign, experiment, f"{facts}", facts=facts)
        for name, value in numbers.items()
    ]


def pinch(s=0.02, y=0.006, **more):
    facts = {"drive": "pinch", "fin_travel": 0.033, "increments": 200}
    return told("ShapePropagation", {"s": s, "y": y}, **(facts | more))


def push(force, sense="opposite", travel=0.033, limit=math.nan, **more):
    facts = {"drive": "pinch", "fin_travel": travel, "increments": 40, "sense": sense}
    return told("FinPush", {"force_max": force, "limit_load": limit}, **(facts | more))


def stroke(load_fin=False, body="fixed", frequency=1.0, role="prb", model="paddler", **numbers):
    facts = {"load_fin": load_fin, "body": body, "frequency": frequency}
    known = {"buckling_max": 0.1, "buckling_min": -0.5}
    more = {name: numbers.pop(name) for name in ("swept", "fin_pressure", "theta") if name in numbers}
    return told("PaddleThrust", known | numbers, role=role, model=model, **facts, **more)


def test_nothing_of_chapter_4_is_to_come():
    rows = {id: row for id, row in judged().items() if id.startswith(("c4-", "t4.1-"))}
    assert len(rows) == 64
    assert {row.verdict for row in rows.values()} == {
        "reproduced", "differs", "not in this study", "input", "cannot be tested",
    }  # fmt: skip
    assert rows["c4-f-equal"].command == "./scram run config/finned_tube.yaml"
    assert {row.id for row in rows.values() if row.verdict == "differs"} == {"c4-swim-bl"}


def test_every_rule_is_used():
    used = {j.rule for j in ledger().judgements.values() if j.judge == "fin"}
    assert used == set(FIN_RULES)


def sweep(over, s, y, held):
    angles = np.linspace(35.0, 75.0, len(s))
    key, other = ("arc", "theta") if over == "arc" else ("theta", "arc")
    return [f for a, si, yi in zip(angles, s, y, strict=True) for f in pinch(si, yi, **{key: a, other: held})]


@pytest.mark.parametrize(
    ("s", "y", "verdict"),
    [
        ([20.0, 20.5, 21.0, 20.8], [6.0, 6.1, 6.2, 6.1], "reproduced"),
        ([20.0, 20.5, 21.0, 20.8], [6.0, 6.5, 7.0, 7.5], "differs"),
        ([20.0, 21.0, 22.0, 23.0], [6.0, 6.1, 6.2, 6.1], "differs"),
        ([20.0, math.nan, 21.0, 20.8], [6.0, math.nan, 6.2, 6.1], "reproduced"),
        # Some thousandths of s, whatever share of itself.
        ([20.0, 20.5, 21.0, 20.8], [0.001, -0.002, 0.05, 0.02], "reproduced"),
        ([20.0, 20.5, 21.0, 20.8], [0.001, -0.002, 0.5, 0.02], "differs"),
    ],
)
def test_alpha_is_negligible(s, y, verdict):
    row = judged(*sweep("arc", s, y, 75.0))["c4-alpha-effect"]
    assert row.verdict == verdict
    assert row.ours.startswith("at theta 75 deg s varies by ")
    assert row.tolerance.startswith("rule: negligible is")


def test_the_texts_own_held_angle_is_judged_and_the_tables_stands_beside():
    even, steep = [20.0, 20.0, 20.0], [10.0, 20.0, 30.0]
    row = judged(*sweep("arc", steep, even, 60.0), *sweep("arc", even, even, 75.0))["c4-alpha-effect"]
    assert row.verdict == "reproduced"
    assert "at theta 60 deg s varies by 100% (r +1.00)" in row.why
    row = judged(*sweep("arc", steep, even, 60.0))["c4-alpha-effect"]
    assert row.verdict == "differs"
    assert judged(*sweep("arc", even[:2], even[:2], 75.0))["c4-alpha-effect"].verdict == "not in this study"


@pytest.mark.parametrize(
    ("s", "y", "verdict"),
    [
        ([10.0, 14.0, 19.0, 25.0], [6.0, 6.1, 6.2, 6.1], "reproduced"),
        ([25.0, 19.0, 14.0, 10.0], [6.0, 6.1, 6.2, 6.1], "reproduced"),
        ([10.0, 25.0, 10.0, 25.0], [6.0, 6.1, 6.2, 6.1], "differs"),
        ([10.0, 14.0, 19.0, 25.0], [4.0, 6.0, 8.0, 9.0], "differs"),
        ([20.0, 20.1, 20.2, 20.3], [6.0, 6.1, 6.2, 6.1], "differs"),
    ],
)
def test_theta_goes_with_s_alone(s, y, verdict):
    assert judged(*sweep("theta", s, y, 75.0))["c4-theta-effect"].verdict == verdict


def test_other_pinches_say_nothing_of_the_sweeps():
    even = [20.0, 20.0, 20.0]
    others = [
        *(f for a in (35.0, 55.0, 75.0) for f in pinch(arc=a, theta=75.0, fin_travel=0.02)),
        *(f for a in (35.0, 55.0, 75.0) for f in pinch(arc=a, theta=75.0, drive="pressure")),
        *(f for a in (35.0, 55.0, 75.0) for f in pinch(arc=a, theta=75.0, swept=1)),
        *(f for a in (35.0, 55.0, 75.0) for f in pinch(arc=a, theta=75.0, size="")),
    ]
    assert judged(*others)["c4-alpha-effect"].verdict == "not in this study"
    assert judged(*others, *sweep("arc", even, even, 75.0))["c4-alpha-effect"].verdict == "reproduced"


def test_run_time_in_minutes():
    row = judged(*pinch(wall_time=90.0))["c4-fea-runtime"]
    assert (row.verdict, row.ours) == ("reproduced", 1.5)
    assert "90 s for 200 recorded increments" in row.why
    assert judged(*pinch(wall_time=1800.0))["c4-fea-runtime"].verdict == "differs"
    assert judged(*pinch(increments=50))["c4-fea-runtime"].verdict == "not in this study"


def test_limit_loads_are_the_largest_of_all_states():
    rows = judged(
        *push(2.0, travel=0.0), *push(5.5, travel=0.033, limit=5.5), *push(9.0, swept=1), *push(99.0, theta=75.0),
        *push(0.31, "equal", travel=0.02), *push(0.5, "equal", travel=0.0, limit=0.5), *push(4.0, model="coarse"),
    )  # fmt: skip
    row = rows["c4-f-opposite"]
    assert (row.ours, row.verdict) == (5.5, "reproduced")
    assert "largest of 2 states of flattening, pinched by 33 mm; first peak 5.5 N" in row.why
    assert "coarse 4 (-20%)" in row.others
    assert (rows["c4-f-equal"].ours, rows["c4-f-equal"].verdict) == (0.5, "differs")
    assert judged(*push(0.3, "equal"))["c4-f-equal"].verdict == "reproduced"
    assert "no peak" in judged(*push(0.3, "equal"))["c4-f-equal"].why


def test_strokes_are_told_by_load_fin_body_and_setting():
    rows = judged(
        *stroke(thrust_max=9.9, frequency=2.0), *stroke(thrust_max=9.9, swept=1),
        *stroke(thrust_max=9.9, fin_pressure=40 * PSI), *stroke(thrust_max=9.9, body="free"),
        *stroke(thrust_max=1.3, thrust_min=-0.7, thrust_mean=0.02, tip_speed_mean_power=0.2),
        *stroke(True, thrust_max=2.0, thrust_min=-0.45, thrust_mean=0.25, tip_speed_mean_recovery=0.0244),
        *stroke(True, "free", swim_speed=0.060),
    )  # fmt: skip
    found = {id: (row.ours, row.verdict) for id, row in rows.items() if row.model == "paddler"}
    assert found["c4-thrust-max-nofin"] == (1.3, "reproduced")
    assert found["c4-sim-max-nofin"] == (1.3, "reproduced")
    assert found["c4-thrust-min-nofin"] == (-0.7, "differs")
    assert found["c4-sim-min-nofin"] == (-0.7, "reproduced")
    assert found["c4-thrust-net-nofin"] == (0.02, "differs")
    assert found["c4-thrust-max-fin"] == (2.0, "differs")
    assert found["c4-thrust-min-fin"] == (-0.45, "reproduced")
    assert found["c4-thrust-net-fin"] == (0.25, "reproduced")
    assert found["c4-u-tpe-power"] == (0.2, "differs")
    assert found["c4-u-loadfin-recovery"] == (0.0244, "reproduced")
    assert found["c4-swim-speed"] == (0.060, "reproduced")
    assert "5.7 and -29 deg" in rows["c4-thrust-max-fin"].why
    assert rows["c4-thrust-max-fin"].origin == "prb"


def test_what_was_fitted_to_finite_elements_comes_first():
    row = judged(*stroke(thrust_max=1.2), *stroke(role="prb fitted", model="fitted", thrust_max=0.6))
    row = row["c4-thrust-max-nofin"]
    assert (row.ours, row.model, row.origin) == (0.6, "fitted", "prb fitted")
    assert "paddler 1.2 (+0%)" in row.others


def test_inputs_come_from_the_study(propagation, paddling):
    device, experiment = paddling(load_fin=True).tested(), propagation().experiment
    found = [*_numbers("prototype", device), *_numbers("pinch", experiment), *_numbers("p", paddling().experiment)]
    rows = judged(*found)
    for id in (
        "t4.1-D",
        "t4.1-alpha",
        "t4.1-n",
        "t4.1-l",
        "t4.1-t1",
        "c4-t1-choice",
        "c4-loadfin-mass",
        "c4-fea-pinch",
    ):
        assert rows[id].verdict == "input"
        assert rows[id].relative_difference == pytest.approx(0.0, abs=1e-12), id
    assert rows["t4.1-alpha"].ours == pytest.approx(65.0)
    assert rows["t4.1-n"].ours == 9
    assert rows["c4-pressure-range"].ours == pytest.approx([0.0, 40.0])
    assert rows["c4-thrust-pressure"].ours == pytest.approx(60.0)
    assert rows["c4-fea-steps"].ours == 200
    assert device.load_fin == LoadFin()


def test_facts_of_records(propagation, fin_push, paddling, orbit):
    facts = fin_facts(propagation(arc=35, theta=75))
    assert (facts["prototype"], facts["swept"], facts["drive"], facts["increments"]) == (False, 0, "pinch", 200)
    assert facts["wall_time"] == 60.0
    facts = fin_facts(fin_push("equal", 0.01, slug="travel=10mm_sense=equal_place=0.7"))
    assert (facts["sense"], facts["fin_travel"], facts["swept"], facts["prototype"]) == ("equal", 0.01, 1, True)
    facts = fin_facts(paddling(load_fin=True, body="free"))
    assert (facts["load_fin"], facts["body"], facts["frequency"]) == (True, "free", 1.0)
    assert (facts["swept"], fin_facts(paddling(water="none"))["swept"]) == (0, 1)
    assert fin_facts(orbit()) == {}
