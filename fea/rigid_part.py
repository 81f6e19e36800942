"""A rigid part: nodes that ride on a frame of six numbers, at any rotation."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from fea.rotations import rotation, rotation_derivatives

Array = NDArray[np.float64]

#: Beyond this rotation, rad, the frame starts anew from where it is: at 2 pi the rotation vector is singular.
REBASE_AT = 2.0


@dataclass
class RigidPart:
    """Nodes carried by a pose q = (d, theta): x = d + (R(theta) R0 - I) arm.

    Parameters
    ----------
    nodes
        Carried nodes (n,); the first is the reference point itself.
    arms
        Their reference positions from the reference point (n, 3), m.
    base
        R0, the rotation that theta starts from (3, 3).
    """

    nodes: NDArray[np.int64]
    arms: Array
    base: Array = field(default_factory=lambda: np.eye(3))

    def displacement(self, pose: Array) -> Array:
        """Displacements of the nodes (n, 3), m, at the pose (6,), m and rad."""
        return pose[:3] + self.arms @ (rotation(pose[3:]) @ self.base - np.eye(3)).T

    def turn(self, pose: Array) -> Array:
        """Rotation matrix (3, 3) from rest."""
        return rotation(pose[3:]) @ self.base

    def jacobian(self, pose: Array) -> Array:
        """d displacement / d pose, (n, 3, 6)."""
        first = rotation_derivatives(pose[3:])[1]
        result = np.empty((len(self.nodes), 3, 6))
        result[:, :, :3] = np.eye(3)
        result[:, :, 3:] = np.einsum("jkl,nl->nkj", first, self.arms @ self.base.T)
        return result

    def geometric(self, pose: Array, forces: Array) -> Array:
        """Change of J'f with the pose at constant nodal forces f (n, 3), N; (6, 6)."""
        second = rotation_derivatives(pose[3:])[2]
        result = np.zeros((6, 6))
        result[3:, 3:] = np.einsum("ijkl,nl,nk->ij", second, self.arms @ self.base.T, forces)
        return result

    def moment(self, pose: Array, moment: Array, follows: bool) -> tuple[Array, Array]:
        """Generalised force (3,) on theta of a moment (3,), N m, and its derivative (3, 3).

        With dR R' = skew(W d theta) the work is moment . W d theta.  A moment about axes at rest has a
        potential only where the axis of rotation stays, so the derivative is not symmetric.
        """
        pull = self.spin(pose[3:]).T @ self._now(pose, moment, follows)
        slope, step = np.empty((3, 3)), 1e-6
        for k in range(3):
            ends = []
            for sense in (step, -step):
                near = pose.copy()
                near[3 + k] += sense
                ends.append(self.spin(near[3:]).T @ self._now(near, moment, follows))
            slope[:, k] = (ends[0] - ends[1]) / (2 * step)
        return pull, slope

    def _now(self, pose: Array, moment: Array, follows: bool) -> Array:
        return self.turn(pose) @ moment if follows else moment

    @staticmethod
    def spin(theta: Array) -> Array:
        """W with dR R' = skew(W d theta), (3, 3)."""
        turned, first, _ = rotation_derivatives(theta)
        spins = first @ turned.T
        return np.stack([spins[:, 2, 1], spins[:, 0, 2], spins[:, 1, 0]])

    def wrench(self, pose: Array, forces: Array) -> Array:
        """Resultant force, N, and moment about the moved reference point, N m, of nodal forces (n, 3); (6,)."""
        arms = self.arms @ self.turn(pose).T
        return np.concatenate([forces.sum(axis=0), np.cross(arms, forces).sum(axis=0)])


def mass_points(mass: float, inertia: Array) -> tuple[Array, Array]:
    """Point masses that move like a rigid part.

    Parameters
    ----------
    mass
        kg.
    inertia
        About the centre of mass (3, 3), kg m^2.

    Returns
    -------
    arms, masses
        (6, 3), m, from the centre of mass, and (6,), kg.  Their translation and rotation have the
        part's mass and inertia, so that the equations of motion need no others.
    """
    principal, axes = np.linalg.eigh(np.asarray(inertia, dtype=float))
    spread = (principal.sum() / 2 - principal) * 3 / mass
    if mass <= 0 or (spread < -1e-9 * max(principal.max(), 0.0) / mass).any() or principal.min() < 0:
        raise ValueError(
            f"no rigid part has the mass {mass:g} kg and the principal inertias {principal} kg m^2: each inertia must "
            "be positive and at most the sum of the other two"
        )
    arms = (np.sqrt(np.maximum(spread, 0.0)) * axes).T
    return np.concatenate([arms, -arms]), np.full(6, mass / 6)


def mean_rigid_motion(arms: Array, weights: Array, displacement: Array) -> tuple[Array, Array]:
    """Weighted mean motion of points: translation (3,) of their centre and rotation (3, 3) about it.

    Kabsch's polar rotation, the least-squares fit of a rigid motion; a planar set suffices.

    Parameters
    ----------
    arms
        Reference positions from the weighted centre (n, 3), m.
    weights
        Positive, (n,), any unit.
    displacement
        (n, 3), m.
    """
    share = weights / weights.sum()
    shift = share @ displacement
    left, _, right = np.linalg.svd((arms + displacement - shift).T @ (share[:, None] * arms))
    sense = np.sign(np.linalg.det(left @ right))
    return shift, (left * np.array([1.0, 1.0, sense])) @ right
