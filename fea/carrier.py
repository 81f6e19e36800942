"""Light carrier of markers on the tip face, and forces on material points of it."""

import numpy as np
from numpy.typing import NDArray

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

    def hung_at(self, place: Array) -> Array:
        """Shares (tip nodes,) of the nodes in a force on the point of the face at ``place`` (3,), m, from its centre.

        They sum to 1 and have ``place`` as their mean: the force has its moment at any deflection, since its point
        follows the face's affine motion.  Off the plane of the face there is no such point; that part is dropped.
        """
        share = self.shares / self.shares.sum()
        spread = self.arms.T @ (share[:, None] * self.arms)
        # The face has no extent along its normal: the pseudo-inverse leaves that direction alone.
        slope = np.linalg.pinv(spread, rcond=1e-9, hermitian=True) @ place
        return np.asarray(share * (1.0 + self.arms @ slope))
