"""Mass and inertia of a link with what it carries."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from prb.mechanism import Mechanism, Vector
from prb.rotations import matrix_about_x, rest_rotation, turn_about_x

Array = NDArray[np.float64]


def inertial(mechanism: Mechanism, number: int) -> tuple[float, Vector, Any, Any]:
    """Mass (kg), its centre in the link's frame (m), moments of inertia there (kg*m^2), and their axes."""
    link = mechanism.links[number]
    x2, y2, z2 = (side**2 * link.mass / 12.0 for side in (link.length, link.width, link.thickness))
    moments, middle = (y2 + z2, x2 + z2, x2 + y2), (link.length / 2.0, 0.0, 0.0)
    if number != mechanism.tip[0] or not (mechanism.tip_mass or mechanism.ballast):
        return link.mass, middle, moments, turn_about_x(link.angle)
    return _together([_Part(link.mass, np.array(middle), _turned(moments, link.angle)), *_carried(mechanism)])


@dataclass(frozen=True)
class _Part:
    """Mass (kg), its centre in a link's frame (3,), m, and inertia about it along the frame's axes (3, 3), kg*m^2."""

    mass: float
    centre: Array
    inertia: Array


def _carried(mechanism: Mechanism) -> Iterator[_Part]:
    """The tip's mass, a thin plate, and the ballast, in the frame of the tip's link."""
    number, tip = mechanism.tip
    if mechanism.tip_mass:
        width, thickness, angle = mechanism.tip_face
        plate = np.array([width**2 + thickness**2, thickness**2, width**2]) * mechanism.tip_mass / 12.0
        yield _Part(mechanism.tip_mass, np.array(tip), _turned(plate, angle))
    if ballast := mechanism.ballast:
        turn = rest_rotation(mechanism, number)
        axes = np.eye(3) if turn is None else turn
        yield _Part(ballast.mass, tip + ballast.centre @ axes, axes.T @ np.array(ballast.inertia) @ axes)


def _together(parts: Sequence[_Part]) -> tuple[float, Vector, Array, Array]:
    """``inertial`` of parts that move as one."""
    mass = sum(part.mass for part in parts)
    centre = sum((part.mass * part.centre for part in parts), np.zeros(3)) / mass
    total = np.zeros((3, 3))
    for part in parts:
        arm = part.centre - centre
        total += part.inertia + part.mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    principal, axes = np.linalg.eigh(total)
    axes[:, 2] *= np.sign(np.linalg.det(axes))
    quaternion = np.empty(4)
    mujoco.mju_mat2Quat(quaternion, axes.ravel())
    return mass, tuple(centre.tolist()), principal, quaternion


def _turned(moments: Sequence[float] | Array, angle: float) -> Array:
    """Inertia (3, 3) with the principal ``moments`` (3,), kg*m^2, turned by ``angle`` (rad) about x."""
    turn = matrix_about_x(angle)
    turned: Array = turn @ np.diag(moments) @ turn.T
    return turned
