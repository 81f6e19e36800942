"""Laws at one point: rest, energy to stress to tangent, refusals."""

import numpy as np
import pytest
from pydantic import ValidationError

from fea.materials import LAWS, constants, elasticity, energy_density, green_lagrange, hooke, second_piola, turned_over
from lab.materials import Material


def strain_of(gradient):
    strain = np.empty(6)
    green_lagrange(gradient, strain)
    return strain


def stress_of(law, strain):
    stress = np.empty(6)
    second_piola(LAWS[law], 3.0, 7.0, strain, stress)
    return stress


GRADIENT = np.array([[0.1, 0.05, -0.02], [0.2, -0.08, 0.03], [0.04, -0.07, 0.12]])


def test_green_lagrange_is_half_of_c_minus_identity():
    f = np.eye(3) + GRADIENT
    e = 0.5 * (f.T @ f - np.eye(3))
    expected = [e[0, 0], e[1, 1], e[2, 2], 2 * e[0, 1], 2 * e[0, 2], 2 * e[1, 2]]
    np.testing.assert_allclose(strain_of(GRADIENT), expected, rtol=1e-13)


@pytest.mark.parametrize("law", LAWS)
def test_no_stress_and_hookes_tangent_at_rest(law):
    rest, matrix, column = np.zeros(6), np.empty((6, 6)), np.empty(6)
    assert energy_density(LAWS[law], 3.0, 7.0, rest) == 0.0
    np.testing.assert_allclose(stress_of(law, rest), 0.0, atol=1e-15)
    elasticity(LAWS[law], 3.0, 7.0, rest, matrix)
    for n in range(6):
        hooke(3.0, 7.0, np.eye(6)[n], column)
        np.testing.assert_allclose(matrix[:, n], column, atol=1e-14)


@pytest.mark.parametrize("law", LAWS)
def test_stress_is_derivative_of_energy_and_tangent_of_stress(law):
    strain, h, matrix = strain_of(GRADIENT), 1e-6, np.empty((6, 6))
    elasticity(LAWS[law], 3.0, 7.0, strain, matrix)
    for n, step in enumerate(h * np.eye(6)):
        energies = [energy_density(LAWS[law], 3.0, 7.0, strain + s * step) for s in (1, -1)]
        assert (energies[0] - energies[1]) / (2 * h) == pytest.approx(stress_of(law, strain)[n], rel=1e-7)
        slope = (stress_of(law, strain + step) - stress_of(law, strain - step)) / (2 * h)
        np.testing.assert_allclose(matrix[:, n], slope, rtol=1e-6, atol=1e-7)


def test_neo_hookean_stress_against_its_closed_form():
    f = np.eye(3) + GRADIENT
    inverse, log_j = np.linalg.inv(f.T @ f), np.log(np.linalg.det(f))
    s = 3.0 * (np.eye(3) - inverse) + 7.0 * log_j * inverse
    expected = [s[0, 0], s[1, 1], s[2, 2], s[0, 1], s[0, 2], s[1, 2]]
    np.testing.assert_allclose(stress_of("neo-hookean", strain_of(GRADIENT)), expected, rtol=1e-12)


def test_turned_over():
    assert not turned_over(GRADIENT)
    assert turned_over(np.diag([-2.0, 0.0, 0.0]))


def test_lame_constants():
    law, mu, lam = constants(Material(youngs_modulus=26e6, poisson_ratio=0.3))
    assert (law, mu, lam) == (0, pytest.approx(10e6), pytest.approx(15e6))


@pytest.mark.parametrize("bad", [{"youngs_modulus": 0.0}, {"poisson_ratio": 0.5}, {"poisson_ratio": -1.0},
                                 {"density": -1.0}, {"law": "hooke"}])  # fmt: skip
def test_bad_parameters_are_refused(bad):
    with pytest.raises(ValidationError):
        Material(**bad)
