"""Finite rotations by the rotation vector, with closed-form first and second derivatives."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_SERIES_BELOW = 0.1
#: skew(e_j), (3, 3, 3).
_GENERATORS = np.array([
    [[0, 0, 0], [0, 0, -1], [0, 1, 0]],
    [[0, 0, 1], [0, 0, 0], [-1, 0, 0]],
    [[0, -1, 0], [1, 0, 0], [0, 0, 0]],
], dtype=float)  # fmt: skip


def skew(vector: Array) -> Array:
    """Matrix (3, 3) of the cross product with ``vector`` (3,)."""
    return np.einsum("j,jkl->kl", vector, _GENERATORS)


def _coefficients(angle: float) -> tuple[float, float, float, float, float]:
    """sin(t)/t, a = (1-cos t)/t^2, b = (t-sin t)/t^3, and a'/t, b'/t."""
    t2 = angle * angle
    if angle < _SERIES_BELOW:
        return (
            1 - t2 / 6 + t2**2 / 120 - t2**3 / 5040, 0.5 - t2 / 24 + t2**2 / 720 - t2**3 / 40320,
            1 / 6 - t2 / 120 + t2**2 / 5040 - t2**3 / 362880,
            -1 / 12 + t2 / 180 - t2**2 / 6720 + t2**3 / 453600,
            -1 / 60 + t2 / 1260 - t2**2 / 60480 + t2**3 / 4989600,
        )  # fmt: skip
    s, c = np.sin(angle), np.cos(angle)
    a, b = (1 - c) / t2, (angle - s) / (t2 * angle)
    return s / angle, a, b, (s / angle - 2 * a) / t2, ((1 - c) / t2 - 3 * b) / t2


def rotation(theta: Array) -> Array:
    """Rotation matrix (3, 3) of the rotation vector ``theta`` (3,), rad (Rodrigues)."""
    k = skew(theta)
    sinc, a, *_ = _coefficients(float(np.linalg.norm(theta)))
    return np.eye(3) + sinc * k + a * k @ k


def rotation_derivatives(theta: Array) -> tuple[Array, Array, Array]:
    """Rotation matrix and its derivatives by the rotation vector.

    With T = I + a K + b K^2 the left Jacobian, dR/dtheta_j = skew(T e_j) R, and once more by the
    product rule.

    Returns
    -------
    R, dR, ddR
        (3, 3), (3, 3, 3) with the derivative's number first, (3, 3, 3, 3) likewise.
    """
    k = skew(theta)
    _, a, b, da, db = _coefficients(float(np.linalg.norm(theta)))
    k2 = k @ k
    jacobian = np.eye(3) + a * k + b * k2
    turn = np.einsum("mj,mkl->jkl", jacobian, _GENERATORS)
    r = rotation(theta)
    first = turn @ r
    second = np.empty((3, 3, 3, 3))
    for i in range(3):
        e = _GENERATORS[i]
        change = da * theta[i] * k + a * e + db * theta[i] * k2 + b * (e @ k + k @ e)
        second[i] = np.einsum("mj,mkl->jkl", change, _GENERATORS) @ r + turn @ first[i]
    return r, first, second
