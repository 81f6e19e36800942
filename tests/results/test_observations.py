"""The text's observations in words, held against made-up orbits that follow them or do not."""

import math

import numpy as np
import pytest

from lab.ledger import ledger
from results.ledger import Finding, evaluate

FREQUENCIES = np.arange(1.0, 46.0)
CORNERS = ("lower-left", "lower-right", "upper-left", "upper-right")


def shake(twist, frequency, ratio, *, major=4e-3, tilt=-1.2, span_y=1e-3, span_x=1e-4, campaign="shake", **facts):
    numbers = {
        "axis_ratio": ratio, "major_axis": major, "minor_axis": abs(ratio) * major, "tilt": tilt, "span_x": span_x,
        "span_y": span_y, "span_z": 4e-3,
    }  # fmt: skip
    facts = {"twist": math.radians(twist), "frequency": float(frequency)} | facts
    return [
        Finding(name, "m", value, "fea", "fea", campaign, "BaseShake", f"{facts}", facts=facts)
        for name, value in numbers.items()
    ]


def judged(id, orbits):
    rows = evaluate(ledger(), [finding for orbit in orbits for finding in orbit], "./scram run mine")
    return {row.id: row for row in rows}[id]


def over_frequency(twist, ratio, **changes):
    return [shake(twist, f, ratio(f), **changes) for f in FREQUENCIES]


def over_twist(span_y=lambda phi: 1e-3 * abs(phi), ratio=lambda phi: phi / 400, tilt=lambda phi: -phi / 200):
    return [
        shake(phi, 15, ratio(phi), span_y=span_y(phi), tilt=tilt(phi), campaign="twists") for phi in range(-180, 181, 5)
    ]


def framed(ratio, load=0.02):
    return [
        orbit for corner in CORNERS
        for orbit in over_frequency(-90, lambda f, c=corner: ratio(c, f), corner=corner, load=load, campaign="offset")
    ]  # fmt: skip


def test_without_shakes_nothing_is_said():
    row = judged("c5-obs-reversal", [])
    assert (row.verdict, row.command) == ("not in this study", "./scram run config/twisted_beam.yaml")
    assert judged("c5-obs-y-growth", [shake(90, 15, 0.1)]).verdict == "not in this study"


def test_motion_across_the_axis():
    flat = over_frequency(90, lambda f: 0.1)
    assert judged("c5-obs-yz", flat).verdict == "reproduced"
    flat[30] = shake(90, 31, 0.1, span_x=3e-3)
    row = judged("c5-obs-yz", flat)
    assert (row.verdict, row.ours) == ("differs", "along x at most 0.75 of the extent across")
    assert "largest at 31 Hz" in row.why


def test_growth_with_twist_has_to_hold_in_every_step():
    row = judged("c5-obs-y-growth", over_twist())
    assert (row.verdict, row.ours) == ("reproduced", "grows in 36 of 36 steps")
    row = judged("c5-obs-y-growth", over_twist(span_y=lambda phi: 1e-3 * math.sin(math.radians(abs(phi)))))
    assert (row.verdict, row.ours) == ("differs", "grows in 18 of 36 steps")
    assert "at most 1 mm at 90 deg" in row.why


def test_growth_is_judged_by_the_twist_sweep_though_single_twists_are_shaken_elsewhere():
    assert judged("c5-obs-y-growth", over_frequency(90, lambda f: 0.1) + over_twist()).verdict == "reproduced"


@pytest.mark.parametrize(
    ("changes", "verdict"),
    [
        ({}, "reproduced"),
        ({"ratio": lambda phi: abs(phi) / 400}, "differs"),
        ({"tilt": lambda phi: -abs(phi) / 200}, "differs"),
    ],
)
def test_mirrored_orbits(changes, verdict):
    row = judged("c5-obs-mirror", over_twist(**changes))
    assert row.verdict == verdict
    assert row.ours.startswith("36 pairs mirrored within ")


def test_chirality_sets_the_sense_even_where_the_sense_changes_along_the_sweep():
    right, left = over_frequency(90, lambda f: (20.5 - f) / 50), over_frequency(-90, lambda f: (f - 20.5) / 50)
    row = judged("c5-obs-chirality", right + left)
    assert (row.verdict, row.ours) == ("reproduced", "opposite at 45 of 45 frequencies")
    assert "each sense reverses" in row.why
    row = judged("c5-obs-chirality", right + over_frequency(-90, lambda f: -0.3))
    assert (row.verdict, row.ours) == ("differs", "opposite at 20 of 45 frequencies")


def test_lines_have_no_sense_to_compare():
    right, left = over_frequency(90, lambda f: 1e-5 if f < 11 else 0.2), over_frequency(-90, lambda f: -0.2)
    assert judged("c5-obs-chirality", right + left).ours == "opposite at 35 of 35 frequencies"


def test_loaded_orbits_against_bare_ones_at_the_lower_frequencies():
    bare = over_frequency(-90, lambda f: 0.1 if f < 23.5 else 0.9)
    assert judged("c5-obs-loaded", bare + framed(lambda c, f: 0.2)).verdict == "reproduced"
    row = judged("c5-obs-loaded", bare + framed(lambda c, f: 0.05 if c == "upper-left" else 0.2))
    assert (row.verdict, row.ours) == ("differs", "at 3 of 4 corners")
    assert "up to 23 Hz" in row.why


def test_reversals_at_the_corners():
    turning = framed(lambda c, f: (10.5 + 5 * CORNERS.index(c) - f) / 50)
    assert judged("c5-obs-reversal", turning).verdict == "reproduced"
    assert "lower-right 15.5 Hz" in judged("c5-obs-reversal", turning).why
    assert judged("c5-obs-inertia", turning).verdict == "reproduced"
    alike = framed(lambda c, f: (10.5 - f) / 50)
    assert judged("c5-obs-inertia", alike).verdict == "differs"
    some = framed(lambda c, f: 0.2 if c == "lower-left" else (10.5 - f) / 50)
    assert judged("c5-obs-reversal", some).ours == "at 3 of 4 corners"
    assert judged("c5-obs-reversal", some).verdict == "differs"


def test_another_load_is_not_the_published_one():
    assert judged("c5-obs-reversal", framed(lambda c, f: (10.5 - f) / 50, load=0.04)).verdict == "not in this study"
