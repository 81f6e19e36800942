"""What springs and dampers do, read from a compiled model: one source for statics and for the simulator."""

import mujoco
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Laws:
    """Springs of the joints of a model that ``prb.mujoco_model`` made.

    The simulator knows linear and polynomial springs.  A knee is a tendon on one joint that is slack on one side
    and changes the slope on the other, a tie one on several joints; a Maxwell branch is a tendon between a joint and
    a light hidden one, whose damper makes it relax.  Hidden joints and their tendons come after all others.

    Parameters
    ----------
    model
        Compiled; its numbers are copied.

    Attributes
    ----------
    count
        Number of joints without the hidden ones.
    rest
        Coordinates of slack springs, (count,), rad or m.
    relaxing
        Joint that each hidden one follows, (hidden,).
    """

    def __init__(self, model: mujoco.MjModel) -> None:
        # Every link is drawn; the flywheels of hidden joints are not.
        hidden = int((model.body_geomnum[1:] == 0).sum())
        self.count = model.nq - hidden
        self.stiffness: Array = model.jnt_stiffness[: self.count].copy()
        self.rest: Array = model.qpos_spring[: self.count].copy()
        self.higher: Array = model.jnt_stiffnesspoly[: self.count].copy()
        self._polynomial = bool(self.higher.any())
        ties = model.ntendon - hidden
        shares = _shares(model)
        self._shares: Array = shares[:ties, : self.count]
        self._slack: Array = model.tendon_lengthspring[:ties].copy()
        self._tied: Array = np.column_stack([model.tendon_stiffness, model.tendon_stiffnesspoly])[:ties]
        self.relaxing = shares[ties:, : self.count].argmax(axis=1) if hidden else np.zeros(0, np.int64)
        self._branches: Array = model.tendon_stiffness[ties:].copy()

    def torque(self, joints: Array) -> Array:
        """Resistance of the relaxed springs at coordinates (count,); N*m or N."""
        x = joints - self.rest
        torque = self.stiffness * x
        if self._polynomial:
            torque += self.higher[:, 0] * x**2 + self.higher[:, 1] * x**3
        if len(self._tied):
            length, (k, k2, k3) = self._beyond(joints), self._tied.T
            torque += self._shares.T @ (length * (k + length * (k2 + length * k3)))
        return torque

    def tangent(self, joints: Array) -> Array:
        """Derivative of ``torque``, (count, count)."""
        x = joints - self.rest
        slope = self.stiffness
        if self._polynomial:
            slope = slope + 2.0 * self.higher[:, 0] * x + 3.0 * self.higher[:, 1] * x**2
        tangent = np.diag(slope)
        if len(self._tied):
            length, (k, k2, k3) = self._beyond(joints), self._tied.T
            taut = (length != 0.0) | (self._slack[:, 0] == self._slack[:, 1])
            slopes = taut * (k + length * (2.0 * k2 + 3.0 * length * k3))
            tangent += (self._shares.T * slopes) @ self._shares
        return tangent

    def energy(self, joints: Array) -> float:
        """Energy of the relaxed springs, J."""
        x, length, (k, k2, k3) = joints - self.rest, self._beyond(joints), self._tied.T
        energy = x**2 * (self.stiffness / 2.0 + self.higher[:, 0] * x / 3.0 + self.higher[:, 1] * x**2 / 4.0)
        tied = length**2 * (k / 2.0 + length * (k2 / 3.0 + length * k3 / 4.0))
        return float(energy.sum() + tied.sum())

    def _beyond(self, joints: Array) -> Array:
        """How far the length of every tendon is out of its slack range, with its sign, (tendons,)."""
        length = self._shares @ joints
        return length - np.clip(length, self._slack[:, 0], self._slack[:, 1])

    def with_hidden(self, joints: Array) -> Array:
        """Coordinates of all joints with relaxed branches, from those of the visible ones, (..., joints)."""
        return np.concatenate([joints, joints[..., self.relaxing]], axis=-1) if len(self.relaxing) else joints

    def stiffness_matrices(self, joints: Array) -> list[Array]:
        """Tangents with slack springs, at a posture and at its mirror image, hidden joints included."""
        nonlinear = self._polynomial or len(self._tied)
        return [
            self._with_branches(self.tangent(self.rest + share * (joints - self.rest)))
            for share in ((0.0, 1.0, -1.0) if nonlinear else (0.0,))
        ]

    def _with_branches(self, tangent: Array) -> Array:
        hidden = len(self.relaxing)
        matrix = np.zeros((self.count + hidden, self.count + hidden))
        matrix[: self.count, : self.count] = tangent
        for place, (joint, stiffness) in enumerate(zip(self.relaxing, self._branches, strict=True), self.count):
            matrix[[joint, place], [joint, place]] += stiffness
            matrix[[joint, place], [place, joint]] -= stiffness
        return matrix


def _shares(model: mujoco.MjModel) -> Array:
    """Share of every joint in every tendon, (tendons, joints)."""
    shares = np.zeros((model.ntendon, model.njnt))
    rows = np.repeat(np.arange(model.ntendon), model.tendon_num)
    shares[rows, model.wrap_objid] = model.wrap_prm
    return shares
