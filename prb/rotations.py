"""Rotations of the links of a mechanism, as vectors, quaternions and matrices."""

from collections.abc import Sequence

import mujoco
import numpy as np
from numpy.typing import NDArray

from prb.mechanism import CLAMP, Mechanism

Array = NDArray[np.float64]


def rest_rotation(mechanism: Mechanism, number: int) -> Array | None:
    """Rotation of a link's frame with slack springs, (3, 3); None: none."""
    turn = None
    while number != CLAMP:
        link = mechanism.links[number]
        steps = [link.rotation, *(tuple(h.rest * a for a in h.axis) for h in link.hinges if h.kind == "rotation")]
        for step in reversed(steps):
            if any(step):
                matrix = np.empty(9)
                mujoco.mju_quat2Mat(matrix, quaternion(step))
                turn = matrix.reshape(3, 3) @ (np.eye(3) if turn is None else turn)
        number = mechanism.parent(number)
    return turn


def quaternion(rotation: Sequence[float]) -> Array:
    """Quaternion of a rotation vector (rad), (4,)."""
    if not any(rotation):
        return np.array([1.0, 0.0, 0.0, 0.0])
    angle = float(np.linalg.norm(rotation))
    return np.concatenate([[np.cos(angle / 2.0)], np.sin(angle / 2.0) / angle * np.array(rotation)])


def turn_about_x(angle: float) -> list[float]:
    """Quaternion of a turn by ``angle`` (rad) about x, (4,)."""
    return [float(np.cos(angle / 2.0)), float(np.sin(angle / 2.0)), 0.0, 0.0]


def matrix_about_x(angle: float) -> Array:
    """Matrix of a turn by ``angle`` (rad) about x, (3, 3)."""
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.array([[1.0, 0.0, 0.0], [0.0, cosine, -sine], [0.0, sine, cosine]])
