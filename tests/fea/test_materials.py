"""Laws at one point: rest, energy to stress to tangent, closed forms."""

import numpy as np
import pytest

from fea.materials import (
    LAWS,
    constants,
    elasticity,
    energy_density,
    green_lagrange,
    hooke,
    pressure_and_slope,
    second_piola,
    turned_over,
    volumetric_energy,
)
from lab.materials import Material

SHAPES = {"mooney-rivlin": {"c01_share": 0.3}, "yeoh": {"c20_ratio": -0.2, "c30_ratio": 0.1}}
MATERIALS = {law: Material(law=law, youngs_modulus=8.1, poisson_ratio=0.35, **SHAPES.get(law, {})) for law in LAWS}
GRADIENT = np.array([[0.1, 0.05, -0.02], [0.2, -0.08, 0.03], [0.04, -0.07, 0.12]])


def strain_of(gradient):
    strain = np.empty(6)
    green_lagrange(gradient, strain)
    return strain


def stress_of(law, strain):
    stress = np.empty(6)
    second_piola(*constants(MATERIALS[law]), strain, stress)
    return stress


def energy_of(law, strain):
    return energy_density(*constants(MATERIALS[law]), strain)


def test_green_lagrange_is_half_of_c_minus_identity():
    f = np.eye(3) + GRADIENT
    e = 0.5 * (f.T @ f - np.eye(3))
    expected = [e[0, 0], e[1, 1], e[2, 2], 2 * e[0, 1], 2 * e[0, 2], 2 * e[1, 2]]
    np.testing.assert_allclose(strain_of(GRADIENT), expected, rtol=1e-13)


@pytest.mark.parametrize("law", LAWS)
def test_no_stress_and_hookes_tangent_at_rest(law):
    rest, matrix, column = np.zeros(6), np.empty((6, 6)), np.empty(6)
    assert energy_of(law, rest) == 0.0
    np.testing.assert_allclose(stress_of(law, rest), 0.0, atol=1e-15)
    elasticity(*constants(MATERIALS[law]), rest, matrix)
    for n in range(6):
        hooke(3.0, 7.0, np.eye(6)[n], column)
        np.testing.assert_allclose(matrix[:, n], column, atol=1e-14)


@pytest.mark.parametrize("size", [1.0, 3.0])
@pytest.mark.parametrize("law", LAWS)
def test_stress_is_derivative_of_energy_and_tangent_of_stress(law, size):
    strain, h, matrix = strain_of(size * GRADIENT), 1e-5, np.empty((6, 6))
    elasticity(*constants(MATERIALS[law]), strain, matrix)
    np.testing.assert_allclose(matrix, matrix.T, atol=1e-13)
    stress = stress_of(law, strain)
    for n, step in enumerate(h * np.eye(6)):
        slope = (energy_of(law, strain + step) - energy_of(law, strain - step)) / (2 * h)
        assert slope == pytest.approx(stress[n], rel=1e-7, abs=1e-8)
        column = (stress_of(law, strain + step) - stress_of(law, strain - step)) / (2 * h)
        np.testing.assert_allclose(matrix[:, n], column, rtol=1e-6, atol=1e-6)


def test_neo_hookean_stress_against_its_closed_form():
    f = np.eye(3) + GRADIENT
    inverse, log_j = np.linalg.inv(f.T @ f), np.log(np.linalg.det(f))
    s = 3.0 * (np.eye(3) - inverse) + 7.0 * log_j * inverse
    expected = [s[0, 0], s[1, 1], s[2, 2], s[0, 1], s[0, 2], s[1, 2]]
    np.testing.assert_allclose(stress_of("neo-hookean", strain_of(GRADIENT)), expected, rtol=1e-12)


@pytest.mark.parametrize("law", ["nearly-incompressible-neo-hookean", "mooney-rivlin", "yeoh"])
def test_isochoric_energy_against_invariants(law):
    f = np.eye(3) + GRADIENT
    c, j = f.T @ f, np.linalg.det(f)
    bar = c / j ** (2 / 3)
    i1, i2 = np.trace(bar), 0.5 * (np.trace(bar) ** 2 - np.trace(bar @ bar))
    c10, c01, c20, c30 = constants(MATERIALS[law])[1][4:]
    assert (2 * (c10 + c01), c01 > 0, c20 < 0) == (pytest.approx(3.0), law == "mooney-rivlin", law == "yeoh")
    kappa = MATERIALS[law].bulk_modulus
    expected = c10 * (i1 - 3) + c01 * (i2 - 3) + c20 * (i1 - 3) ** 2 + c30 * (i1 - 3) ** 3
    expected += kappa / 2 * ((j**2 - 1) / 2 - np.log(j))
    assert energy_of(law, strain_of(GRADIENT)) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("law", ["nearly-incompressible-neo-hookean", "mooney-rivlin", "yeoh"])
def test_a_pure_change_of_volume_gives_pressure_alone(law):
    stretch = 1.1
    stress = stress_of(law, strain_of((stretch - 1) * np.eye(3)))
    pressure, _ = pressure_and_slope(constants(MATERIALS[law])[1], stretch**3)
    # sigma = F S F' / J = S / stretch
    np.testing.assert_allclose(stress / stretch, [pressure] * 3 + [0] * 3, atol=1e-13)


def test_volumetric_pressure_is_derivative_of_its_energy_and_resists_crushing():
    parameters = constants(MATERIALS["yeoh"])[1]
    for ratio in (0.3, 0.9, 1.4):
        h = 1e-5
        slope = (volumetric_energy(parameters, ratio + h) - volumetric_energy(parameters, ratio - h)) / (2 * h)
        pressure, stiffness = pressure_and_slope(parameters, ratio)
        assert pressure == pytest.approx(slope, rel=1e-7)
        ahead, behind = (pressure_and_slope(parameters, ratio + s)[0] for s in (h, -h))
        assert stiffness == pytest.approx((ahead - behind) / (2 * h), rel=1e-7)
    assert volumetric_energy(parameters, 1e-9) > 9 * volumetric_energy(parameters, 0.1)
    assert np.isnan(volumetric_energy(parameters, -0.1))
    assert np.isnan(pressure_and_slope(parameters, 0.0)).all()


@pytest.mark.parametrize("law", [law for law in LAWS if law != "saint-venant-kirchhoff"])
def test_impossible_strain_gives_nan(law):
    assert np.isnan(stress_of(law, np.array([-0.6, 0, 0, 0, 0, 0]))).all()


def test_turned_over():
    assert not turned_over(GRADIENT)
    assert turned_over(np.diag([-2.0, 0.0, 0.0]))


def test_lame_constants():
    law, parameters = constants(Material(youngs_modulus=26e6, poisson_ratio=0.3))
    assert (law, *parameters[:2]) == (0, pytest.approx(10e6), pytest.approx(15e6))


def test_viscous_stress_of_isochoric_laws_has_no_pressure():
    mu, _, lam = constants(MATERIALS["yeoh"])[1][:3]
    stress = np.empty(6)
    hooke(mu, lam, np.array([1.0, 1.0, 1.0, 0, 0, 0]), stress)
    np.testing.assert_allclose(stress, 0.0, atol=1e-15)
