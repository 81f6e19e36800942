"""Light carrier of markers on the tip face, and forces on material points of it."""

import numpy as np
from numpy.typing import NDArray

from fea.affine import affine_shares
from fea.parts import Deformable
from fea.rigid_part import mean_rigid_motion

Array = NDArray[np.float64]


class Carrier:
    """Light carrier of the markers, riding on the mean rigid motion of the tip face.

    Parameters
    ----------
    part
        With the boundary ``tip``.
    places
        Of the markers from the tip's centre in the fixed axes, without any load (markers, 3), m.
    """

    def __init__(self, part: Deformable, places: Array) -> None:
        self.places = places
        self.nodes = part.boundary("tip")
        self.shares = part.shares("tip")[self.nodes]
        points = part.points[self.nodes]
        self.arms = points - self.shares @ points / self.shares.sum()

    def read(self, displacement: Array) -> tuple[Array, Array]:
        """Displacements of the markers (marker, 3) and of the tip's centre (3,), m, from those of all nodes."""
        shift, turn = mean_rigid_motion(self.arms, self.shares, displacement[self.nodes])
        return shift + self.places @ (turn - np.eye(3)).T, shift

    def velocity(self, velocity: Array) -> Array:
        """Translation of the tip's centre and mean rotation about it (6,), m/s and rad/s, from those of all nodes.

        Of the unloaded part, or of small displacements: the least-squares fit of a small rigid motion.
        """
        share, moved = self.shares / self.shares.sum(), velocity[self.nodes]
        shift = share @ moved
        squares = self.arms.T @ (share[:, None] * self.arms)
        turn = np.linalg.solve(np.trace(squares) * np.eye(3) - squares, share @ np.cross(self.arms, moved - shift))
        return np.concatenate([shift, turn])

    def hung_at(self, place: Array) -> Array:
        """Shares (tip nodes,) of the nodes in a force on the point of the face at ``place`` (3,), m, from its centre.

        They sum to 1 and have ``place`` as their mean: the force has its moment at any deflection, since its point
        follows the face's affine motion.  Off the plane of the face there is no such point; that part is dropped.
        """
        return np.asarray(affine_shares(self.arms, self.shares) @ [1.0, *place])
