"""A face that moves as a rigid body: its nodes as functions of six numbers."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fea.rotations import rotation, rotation_derivatives

Array = NDArray[np.float64]


@dataclass(frozen=True)
class RigidFace:
    """Nodes carried by the pose q = (d, theta): x = centre + d + R(theta) arm.

    Parameters
    ----------
    nodes
        Node numbers (n,).
    centre
        Reference centre of the face (3,), m.
    arms
        Reference positions of the nodes from the centre (n, 3), m.
    """

    nodes: NDArray[np.int64]
    centre: Array
    arms: Array

    def displacement(self, pose: Array) -> Array:
        """Displacements of the nodes (n, 3), m, at the pose (6,), m and rad."""
        return pose[:3] + self.arms @ (rotation(pose[3:]) - np.eye(3)).T

    def jacobian(self, pose: Array) -> Array:
        """d displacement / d pose, (n, 3, 6)."""
        _, first, _ = rotation_derivatives(pose[3:])
        return self._jacobian(first)

    def _jacobian(self, first: Array) -> Array:
        result = np.empty((len(self.nodes), 3, 6))
        result[:, :, :3] = np.eye(3)
        result[:, :, 3:] = np.einsum("jkl,nl->nkj", first, self.arms)
        return result

    def work(self, pose: Array, forces: Array) -> Array:
        """Generalised forces J'f (6,) of nodal ``forces`` (n, 3), N."""
        return np.einsum("nkj,nk->j", self.jacobian(pose), forces)

    def geometric(self, pose: Array, forces: Array) -> Array:
        """Change of J'f with the pose at constant forces, (6, 6)."""
        _, _, second = rotation_derivatives(pose[3:])
        result = np.zeros((6, 6))
        result[3:, 3:] = np.einsum("ijkl,nl,nk->ij", second, self.arms, forces)
        return result

    def wrench(self, pose: Array, forces: Array) -> Array:
        """Resultant force, N, and moment about the current centre, N m, of nodal forces; global axes, (6,)."""
        arms = self.arms @ rotation(pose[3:]).T
        return np.concatenate([forces.sum(axis=0), np.cross(arms, forces).sum(axis=0)])


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
