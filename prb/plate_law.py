"""The flat-plate law of eq. 4.3, and what it says of the speeds that the text reports."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def plate_load(velocity: Array, normal: Array, area: float, density: float = 1000.0, factor: float = 1.0) -> Array:
    """Force of water at rest on a plate that moves through it, N.

    F = rho u^2 A sin(angle of attack), normal to the plate and against the motion across it; with u sin = u . n and the
    sign that a reversing flow needs,

        F = -rho |u| (u . n) A n

    Parameters
    ----------
    velocity, normal
        u in m/s, and n, a unit vector, (..., d).
    area, density, factor
        A in m^2, rho in kg/m^3, and a factor of the law.

    Examples
    --------
    >>> plate_load(np.array([0.5, 0.0]), np.array([1.0, 0.0]), 1e-3)
    array([-0.25,  0.  ])
    """
    across = np.sum(velocity * normal, axis=-1, keepdims=True)
    speed = np.linalg.norm(velocity, axis=-1, keepdims=True)
    return np.asarray(-density * factor * area * speed * across * normal)


def speed_needed(force: float, area: float, density: float = 1000.0) -> float:
    """Speed at which a plate moved along its normal feels ``force`` (N) by eq. 4.3, m/s."""
    return float(np.sqrt(force / (density * area)))
