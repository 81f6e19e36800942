"""Coordinates of a search and the unit cube."""

import numpy as np
import pytest

from calibrate.space import Coordinate, Space, common

LENGTH = Coordinate("l2", "m", "mm", 0.02, 0.001, 0.049)
SHIFT = Coordinate("shift", "s", "ms", 0.0, -0.01, 0.01)
SPACE = Space((LENGTH, SHIFT))


def test_wide_ranges_are_logarithmic():
    assert SPACE.logarithmic.tolist() == [True, False]
    assert SPACE.values(np.array([0.5, 0.5])) == pytest.approx([np.sqrt(0.001 * 0.049), 0.0])


def test_places_and_values_are_inverse():
    unit = np.random.default_rng(0).random((50, 2))
    assert SPACE.place(SPACE.values(unit)) == pytest.approx(unit, abs=1e-12)


def test_bounds_are_met_exactly():
    assert SPACE.values(np.array([[0.0, 0.0], [1.0, 1.0]])).tolist() == [[0.001, -0.01], [0.049, 0.01]]


def test_the_slope_is_the_derivative():
    unit, step = np.array([0.3, 0.7]), 1e-6
    differences = [(SPACE.values(unit + e) - SPACE.values(unit - e)) / (2 * step) for e in step * np.eye(2)]
    assert SPACE.slope(unit) == pytest.approx(np.diag(differences), rel=1e-8)


def test_relative_changes_refer_to_the_range_where_zero_is_inside():
    assert SPACE.sizes(np.array([0.0, 0.5])) == pytest.approx([0.001, 0.02])


@pytest.mark.parametrize(
    ("bounds", "message"),
    [
        (("30 mm", "20 mm"), "bounds of l2: 30 mm is not below 20 mm"),
        (("30 N", "40 mm"), "bounds of l2: '30 N' has the unit newton; expected one like m"),
        (("0.1 mm", "40 mm"), "bounds of l2: 0.1 mm is out of bounds; allowed: 1 mm to 49 mm"),
    ],
)
def test_wrong_bounds_are_refused_in_one_line(bounds, message):
    with pytest.raises(ValueError, match="^" + message.replace("'", ".") + "$"):
        LENGTH.within(bounds)


def test_narrower_bounds_bring_the_nominal_value_inside():
    found = LENGTH.within(("30 mm", 0.04))
    assert (found.lower, found.nominal, found.upper) == (0.03, 0.03, 0.04)


def test_specimens_share_what_all_of_them_allow():
    other = Coordinate("l2", "m", "mm", 0.03, 0.01, 0.08)
    found = common([LENGTH, other])
    assert (found.lower, found.upper) == (0.01, 0.049)
    with pytest.raises(ValueError, match="no range of l2 in common"):
        common([LENGTH, Coordinate("l2", "m", "mm", 0.1, 0.09, 0.2)])
