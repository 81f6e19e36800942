"""Rest of an arm under gravity and a cable of given tension."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import mujoco
import numpy as np
from numpy.typing import NDArray

from prb.mechanism import Vector
from prb.statics import Chain, Load, grown

Array = NDArray[np.float64]
_DIFFERENCE = 1e-6


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
    """Stable equilibrium, reached as gravity and tension grow together; errors as ``prb.statics.grown``."""
    gravity = load.gravity
    assert gravity is not None

    def balance(joints: Array, share: float) -> tuple[Array, Array]:
        residual, tangent = chain.balance(joints, replace(load, gravity=share * gravity))
        if pull is None:
            return residual, tangent
        return residual + share * pull(joints), tangent - share * pull.slope(joints)

    scale = max(chain.scale(load), 0.0 if pull is None else pull.tension * chain.length)
    return grown(balance, chain.slack, lambda share: scale, "gravity and tension", "arm: ")
