import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.experiments import StaticStiffness
from lab.fields import changed, shown
from lab.specimens import TwistedBeam
from pipeline.sweep import Range, points


def values(**fields):
    return Range.model_validate(fields).values()


def test_ranges_include_both_ends():
    assert values(**{"from": "-90 deg", "to": "90 deg", "step": "45 deg"}) == [
        "-90 deg",
        "-45 deg",
        "0 deg",
        "45 deg",
        "90 deg",
    ]
    assert values(**{"from": 1, "to": 3, "count": 3}) == [1, 2, 3]
    assert values(**{"from": "1 mm", "to": "0.2 cm", "step": "0.5 mm"}) == ["1 mm", "1.5 mm", "2 mm"]


@given(st.integers(2, 400), st.floats(0.001, 10))
def test_round_off_does_not_lose_the_last_value(count, step):
    found = values(**{"from": "0 deg", "to": f"{step * (count - 1)!r} deg", "step": f"{step!r} deg"})
    assert len(found) == count


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"from": "0 deg", "to": "9 deg"}, "needs 'step' or 'count'"),
        ({"from": "0 deg", "to": "9 deg", "step": "-1 deg"}, "never arrives"),
        ({"from": "0 deg", "to": "9 deg", "step": "0 deg"}, "never arrives"),
        ({"from": "0 deg", "to": "9 deg", "step": 1}, "carry a unit, or none does"),
        ({"from": "0 deg", "to": "9 kg", "step": "1 deg"}, "has the unit kilogram"),
        ({"from": "0 deg", "to": "9 deg", "step": "1e-9 deg"}, "at most"),
    ],
)
def test_wrong_ranges_are_refused(fields, words):
    with pytest.raises(ValueError, match=words):
        values(**fields)


def test_a_grid_is_the_product_and_grids_are_joined():
    found = list(points([{"a": [1, 2], "b": ["x", "y"]}, {"a": [3]}]))
    assert found == [{"a": 1, "b": "x"}, {"a": 1, "b": "y"}, {"a": 2, "b": "x"}, {"a": 2, "b": "y"}, {"a": 3}]
    assert list(points([])) == [{}]


def test_any_parameter_can_be_changed():
    beam = changed(TwistedBeam(), "material.youngs_modulus", "65 MPa")
    assert beam.material.youngs_modulus == pytest.approx(65e6)
    assert shown(beam, "material.youngs_modulus") == "65MPa"
    assert changed(beam, "twist", "-45 deg").twist == pytest.approx(-math.pi / 4)
    assert changed(StaticStiffness(), "rig_stiffness", "3 N/mm").rig_stiffness == pytest.approx(3000)


@pytest.mark.parametrize(
    ("path", "value", "words"),
    [
        ("twits", "1 deg", "TwistedBeam has no parameter 'twits'"),
        ("twist", 45, "45 has no unit"),
        ("thickness", "-1 mm", "thickness: Input should be greater than 0"),
        ("thickness.x", "1 mm", "'thickness' has no parameter"),
        ("material.youngs_modulus", "3 m", "has the unit meter"),
    ],
)
def test_wrong_changes_are_refused(path, value, words):
    with pytest.raises(ValueError, match=words):
        changed(TwistedBeam(), path, value)
