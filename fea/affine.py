"""Mean affine motion of points: what a distributing coupling carries, exact for any rotation."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def affine_shares(arms: Array, weights: Array) -> Array:
    """Shares H (n, 4) of points in their mean affine motion: H (1, r) is that of the displacement at r.

    The weighted least-squares fit of an affine motion.  A force on the point at r, spread over the points by
    H (1, r), has its moment at any deflection, since its place moves with them.

    Parameters
    ----------
    arms
        Reference positions from the weighted centre (n, 3), m.
    weights
        Positive, (n,), any unit.

    Returns
    -------
    shares
        Of columns 1 and x, y, z of r (1 and 1/m).  Where the points lie in a plane, nothing is known off it: that
        part of r is dropped.
    """
    share = weights / weights.sum()
    spread = arms.T @ (share[:, None] * arms)
    # The pseudo-inverse leaves the normal of a plane alone.
    slopes = arms @ np.linalg.pinv(spread, rcond=1e-9, hermitian=True)
    return np.asarray(share[:, None] * np.column_stack([np.ones(len(arms)), slopes]))
