"""Equilibria of a tube's two halves under a force on the distal block."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lab.specimens import Specimen
from prb.model import PrbModel
from prb.mujoco_model import compile_mechanism
from prb.statics import Chain, Load, NotConverged, hang

Array = NDArray[np.float64]
_TOLERANCE, _ITERATIONS, _CUTS = 1e-10, 20, 8


@dataclass(frozen=True)
class Bent:
    """Joint coordinates (joints,), rad or m, and the force that holds them, N, along the direction of the load."""

    joints: Array
    load: float


@dataclass(frozen=True)
class Point:
    """A point of the distal block's middle line and the direction of the force on it.

    Parameters
    ----------
    beyond
        Its place from the block's face along the tube, m.
    direction
        Unit vector (3,), fixed in space.
    """

    beyond: float
    direction: Array

    def load(self, force: float) -> Load:
        """Dead load of a force (N)."""
        return Load(force * self.direction, np.array([0.0, 0.0, self.beyond]))

    def motion(self, chain: Chain, joints: Array) -> float:
        """Along the direction from where the straight tube has it, m."""
        return float(self.direction @ (self._place(chain, joints)[0] - self._place(chain, chain.slack)[0]))

    def slope(self, chain: Chain, joints: Array) -> Array:
        """Derivative of ``motion`` by the joint coordinates, (joints,)."""
        return np.asarray(self.direction @ self._place(chain, joints)[1])

    def _place(self, chain: Chain, joints: Array) -> tuple[Array, Array]:
        tip = chain.tip(joints)
        found = tip.beside(tip.rotation @ chain.at_rest.rotation.T @ np.array([0.0, 0.0, self.beyond]))
        return found.position, found.jacp


def chain_of(model: PrbModel, specimen: Specimen) -> Chain:
    """Compiled mechanism of a model's parameters."""
    return Chain(compile_mechanism(model.mechanism(specimen)))


def bear(chain: Chain, point: Point, force: float) -> Bent:
    """Under a dead force (N); NotConverged where nothing stable bears it."""
    if force == 0.0 and np.linalg.eigvalsh(chain.laws.tangent(chain.slack))[0] <= 0.0:
        raise NotConverged("no stable equilibrium: the hinge has no positive stiffness")
    return Bent(hang(chain, point.load(force)), force)


def push(chain: Chain, point: Point, motions: Sequence[float], rig_compliance: float = 0.0) -> list[Bent]:
    """Along the motions (m) of a pusher, with a spring (m/N) between it and the point.

    Raises
    ------
    NotConverged
        Where Newton's method fails however small the motion.
    """
    found, here, now = [], Bent(chain.slack, 0.0), 0.0
    for end in motions:
        done, step = 0.0, 1.0
        while done < 1.0:
            to = now + (done + step) * (end - now)
            reached = _pushed(chain, point, here, to, rig_compliance)
            if reached is None:
                step /= 2.0
                if step < 0.5**_CUTS:
                    raise NotConverged(f"no equilibrium of the pushed block near {1e3 * to:.3g} mm")
                continue
            here, done = reached, done + step
            step = min(2.0 * step, 1.0 - done)
        found.append(here)
        now = end
    return found


def _pushed(chain: Chain, point: Point, start: Bent, motion: float, rig_compliance: float) -> Bent | None:
    joints, force, n = start.joints, start.load, chain.laws.count
    matrix = np.zeros((n + 1, n + 1))
    stiffness = float(np.abs(chain.laws.tangent(chain.slack)).max())
    for _ in range(_ITERATIONS):
        residual, tangent = chain.balance(joints, point.load(force))
        slope = point.slope(chain, joints)
        off = motion - rig_compliance * force - point.motion(chain, joints)
        if np.abs(residual).max() <= _TOLERANCE * stiffness and abs(off) <= _TOLERANCE * chain.length:
            return Bent(joints, force)
        matrix[:n, :n], matrix[:n, n], matrix[n, :n], matrix[n, n] = tangent, -slope, slope, rig_compliance
        try:
            step = np.linalg.solve(matrix, np.append(residual, off))
        except np.linalg.LinAlgError:
            return None
        if not np.abs(step[:n]).max() < 1.0:
            return None
        joints, force = joints + step[:n], force + float(step[n])
    return None


def flexibility(chain: Chain, bent: Bent, point: Point | None) -> tuple[Array, int]:
    """Change of the distal face's pose by a small wrench (6, 6), and the negative eigenvalues of the tangent.

    Rows and columns of what no joint moves are NaN: rigid halves know nothing of it.
    """
    load = Load(np.zeros(3)) if point is None else point.load(bent.load)
    tangent = chain.balance(bent.joints, load)[1]
    tangent = (tangent + tangent.T) / 2
    jacobian = chain.tip(bent.joints).jacobian
    negative = int((np.linalg.eigvalsh(tangent) < 0).sum())
    found = jacobian @ np.linalg.solve(tangent, jacobian.T)
    fixed = np.abs(jacobian).max(axis=1) < 1e-9 * np.abs(jacobian).max()
    found[fixed, :], found[:, fixed] = np.nan, np.nan
    return found, negative


def pose(chain: Chain, joints: Array, length: float) -> Array:
    """Motion of the distal face from the open tube of a length (m): m, and rotation vector, rad (6,)."""
    from scipy.spatial.transform import Rotation

    tip = chain.tip(joints)
    turn = Rotation.from_matrix(tip.rotation @ chain.at_rest.rotation.T).as_rotvec()
    return np.concatenate([tip.position - np.array([0.0, 0.0, length]), turn])
