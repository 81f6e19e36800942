"""Measures of closed paths and of sweeps of them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.orbits import LINE, Ellipse, ellipse, harmonics, ranges, reversals, sense, signed_area

TURN = np.linspace(0.0, 2 * np.pi, 65)


def path_of(*amplitudes: complex) -> np.ndarray:
    """Path with complex amplitudes (y, z) of its harmonics in turn."""
    pairs = np.reshape(amplitudes, (-1, 2))
    return sum((np.outer(np.exp(1j * n * TURN), pair).real for n, pair in enumerate(pairs, 1)), np.zeros((65, 2)))


@given(st.floats(0.5, 2.0), st.floats(-0.9, 0.9), st.floats(-1.5, 1.5), st.floats(-3.0, 3.0))
def test_an_ellipse_is_found_whatever_its_phase(major, ratio, tilt, phase):
    points = Ellipse(major, ratio * major, tilt, 0.0).points(65)[:-1]
    shifted = np.roll(points, round(phase * 10), axis=0)
    found = ellipse(np.vstack([shifted, shifted[:1]]))
    assert (found.major, found.minor) == pytest.approx((major, ratio * major), abs=1e-12)
    assert found.tilt == pytest.approx(tilt, abs=1e-9)
    assert found.residual == pytest.approx(0.0, abs=1e-12)


def test_least_squares_ellipse_is_that_of_a_conic_for_a_nearly_elliptic_path():
    """Against an algebraic fit of a conic, a method that knows nothing of phases."""
    path = path_of(3.0, 1.0 - 1.5j, 0.005, 0.003j)
    y, z = path[:-1].T
    conic = np.linalg.lstsq(np.column_stack([y * y, y * z, z * z]), np.ones(64), rcond=None)[0]
    values, vectors = np.linalg.eigh([[conic[0], conic[1] / 2], [conic[1] / 2, conic[2]]])
    found = ellipse(path)
    assert found.major == pytest.approx(2 / np.sqrt(values[0]), rel=5e-3)
    assert abs(found.minor) == pytest.approx(2 / np.sqrt(values[1]), rel=5e-3)
    assert np.tan(found.tilt) == pytest.approx(vectors[1, 0] / vectors[0, 0], rel=2e-2)


def test_area_and_sense_follow_the_travel():
    circle = path_of(1.0, -1j)  # y = cos, z = sin: from +y to +z
    # The polygon of 64 sides falls short of the circle by 0.16 %.
    assert signed_area(circle) == pytest.approx(np.pi, rel=2e-3)
    assert signed_area(circle[::-1]) == pytest.approx(-np.pi, rel=2e-3)
    assert ellipse(circle).ratio == pytest.approx(1.0)
    assert ellipse(circle[::-1]).ratio == pytest.approx(-1.0)
    assert (sense(0.2), sense(-0.2), sense(LINE / 2)) == (1, -1, 0)


def test_a_figure_of_eight_encloses_nothing_and_shows_as_second_harmonic():
    eight = path_of(0.0, -1j, -0.5j, 0.0)  # z = sin, y = sin 2 / 2
    assert signed_area(eight) == pytest.approx(0.0, abs=1e-12)
    assert np.abs(harmonics(eight, 3)) == pytest.approx(np.array([[0, 1], [0.5, 0], [0, 0]]), abs=1e-12)
    assert ellipse(eight).ratio == pytest.approx(0.0, abs=1e-12)
    assert ellipse(eight).residual == pytest.approx(0.5 / np.sqrt(2.0))


def test_reversals_stand_where_the_ratio_passes_zero():
    frequency = np.arange(1.0, 8.0)
    found = reversals(frequency, np.array([0.1, 0.3, -0.1, -0.2, np.nan, 0.2, 0.1]))
    assert [(r.at, r.after) for r in found] == [(pytest.approx(2.75), -1), (pytest.approx(5.0), 1)]


def test_a_line_between_two_senses_is_one_reversal_and_one_within_a_sense_is_none():
    values = np.arange(5.0)
    tiny = LINE / 4
    assert reversals(values, np.array([0.2, tiny, -tiny, tiny, 0.1])) == []
    [found] = reversals(values, np.array([0.2, tiny, -tiny, tiny, -0.1]))
    assert (found.at, found.after) == (pytest.approx(1.5), -1)
    [through] = reversals(values, np.array([0.2, 0.1, 0.0, -0.1, -0.2]))
    assert through.at == pytest.approx(2.0)


def test_ranges_of_neighbours():
    values = np.array([1.0, 2.0, 3.0, 5.0, 7.0])
    assert ranges(values, [True, True, False, True, False]) == [(1.0, 2.0), (5.0, 5.0)]
    assert ranges(values, [False] * 5) == []
    assert ranges(values, [True] * 5) == [(1.0, 7.0)]
