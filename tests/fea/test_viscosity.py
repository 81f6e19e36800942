"""Viscous stress in time against closed forms of relaxation and of the complex modulus."""

import numpy as np
import pytest

from fea.viscosity import ViscousHistory
from lab.materials import Material, PronyBranch

BRANCHES = (PronyBranch(ratio=0.5, time=0.02), PronyBranch(ratio=2.0, time=1.0), PronyBranch(ratio=0.1, time=50.0))
UNIT = np.array([[[1.0, -0.4, -0.4, 0.3, 0.0, 0.0]]])


def material(viscous_time=0.0, branches=BRANCHES):
    return Material(viscous_time=viscous_time, prony=branches)


def viscous(history, strains, step):
    """What stands beside E in the stress at the end of a step, as a multiple of UNIT."""
    viscosity, past = history.coefficients(step)
    return (viscosity * strains + past)[0, 0, 0]


def test_relaxation_after_a_jump_is_exact_for_any_steps():
    history = ViscousHistory.begin(material(), 0.0 * UNIT)
    assert viscous(history, UNIT, 1e-9) == pytest.approx(2.6, rel=1e-6)
    history, time = history.accept(UNIT, 1e-9), 0.0
    for step in (0.01, 0.5, 0.003, 20.0, 100.0):
        time += step
        expected = sum(b.ratio * np.exp(-time / b.time) for b in BRANCHES)
        assert viscous(history, UNIT, step) == pytest.approx(expected, rel=1e-6)
        history = history.accept(UNIT, step)


def test_a_steady_rate_is_exact_in_steps_far_longer_than_the_relaxation():
    # H = rate tau (1 - exp(-t/tau))
    history, rate, time = ViscousHistory.begin(material(), 0.0 * UNIT), 0.3, 0.0
    for step in (5.0, 0.1, 40.0):
        expected = sum(b.ratio * rate * b.time * -np.expm1(-(time + step) / b.time) for b in BRANCHES)
        time += step
        assert viscous(history, rate * time * UNIT, step) == pytest.approx(expected, rel=1e-12)
        history = history.accept(rate * time * UNIT, step)


def complex_modulus(steps, omega=3.0, viscous_time=0.05, cycles=12):
    """Modulus beyond the long-term one at ``omega`` (rad/s), from the last of some cycles."""
    made = material(viscous_time, BRANCHES[:2])
    history, step = ViscousHistory.begin(made, 0.0 * UNIT), 2 * np.pi / omega / steps
    response = []
    for n in range(1, cycles * steps + 1):
        strains = np.sin(omega * n * step) * UNIT
        response.append(viscous(history, strains, step))
        history = history.accept(strains, step)
    angle = omega * step * np.arange((cycles - 1) * steps + 1, cycles * steps + 1)
    return 2 / steps * (np.sin(angle) + 1j * np.cos(angle)) @ response[-steps:]


def test_complex_modulus_and_second_order_convergence():
    omega, tau = 3.0, 0.05
    exact = 1j * omega * tau + sum(b.ratio * 1j * omega * b.time / (1 + 1j * omega * b.time) for b in BRANCHES[:2])
    errors = [abs(complex_modulus(steps) - exact) / abs(exact) for steps in (25, 50, 100)]
    assert errors[-1] < 2e-3
    slopes = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(slopes, 2.0, atol=0.15)


def test_kelvin_voigt_takes_steps_of_unequal_length_to_second_order():
    # A parabola has an exact second-order difference.
    history, times = ViscousHistory.begin(material(0.1, ()), 0.0 * UNIT), (0.0, 0.2, 0.3, 0.7)
    for before, now in zip(times, times[1:], strict=False):
        value = viscous(history, now**2 * UNIT, now - before)
        if before > 0:
            assert value == pytest.approx(0.1 * 2 * now, rel=1e-12)
        history = history.accept(now**2 * UNIT, now - before)


def test_a_material_without_viscosity_costs_nothing():
    history = ViscousHistory.begin(material(0.0, ()), UNIT)
    assert history.coefficients(0.1) == (0.0, None)
    assert history.at_rate(UNIT) == (0.0, None)
    assert history.accept(2 * UNIT, 0.1) is history


def test_rate_and_branches_act_at_once():
    history = ViscousHistory.begin(material(0.1), 0.0 * UNIT).accept(UNIT, 1e-9)
    viscosity, past = history.at_rate(3.0 * UNIT)
    assert viscosity > 0
    np.testing.assert_allclose(past, (0.1 * 3.0 + 2.6) * UNIT, rtol=1e-6)


def test_stored_energy_of_branches():
    history = ViscousHistory.begin(material(), 0.0 * UNIT).accept(UNIT, 1e-9)
    energy = history.stored_energy(lambda strains: 4.0 * strains, np.array([[0.5]]))
    assert energy == pytest.approx(2.6 / 2 * 4.0 * 0.5 * np.sum(UNIT**2), rel=1e-6)


def test_histories_do_not_change():
    history = ViscousHistory.begin(material(), 0.0 * UNIT)
    history.accept(UNIT, 1.0)
    assert (history.strains == 0).all()
    assert (history.branches == 0).all()
