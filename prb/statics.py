"""Equilibrium of a mechanism in joint coordinates q, on MuJoCo's kinematics.

With the springs' torques t(q), the tip's Jacobians J_p and J_r (3, joints), and a force f and moment m
on the tip (m about its current centre, fixed axes), equilibrium is t(q) = J_p^T f + J_r^T m.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cache

import mujoco
import numpy as np
from numpy.typing import NDArray

from prb.laws import Laws
from prb.mujoco_model import TIP

Array = NDArray[np.float64]
_TOLERANCE, _ITERATIONS, _SMALLEST_STEP = 1e-11, 12, 1.0 / 1024
#: Largest joint motion that one load step may bring, rad (and in slides far above any stretch in m).
_LARGEST_TURN = 1.0


class NotConverged(RuntimeError):
    """No equilibrium was found; the message says at which share of the load."""


@dataclass(frozen=True)
class Tip:
    """Posture of a point that rides on a link: place (3,), m; rotation (3, 3); Jacobians (3, joints)."""

    position: Array
    rotation: Array
    jacp: Array
    jacr: Array

    @property
    def jacobian(self) -> Array:
        """Both Jacobians, (6, joints): three translations, then three rotations."""
        return np.vstack([self.jacp, self.jacr])

    def beside(self, arm: Array) -> "Tip":
        """Posture of the point that stands at ``arm`` (3,), m, from this one on the same link."""
        return replace(self, position=self.position + arm, jacp=self.jacp - _cross_matrix(arm) @ self.jacr)

    def geometric_stiffness(self, force: Array, moment: Array | None = None) -> Array:
        """Derivative of J_p^T f + J_r^T m by the joint coordinates, (joints, joints).

        Along a chain the column j of a Jacobian turns with every hinge i nearer the clamp:
        d J_p,j / d q_i = a_i x J_p,j and d J_r,j / d q_i = a_i x a_j for i < j.  In a tree the joints of other
        branches have empty columns.  The force's part is symmetric (a dead force has a potential), the moment's
        is not.
        """
        upper, above = _triangles(self.jacp.shape[1])
        near = (_cross_matrix(force) @ self.jacr).T @ self.jacp
        result = upper * near + (above * near).T
        if moment is not None:
            result += (above * ((_cross_matrix(moment) @ self.jacr).T @ self.jacr)).T
        return result


@dataclass(frozen=True)
class Load:
    """Dead loads on a mechanism.

    Parameters
    ----------
    force
        On the tip's link, (3,), N.
    place
        Where the force acts, from the tip's centre in the fixed axes with slack springs, (3,), m.
    gravity
        Acceleration that pulls at every link and at the tip's mass, (3,), m/s^2; None: left out.
    """

    force: Array
    place: Array | None = None
    gravity: Array | None = None

    @property
    def own_weight(self) -> "Load":
        """Gravity alone."""
        return Load(np.zeros(3), None, self.gravity)


@cache
def _triangles(n: int) -> tuple[Array, Array]:
    """Masks of the upper triangle with and without the diagonal; ``np.triu`` is slow on small matrices."""
    return np.triu(np.ones((n, n))), np.triu(np.ones((n, n)), 1)


def _cross_matrix(v: Array) -> Array:
    """Matrix of u -> v x u; then (v x a) . p = v . (a x p)."""
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


class Chain:
    """A compiled mechanism as seen by statics.

    Parameters
    ----------
    model
        From ``prb.mujoco_model``.
    data
        Scratch of the model; made when left out.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData | None = None) -> None:
        self.model, self.data, self.laws = model, mujoco.MjData(model) if data is None else data, Laws(model)
        self.site = model.site(TIP).id
        #: Posture with slack springs, (joints,), rad or m; and the tip there.
        self.slack: Array = self.laws.rest
        self.at_rest = self.tip(self.slack)
        self.length = float(np.linalg.norm(self.at_rest.position))

    def tip(self, joints: Array) -> Tip:
        """Posture of the tip at the joint coordinates (joints,), rad or m."""
        model, data, count = self.model, self.data, self.laws.count
        data.qpos[:count] = joints
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        jacobian = np.empty((2, 3, model.nv))
        mujoco.mj_jacSite(model, data, jacobian[0], jacobian[1], self.site)
        rotation = data.site_xmat[self.site].reshape(3, 3).copy()
        return Tip(data.site_xpos[self.site].copy(), rotation, *jacobian[..., :count])

    def sites(self, joints: Array) -> Array:
        """Places of the tip and of the markers, (1 + markers, 3), m."""
        self.tip(joints)
        return self.data.site_xpos.copy()

    def nodes(self, joints: Array) -> Array:
        """Proximal and far end of every link that is drawn, (2 links, 3), m."""
        self.tip(joints)
        bodies, data = self.model.geom_bodyid, self.data
        far = data.xpos[bodies] + 2.0 * self.model.geom_size[:, :1] * data.xmat[bodies][:, ::3]
        return np.stack([data.xpos[bodies], far], axis=1).reshape(-1, 3)

    def plates(self, joints: Array) -> Array:
        """Corners of the middle plane of every link that is drawn, in order around it, (4 links, 3), m."""
        self.tip(joints)
        data, half = self.data, self.model.geom_size
        axes = data.geom_xmat.reshape(-1, 3, 3)
        along, across = half[:, :1] * axes[:, :, 0], half[:, 1:2] * axes[:, :, 1]
        signs = ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))
        return np.stack([data.geom_xpos + a * along + b * across for a, b in signs], axis=1).reshape(-1, 3)

    def energy(self, joints: Array) -> float:
        """Elastic energy of the joints, J."""
        return self.laws.energy(joints)

    def balance(self, joints: Array, load: Load) -> tuple[Array, Array]:
        """Torque of loads less that of the springs (joints,), and minus its derivative (joints, joints)."""
        tip = self.tip(joints)
        if load.place is not None:
            tip = tip.beside(tip.rotation @ self.at_rest.rotation.T @ load.place)
        torque = tip.jacp.T @ load.force - self.laws.torque(joints)
        tangent = self.laws.tangent(joints) - tip.geometric_stiffness(load.force)
        if load.gravity is not None:
            for weight, link in self._weights(load.gravity):
                torque += link.jacp.T @ weight
                tangent -= link.geometric_stiffness(weight)
        return torque, tangent

    def _weights(self, gravity: Array) -> Iterator[tuple[Array, Tip]]:
        """Weight (N) and centre of every link at the posture set last."""
        model, data, count = self.model, self.data, self.laws.count
        for body in range(1, model.nbody - len(self.laws.relaxing)):
            jacobian = np.empty((2, 3, model.nv))
            mujoco.mj_jacBodyCom(model, data, jacobian[0], jacobian[1], body)
            yield model.body_mass[body] * gravity, Tip(data.xipos[body], np.eye(3), *jacobian[..., :count])

    def scale(self, load: Load) -> float:
        """Size of the torques of a load, N*m."""
        mass = 0.0 if load.gravity is None else float(self.model.body_mass.sum() * np.linalg.norm(load.gravity))
        return (float(np.linalg.norm(load.force)) + mass) * self.length


def is_sprung(chain: Chain) -> bool:
    """Whether every joint is held by a spring at rest."""
    return bool(np.linalg.eigvalsh(chain.laws.tangent(chain.slack))[0] > 0.0)


def tip_compliance(chain: Chain) -> tuple[Array, int]:
    """Compliance of the tip at rest and its rank.

    Returns
    -------
    compliance
        J K^-1 J^T, (6, 6): m/N, rad/N and rad/(N*m); translations before rotations.
    rank
        Number of independent motions that forces on the tip can cause, with rotations and
        translations made comparable by the length.
    """
    jacobian = chain.at_rest.jacobian
    scaled = np.concatenate([np.full(3, 1.0 / chain.length), np.ones(3)])[:, None] * jacobian
    compliance = jacobian @ np.linalg.solve(chain.laws.tangent(chain.slack), jacobian.T)
    return compliance, int(np.linalg.matrix_rank(scaled, rtol=1e-9))


def hang(chain: Chain, load: Load) -> Array:
    """Stable equilibrium under dead loads: own weight first, then the force on the tip.

    Newton's method along a growing load.  A load step is halved when it does not converge, moves a
    joint by more than a radian, or ends where the tangent is not positive definite, so that the
    result is the state that a slowly hung weight reaches.

    Returns
    -------
    joints
        (joints,), rad or m.

    Raises
    ------
    NotConverged
        Where the load path ends, as at a snap.
    """
    joints, gravity = chain.slack, load.gravity
    if gravity is not None:
        joints = _loaded(chain, joints, lambda share: Load(np.zeros(3), None, share * gravity), "own weight")
    if np.any(load.force):
        joints = _loaded(chain, joints, lambda share: replace(load, force=share * load.force), "the load")
    return joints


def _loaded(chain: Chain, joints: Array, load: Callable[[float], Load], name: str) -> Array:
    """Equilibrium under ``load(1)``, reached from that under ``load(0)``."""

    def balance(at: Array, share: float) -> tuple[Array, Array]:
        return chain.balance(at, load(share))

    return grown(balance, joints, lambda share: chain.scale(load(share)), name, "static start: ")


def grown(
    balance: Callable[[Array, float], tuple[Array, Array]], joints: Array, scale: Callable[[float], float], name: str,
    where: str = "",
) -> Array:  # fmt: skip
    """Stable equilibrium, reached as a load grows from nothing to the whole.

    Parameters
    ----------
    balance
        What is out of balance at joint coordinates and a share of the load (joints,), and its derivative with the
        opposite sign (joints, joints).
    joints
        Equilibrium without the load.
    scale
        Size of the moments at a share of the load, N*m.
    name, where
        Of the load, and what comes before, in messages.

    Raises
    ------
    NotConverged
        Where the load path ends, as at a snap.
    """
    done, step = 0.0, 1.0
    while done < 1.0:
        found = _newton(balance, joints, done + step, scale(done + step))
        if found is None:
            step /= 2.0
            if step < _SMALLEST_STEP:
                raise NotConverged(f"{where}no stable equilibrium beyond {100 * done:.1f} % of {name}")
            continue
        joints, done = found, done + step
        step = min(2.0 * step, 1.0 - done)
    return joints


def _newton(
    balance: Callable[[Array, float], tuple[Array, Array]], start: Array, share: float, scale: float
) -> Array | None:
    joints = start
    for _ in range(_ITERATIONS):
        residual, tangent = balance(joints, share)
        if np.abs(residual).max() <= _TOLERANCE * scale:
            return joints if np.linalg.eigvalsh((tangent + tangent.T) / 2)[0] > 0.0 else None
        try:
            joints = joints + np.linalg.solve(tangent, residual)
        except np.linalg.LinAlgError:
            return None
        if not np.abs(joints - start).max() < _LARGEST_TURN:
            return None
    return None


@dataclass(frozen=True)
class Held:
    """A held tip: joint coordinates (joints,), and force (N) and moment (N*m) on the tip, (6,)."""

    joints: Array
    wrench: Array


def hold(chain: Chain, motion: Array, start: Held | None = None, rig_compliance: float = 0.0) -> Held:
    """Equilibrium with the tip held at a pose, the wrench being the Lagrange multiplier.

    Parameters
    ----------
    motion
        Robot's translation (m) and rotation vector (rad) from rest, (6,).
    start
        Nearby equilibrium; the state at rest when left out.
    rig_compliance
        Of the springs between robot and tip along x, y and z, m/N.

    Raises
    ------
    NotConverged
        When Newton's method fails from ``start``; come closer in smaller motions.
    """
    n, laws = chain.laws.count, chain.laws
    joints, wrench = (chain.slack, np.zeros(6)) if start is None else (start.joints, start.wrench)
    target = chain.at_rest.position + motion[:3]
    aim = _rotation_matrix(motion[3:]) @ chain.at_rest.rotation
    stiffest = float(laws.tangent(chain.slack).max())
    matrix = np.zeros((n + 6, n + 6))
    matrix[n : n + 3, n : n + 3] = rig_compliance * np.eye(3)
    for _ in range(2 * _ITERATIONS):
        tip = chain.tip(joints)
        jacobian, turn = tip.jacobian, tip.rotation @ aim.T
        torque = laws.torque(joints)
        balance = jacobian.T @ wrench - torque
        off = target - rig_compliance * wrench[:3] - tip.position
        # Sine of the remaining turn: zero with it, and of the same slope.
        lag = 0.5 * np.array([turn[1, 2] - turn[2, 1], turn[2, 0] - turn[0, 2], turn[0, 1] - turn[1, 0]])
        scale = max(float(np.abs(torque).max()), 1e-9 * stiffest)
        gap = max(float(np.abs(off).max()) / chain.length, float(np.abs(lag).max()))
        if np.abs(balance).max() <= 10 * _TOLERANCE * scale and gap <= _TOLERANCE:
            return Held(joints, wrench)
        matrix[:n, :n] = laws.tangent(joints) - tip.geometric_stiffness(wrench[:3], wrench[3:])
        matrix[:n, n:], matrix[n:, :n] = -jacobian.T, jacobian
        step = np.linalg.solve(matrix, np.concatenate([balance, off, lag]))
        joints, wrench = joints + step[:n], wrench + step[n:]
        if not np.isfinite(joints).all():
            break
    raise NotConverged("clamped tip: Newton's method did not converge")


def move(chain: Chain, start: Held, begin: Array, end: Array, rig_compliance: float = 0.0) -> Held:
    """``hold`` at ``end``, reached from ``begin`` where ``start`` is the equilibrium, in as many moves as needed."""
    held, done, step = start, 0.0, 1.0
    while done < 1.0:
        try:
            held = hold(chain, begin + (done + step) * (end - begin), held, rig_compliance)
        except (NotConverged, np.linalg.LinAlgError):
            step /= 2.0
            if step < _SMALLEST_STEP:
                raise NotConverged(f"clamped tip: no equilibrium beyond {100 * done:.1f} % of an increment") from None
            continue
        done += step
        step = min(2.0 * step, 1.0 - done)
    return held


def _rotation_matrix(vector: Array) -> Array:
    """Rodrigues' formula, (3, 3)."""
    angle = float(np.linalg.norm(vector))
    cross = _cross_matrix(vector)
    first = np.sinc(angle / np.pi)
    second = 0.5 * np.sinc(angle / (2.0 * np.pi)) ** 2
    return np.eye(3) + first * cross + second * cross @ cross
