"""Hyperelastic laws at one point, for use inside compiled kernels.

Voigt order 11, 22, 33, 12, 13, 23; strains carry doubled shears, so that stress . strain is work.
``law`` is a code of ``LAWS``; ``mu`` and ``lam`` are Lame's constants in Pa.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from lab.materials import Material

SAINT_VENANT_KIRCHHOFF = 0
NEO_HOOKEAN = 1
LAWS = {"saint-venant-kirchhoff": SAINT_VENANT_KIRCHHOFF, "neo-hookean": NEO_HOOKEAN}

Array = NDArray[np.float64]


def constants(material: Material) -> tuple[int, float, float]:
    """Law code and Lame's constants mu, lambda (Pa) of a material."""
    return LAWS[material.law], material.shear_modulus, material.lame_lambda


@njit(cache=True)
def green_lagrange(gradient: Array, strain: Array) -> None:
    """E = sym(H) + H'H/2 of the displacement gradient H (3, 3) into ``strain`` (6,).

    Written in H, not F, so that small strains keep their digits.
    """
    h = gradient
    for n in range(3):
        strain[n] = h[n, n] + 0.5 * (h[0, n] * h[0, n] + h[1, n] * h[1, n] + h[2, n] * h[2, n])
    strain[3] = h[0, 1] + h[1, 0] + h[0, 0] * h[0, 1] + h[1, 0] * h[1, 1] + h[2, 0] * h[2, 1]
    strain[4] = h[0, 2] + h[2, 0] + h[0, 0] * h[0, 2] + h[1, 0] * h[1, 2] + h[2, 0] * h[2, 2]
    strain[5] = h[1, 2] + h[2, 1] + h[0, 1] * h[0, 2] + h[1, 1] * h[1, 2] + h[2, 1] * h[2, 2]


@njit(cache=True)
def hooke(mu: float, lam: float, strain: Array, stress: Array) -> None:
    """Stress lam tr(E) I + 2 mu E into ``stress`` (6,), Pa."""
    pressure = lam * (strain[0] + strain[1] + strain[2])
    for n in range(3):
        stress[n] = pressure + 2.0 * mu * strain[n]
        stress[n + 3] = mu * strain[n + 3]


@njit(cache=True)
def _inverse_cauchy_green(strain: Array, inverse: Array) -> float:
    """Inverse of C = I + 2E (Voigt, plain shears) into ``inverse``; returns ln J, NaN when not invertible."""
    c0, c1, c2 = 1.0 + 2.0 * strain[0], 1.0 + 2.0 * strain[1], 1.0 + 2.0 * strain[2]
    c3, c4, c5 = strain[3], strain[4], strain[5]
    inverse[0] = c1 * c2 - c5 * c5
    inverse[3] = c4 * c5 - c3 * c2
    inverse[4] = c3 * c5 - c4 * c1
    determinant = c0 * inverse[0] + c3 * inverse[3] + c4 * inverse[4]
    inverse[1] = c0 * c2 - c4 * c4
    inverse[2] = c0 * c1 - c3 * c3
    inverse[5] = c3 * c4 - c0 * c5
    for n in range(6):
        inverse[n] /= determinant
    return 0.5 * np.log(determinant) if determinant > 0.0 else np.nan


@njit(cache=True)
def turned_over(gradient: Array) -> bool:
    """Whether det(I + H) is not positive, where C alone cannot tell."""
    h = gradient
    a, b, c = 1.0 + h[0, 0], 1.0 + h[1, 1], 1.0 + h[2, 2]
    minors = (b * c - h[1, 2] * h[2, 1], h[1, 0] * c - h[1, 2] * h[2, 0], h[1, 0] * h[2, 1] - b * h[2, 0])
    return a * minors[0] - h[0, 1] * minors[1] + h[0, 2] * minors[2] <= 0.0


@njit(cache=True)
def energy_density(law: int, mu: float, lam: float, strain: Array) -> float:
    """Strain energy per reference volume, J/m^3.

    Saint Venant-Kirchhoff: lam/2 tr(E)^2 + mu E:E; neo-Hookean (Bonet & Wood 2008, eq. 6.27):
    mu/2 (I1 - 3) - mu ln J + lam/2 (ln J)^2.
    """
    trace = strain[0] + strain[1] + strain[2]
    if law == SAINT_VENANT_KIRCHHOFF:
        shear = strain[3] ** 2 + strain[4] ** 2 + strain[5] ** 2
        return 0.5 * lam * trace**2 + mu * (strain[0] ** 2 + strain[1] ** 2 + strain[2] ** 2 + 0.5 * shear)
    log_j = _inverse_cauchy_green(strain, np.empty(6))
    return mu * (trace - log_j) + 0.5 * lam * log_j**2


@njit(cache=True)
def second_piola(law: int, mu: float, lam: float, strain: Array, stress: Array) -> None:
    """Second Piola-Kirchhoff stress dW/dE into ``stress`` (6,), Pa."""
    if law == SAINT_VENANT_KIRCHHOFF:
        hooke(mu, lam, strain, stress)
        return
    log_j = _inverse_cauchy_green(strain, stress)
    for n in range(6):
        stress[n] *= lam * log_j - mu
    for n in range(3):
        stress[n] += mu


@njit(cache=True)
def elasticity(law: int, mu: float, lam: float, strain: Array, matrix: Array) -> None:
    """Tangent dS/dE into ``matrix`` (6, 6), Pa."""
    matrix[:] = 0.0
    if law == SAINT_VENANT_KIRCHHOFF:
        for m in range(3):
            for n in range(3):
                matrix[m, n] = lam
            matrix[m, m] += 2.0 * mu
            matrix[m + 3, m + 3] = mu
        return
    ci = np.empty(6)
    factor = mu - lam * _inverse_cauchy_green(strain, ci)
    rows, cols = (0, 1, 2, 0, 0, 1), (0, 1, 2, 1, 2, 2)
    tensor = ((0, 3, 4), (3, 1, 5), (4, 5, 2))
    for m in range(6):
        for n in range(6):
            i, j, k, l = rows[m], cols[m], rows[n], cols[n]  # noqa: E741
            mixed = ci[tensor[i][k]] * ci[tensor[j][l]] + ci[tensor[i][l]] * ci[tensor[j][k]]
            matrix[m, n] = lam * ci[m] * ci[n] + factor * mixed
