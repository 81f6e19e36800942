"""Rotations, and the mean rigid motion of a face."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fea.rigid_part import mean_rigid_motion
from fea.rotations import rotation, rotation_derivatives

VECTORS = [np.zeros(3), np.array([1e-4, 2e-4, -1e-4]), np.array([7e-3, -7.1e-3, 1e-3]), np.array([0.3, -1.0, 2.0])]


@pytest.mark.parametrize("theta", VECTORS)
def test_rotation_and_derivatives(theta):
    r, first, second = rotation_derivatives(theta)
    np.testing.assert_allclose(r, Rotation.from_rotvec(theta).as_matrix(), atol=1e-14)
    for j, step in enumerate(1e-6 * np.eye(3)):
        np.testing.assert_allclose(first[j], (rotation(theta + step) - rotation(theta - step)) / 2e-6, atol=1e-9)
        slope = (rotation_derivatives(theta + step)[1] - rotation_derivatives(theta - step)[1]) / 2e-6
        np.testing.assert_allclose(second[j], slope, atol=1e-9)


def test_mean_rigid_motion_finds_the_motion_of_a_plane():
    rng = np.random.default_rng(4)
    arms, weights = rng.standard_normal((9, 3)) * [0, 1, 1], rng.uniform(0.5, 1, 9)
    arms -= weights @ arms / weights.sum()
    turn, shift = rotation(np.array([0.3, 1.5, -0.8])), np.array([1.0, 2.0, 3.0])
    found, found_turn = mean_rigid_motion(arms, weights, shift + arms @ (turn - np.eye(3)).T)
    np.testing.assert_allclose(found, shift, atol=1e-13)
    np.testing.assert_allclose(found_turn, turn, atol=1e-13)
