"""Quantities that all models share: against beam theory, and for mechanisms that have none."""

import numpy as np
import pytest

from calibrate.at_rest import quantities_at_rest
from lab.materials import Material
from lab.specimens import TwistedBeam
from prb.model import PrbModel

FLAT = TwistedBeam(twist=0.0, material=Material(youngs_modulus=60e6, viscous_time=2e-3))


def of(model, specimen, **values):
    return quantities_at_rest(model, specimen, {**model.values(specimen), **values})


def test_a_chain_is_a_beam():
    found = of(PrbModel(topology="gauss-chain", settings={"stations": 10}), FLAT)
    inertia = FLAT.width * FLAT.thickness**3 / 12
    bending = 60e6 * inertia
    assert found["C_zz"].value == pytest.approx(FLAT.length**3 / (3 * bending), rel=1e-6)
    assert found["C_yy"].value == pytest.approx(found["C_zz"].value * (3 / 20) ** 2, rel=1e-6)
    # First bending mode of a cantilever, and stiffness-proportional damping.
    turning = 1.8751**2 * np.sqrt(bending / (FLAT.beam_mass * FLAT.length**3))
    assert found["f_1"].value == pytest.approx(turning / (2 * np.pi), rel=0.02)
    assert found["zeta_1"].value == pytest.approx(2e-3 * found["f_1"].value * np.pi, rel=1e-6)
    assert {s.unit for s in found.values()} == {"m/N", "rad/(N*m)", "Hz", "1"}


def test_torsion_is_the_inverse_of_its_rigidity():
    found = of(PrbModel(topology="gauss-chain"), FLAT, GJ=4e-3)
    assert found["C_rxrx"].value == pytest.approx(FLAT.length / 4e-3, rel=1e-9)


def test_parallel_hinges_have_no_modes():
    found = of(PrbModel(topology="five-hinge"), FLAT)
    assert set(found) == {"C_yy", "C_zz", "C_rxrx"}
