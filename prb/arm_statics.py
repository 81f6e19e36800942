"""Rest of an arm under gravity and a cable of given tension."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import mujoco
import numpy as np
from numpy.typing import NDArray

from prb.mechanism import Vector
from prb.statics import Chain, Load, NotConverged

Array = NDArray[np.float64]
_TOLERANCE, _ITERATIONS, _SMALLEST, _DIFFERENCE = 1e-10, 25, 1.0 / 256, 1e-6


@dataclass(frozen=True)
class Cable:
    """Cable through a hole in every block, from the clamp to the tip, and its tension.

    Parameters
    ----------
    radius, angle
        Of the holes from the middle line, m, and from +x about +z, rad.
    tension
        N.
    """

    radius: float
    angle: float
    tension: float


class Pull:
    """Generalised force of a cable: tension times what its length loses."""

    def __init__(self, chain: Chain, cable: Cable, holes: Sequence[tuple[int, Vector]]) -> None:
        self.chain, self.tension, self.holes = chain, cable.tension, holes

    def __call__(self, joints: Array) -> Array:
        """Torques at joint coordinates (joints,), N*m or N."""
        self.chain.tip(joints)
        model, data = self.chain.model, self.chain.data
        places, slopes = [], np.zeros((len(self.holes), 3, model.nv))
        for slope, (link, hole) in zip(slopes, self.holes, strict=True):
            body = link + 1
            places.append(data.xpos[body] + data.xmat[body].reshape(3, 3) @ hole)
            mujoco.mj_jac(model, data, slope, None, places[-1], body)
        lines = np.diff(places, axis=0)
        lines /= np.linalg.norm(lines, axis=1, keepdims=True)
        return np.asarray(-self.tension * np.einsum("hi,hij->j", lines, np.diff(slopes, axis=0)))

    def slope(self, joints: Array) -> Array:
        """Derivative by the joint coordinates, by central differences, symmetric (joints, joints)."""
        steps = _DIFFERENCE * np.eye(len(joints))
        found = np.array([(self(joints + step) - self(joints - step)) / (2 * _DIFFERENCE) for step in steps])
        return (found + found.T) / 2


def settled(chain: Chain, load: Load, pull: Pull | None) -> Array:
    """Stable equilibrium, reached as gravity and tension grow together."""
    joints, done, step = chain.slack, 0.0, 1.0
    while done < 1.0:
        found = _newton(chain, joints, load, pull, done + step)
        if found is None:
            step /= 2.0
            if step < _SMALLEST:
                raise NotConverged(f"no stable equilibrium of the arm beyond {100 * done:.1f} % of gravity and tension")
            continue
        joints, done = found, done + step
        step = min(2.0 * step, 1.0 - done)
    return joints


def _newton(chain: Chain, start: Array, load: Load, pull: Pull | None, share: float) -> Array | None:
    joints = start
    assert load.gravity is not None
    part = replace(load, gravity=share * load.gravity)
    scale = max(chain.scale(load), 0.0 if pull is None else pull.tension * chain.length)
    for _ in range(_ITERATIONS):
        residual, tangent = chain.balance(joints, part)
        if pull is not None:
            residual, tangent = residual + share * pull(joints), tangent - share * pull.slope(joints)
        if np.abs(residual).max() <= _TOLERANCE * scale:
            return joints if np.linalg.eigvalsh((tangent + tangent.T) / 2)[0] > 0.0 else None
        try:
            joints = joints + np.linalg.solve(tangent, residual)
        except np.linalg.LinAlgError:
            return None
        if not np.abs(joints - start).max() < 1.0:
            return None
    return None
