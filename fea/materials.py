"""Hyperelastic laws at one point, for use inside compiled kernels.

Voigt order 11, 22, 33, 12, 13, 23; strains carry doubled shears, so that stress . strain is work.
``law`` is a code of ``LAWS`` and ``parameters`` the array of ``constants``:

    mu, lambda, lambda of the viscous stress, kappa, c10, c01, c20, c30     (Pa)

The isochoric laws share one polynomial in the invariants of C / J^(2/3), J = det F:

    W = c10 (I1 - 3) + c01 (I2 - 3) + c20 (I1 - 3)^2 + c30 (I1 - 3)^3 + U(J)
    U = kappa/2 ((J^2 - 1)/2 - ln J)

U is convex and infinite at J = 0, so an element that is being crushed resists without bound; kappa/2 (J - 1)^2,
which agrees with it up to third order in J - 1, would let it vanish for a finite price.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from lab.materials import Material

SAINT_VENANT_KIRCHHOFF = 0
NEO_HOOKEAN = 1
ISOCHORIC = 2
LAWS = {
    "saint-venant-kirchhoff": SAINT_VENANT_KIRCHHOFF,
    "neo-hookean": NEO_HOOKEAN,
    "nearly-incompressible-neo-hookean": ISOCHORIC,
    "mooney-rivlin": ISOCHORIC,
    "yeoh": ISOCHORIC,
}
_KAPPA, _C10, _C01, _C20, _C30 = 3, 4, 5, 6, 7

Array = NDArray[np.float64]


def constants(material: Material) -> tuple[int, Array]:
    """Law code of a material, and the parameters (8,), Pa, that every function here takes.

    Under an isochoric law the viscous stress is deviatoric: the bulk of such materials is elastic, and a
    viscous bulk stress would lock where the elastic one no longer does.
    """
    law, mu = LAWS[material.law], material.shear_modulus
    c01 = 0.5 * mu * material.c01_share if material.law == "mooney-rivlin" else 0.0
    c10 = 0.5 * mu - c01
    c20, c30 = (material.c20_ratio * c10, material.c30_ratio * c10) if material.law == "yeoh" else (0.0, 0.0)
    viscous = -2.0 * mu / 3.0 if law == ISOCHORIC else material.lame_lambda
    return law, np.array([mu, material.lame_lambda, viscous, material.bulk_modulus, c10, c01, c20, c30])


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
    """Inverse of C = I + 2E (Voigt, plain shears) into ``inverse``; returns det C, NaN when not positive."""
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
    return determinant if determinant > 0.0 else np.nan


@njit(cache=True)
def volume_ratio(gradient: Array) -> float:
    """J = det(I + H) of the displacement gradient H (3, 3)."""
    h = gradient
    a, b, c = 1.0 + h[0, 0], 1.0 + h[1, 1], 1.0 + h[2, 2]
    minors = (b * c - h[1, 2] * h[2, 1], h[1, 0] * c - h[1, 2] * h[2, 0], h[1, 0] * h[2, 1] - b * h[2, 0])
    return a * minors[0] - h[0, 1] * minors[1] + h[0, 2] * minors[2]


@njit(cache=True)
def turned_over(gradient: Array) -> bool:
    """Whether det(I + H) is not positive, where C alone cannot tell."""
    return volume_ratio(gradient) <= 0.0


@njit(cache=True)
def volumetric_energy(parameters: Array, ratio: float) -> float:
    """U(J), J/m^3; NaN where the volume ratio is not positive."""
    if not ratio > 0.0:
        return np.nan
    return 0.5 * parameters[_KAPPA] * (0.5 * (ratio * ratio - 1.0) - np.log(ratio))


@njit(cache=True)
def pressure_and_slope(parameters: Array, ratio: float) -> tuple[float, float]:
    """dU/dJ and d2U/dJ2, Pa; NaN where the volume ratio is not positive."""
    if not ratio > 0.0:
        return np.nan, np.nan
    half = 0.5 * parameters[_KAPPA]
    return half * (ratio - 1.0 / ratio), half * (1.0 + 1.0 / (ratio * ratio))


@njit(cache=True)
def _isochoric_invariants(strain: Array, inverse: Array) -> tuple[float, float, float, float]:
    """J^(-2/3), I1 and I2 of C, and J; the inverse of C into ``inverse`` (6,)."""
    determinant = _inverse_cauchy_green(strain, inverse)
    trace = strain[0] + strain[1] + strain[2]
    squares = (
        strain[0] ** 2 + strain[1] ** 2 + strain[2] ** 2 + 0.5 * (strain[3] ** 2 + strain[4] ** 2 + strain[5] ** 2)
    )
    second = 3.0 + 4.0 * trace + 2.0 * (trace * trace - squares)
    return determinant ** (-1.0 / 3.0), 3.0 + 2.0 * trace, second, np.sqrt(determinant)


@njit(cache=True)
def isochoric_energy(parameters: Array, strain: Array) -> float:
    """The polynomial without U, J/m^3."""
    a, i1, i2, _ = _isochoric_invariants(strain, np.empty(6))
    x = a * i1 - 3.0
    return x * (parameters[_C10] + x * (parameters[_C20] + x * parameters[_C30])) + parameters[_C01] * (
        a * a * i2 - 3.0
    )


@njit(cache=True)
def split_stress(parameters: Array, strain: Array, pressure: float, stress: Array) -> None:
    """Isochoric stress plus ``pressure`` J inv(C) into ``stress`` (6,), Pa."""
    a, i1, i2, j = _isochoric_invariants(strain, stress)
    x = a * i1 - 3.0
    first = 2.0 * a * (parameters[_C10] + x * (2.0 * parameters[_C20] + 3.0 * x * parameters[_C30]))
    second = 2.0 * a * a * parameters[_C01]
    inverse = pressure * j - (first * i1 + 2.0 * second * i2) / 3.0
    for n in range(6):
        stress[n] *= inverse
    for n in range(3):
        # I1 I - C of the second invariant.
        stress[n] += first + second * (i1 - 1.0 - 2.0 * strain[n])
        stress[n + 3] -= second * strain[n + 3]


@njit(cache=True)
def split_elasticity(parameters: Array, strain: Array, pressure: float, slope: float, matrix: Array) -> None:
    """Derivative of ``split_stress`` into ``matrix`` (6, 6), Pa.

    ``slope`` is dp/dJ where the pressure follows the volume at this point alone, else 0.
    """
    ci, d1, d2 = np.empty(6), np.empty(6), np.empty(6)
    a, i1, i2, j = _isochoric_invariants(strain, ci)
    x = a * i1 - 3.0
    w1 = parameters[_C10] + x * (2.0 * parameters[_C20] + 3.0 * x * parameters[_C30])
    w11 = 2.0 * parameters[_C20] + 6.0 * x * parameters[_C30]
    w2 = parameters[_C01]
    for n in range(3):
        d1[n], d1[n + 3] = 1.0, 0.0
        d2[n], d2[n + 3] = i1 - 1.0 - 2.0 * strain[n], -strain[n + 3]
    both = 4.0 * (w1 * a * i1 + 4.0 * w2 * a * a * i2) / 9.0 + slope * j * j + pressure * j
    mixed = 2.0 * (w1 * a * i1 + 2.0 * w2 * a * a * i2) / 3.0 - pressure * j
    cross1, cross2, unit = -4.0 / 3.0 * w1 * a, -8.0 / 3.0 * w2 * a * a, 4.0 * w2 * a * a
    _set_products(ci, mixed, both, matrix)
    # The same factors gathered for every column: of inv(C), of I, and of dI1 of the isochoric C.
    for n in range(6):
        along = 2.0 * a * (d1[n] - i1 / 3.0 * ci[n])
        by_inverse, by_unit = cross1 * d1[n] + cross2 * d2[n], cross1 * ci[n] + unit * d1[n]
        for m in range(n + 1):
            matrix[m, n] += ci[m] * by_inverse + d1[m] * by_unit + d2[m] * cross2 * ci[n]
            matrix[m, n] += w11 * along * 2.0 * a * (d1[m] - i1 / 3.0 * ci[m])
        matrix[n, n] -= unit if n < 3 else 0.5 * unit
    _mirror(matrix)


@njit(cache=True)
def _set_products(ci: Array, mixed: float, both: float, matrix: Array) -> None:
    """Upper triangle of both inv(C) x inv(C) + mixed (inv(C)_ik inv(C)_jl + inv(C)_il inv(C)_jk)."""
    rows, cols = (0, 1, 2, 0, 0, 1), (0, 1, 2, 1, 2, 2)
    tensor = ((0, 3, 4), (3, 1, 5), (4, 5, 2))
    for n in range(6):
        k, l = rows[n], cols[n]  # noqa: E741
        for m in range(n + 1):
            i, j = rows[m], cols[m]
            pair = ci[tensor[i][k]] * ci[tensor[j][l]] + ci[tensor[i][l]] * ci[tensor[j][k]]
            matrix[m, n] = both * ci[m] * ci[n] + mixed * pair


@njit(cache=True)
def _mirror(matrix: Array) -> None:
    for n in range(6):
        for m in range(n):
            matrix[n, m] = matrix[m, n]


@njit(cache=True)
def energy_density(law: int, parameters: Array, strain: Array) -> float:
    """Strain energy per reference volume, J/m^3.

    Saint Venant-Kirchhoff: lam/2 tr(E)^2 + mu E:E; neo-Hookean (Bonet & Wood 2008, eq. 6.27):
    mu/2 (I1 - 3) - mu ln J + lam/2 (ln J)^2; isochoric: see the head of this file.
    """
    mu, lam = parameters[0], parameters[1]
    trace = strain[0] + strain[1] + strain[2]
    if law == SAINT_VENANT_KIRCHHOFF:
        shear = strain[3] ** 2 + strain[4] ** 2 + strain[5] ** 2
        return 0.5 * lam * trace**2 + mu * (strain[0] ** 2 + strain[1] ** 2 + strain[2] ** 2 + 0.5 * shear)
    determinant = _inverse_cauchy_green(strain, np.empty(6))
    if law == ISOCHORIC:
        return isochoric_energy(parameters, strain) + volumetric_energy(parameters, np.sqrt(determinant))
    log_j = 0.5 * np.log(determinant)
    return mu * (trace - log_j) + 0.5 * lam * log_j**2


@njit(cache=True)
def second_piola(law: int, parameters: Array, strain: Array, stress: Array) -> None:
    """Second Piola-Kirchhoff stress dW/dE into ``stress`` (6,), Pa."""
    mu, lam = parameters[0], parameters[1]
    if law == SAINT_VENANT_KIRCHHOFF:
        hooke(mu, lam, strain, stress)
        return
    determinant = _inverse_cauchy_green(strain, stress)
    if law == ISOCHORIC:
        pressure, _ = pressure_and_slope(parameters, np.sqrt(determinant))
        split_stress(parameters, strain, pressure, stress)
        return
    factor = 0.5 * lam * np.log(determinant) - mu
    for n in range(6):
        stress[n] *= factor
    for n in range(3):
        stress[n] += mu


@njit(cache=True)
def elasticity(law: int, parameters: Array, strain: Array, matrix: Array) -> None:
    """Tangent dS/dE into ``matrix`` (6, 6), Pa."""
    mu, lam = parameters[0], parameters[1]
    if law == SAINT_VENANT_KIRCHHOFF:
        matrix[:] = 0.0
        for m in range(3):
            for n in range(3):
                matrix[m, n] = lam
            matrix[m, m] += 2.0 * mu
            matrix[m + 3, m + 3] = mu
        return
    ci = np.empty(6)
    determinant = _inverse_cauchy_green(strain, ci)
    if law == ISOCHORIC:
        pressure, slope = pressure_and_slope(parameters, np.sqrt(determinant))
        split_elasticity(parameters, strain, pressure, slope, matrix)
        return
    _set_products(ci, mu - 0.5 * lam * np.log(determinant), lam, matrix)
    _mirror(matrix)
