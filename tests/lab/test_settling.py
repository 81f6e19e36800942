"""Limits of slow sequences: linear ones exactly, nonlinear ones nearly."""

import numpy as np
import pytest

from lab.settling import limit


def test_a_linear_sequence_is_taken_to_its_limit():
    # Three pairs that swing and shrink slowly, and parts that are gone at once.
    random = np.random.default_rng(2)
    shrink, turn = np.array([0.99, 0.95, 0.9]), np.array([0.3, 1.1, 2.0])
    matrix, fixed, basis = np.zeros((10, 10)), random.normal(size=10), random.normal(size=(10, 10))
    for k, (q, a) in enumerate(zip(shrink, turn, strict=True)):
        matrix[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] = q * np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]])
    matrix = basis @ matrix @ np.linalg.inv(basis)
    terms = [fixed + basis @ np.repeat([1.0, 0.0], [6, 4])]
    for _ in range(7):
        terms.append(fixed + matrix @ (terms[-1] - fixed))
    assert limit(np.array(terms), random.uniform(0.5, 2.0, size=10)) == pytest.approx(fixed, abs=1e-8)
    assert np.linalg.norm(terms[-1] - fixed) > 1


def test_a_sequence_that_has_arrived_stays():
    assert limit(np.ones((5, 3)), np.ones(3)) == pytest.approx(np.ones(3))


def test_a_nonlinear_sequence_comes_closer():
    def following(x: float, y: float) -> np.ndarray:
        return np.array([0.98 * x + 0.1 * y + 0.3 * x**2, 0.95 * y - 0.1 * x + 0.2 * x * y])

    terms = [np.array([0.01, 0.02])]
    for _ in range(3):
        terms.append(following(*terms[-1]))
    # It tends to zero.
    assert np.linalg.norm(limit(np.array(terms), np.ones(2))) < 0.1 * np.linalg.norm(terms[-1])
