"""``BaseShake`` with shells: the linear orbit, the mirror law, and orbits that are not steady."""

import json

import numpy as np
import pytest

from fea import FeaModel, perform
from fea.carrier import Carrier
from fea.setting_up import make_part
from fea.shell_motion import ShellMotion
from lab.experiments import BaseShake
from lab.materials import Material
from lab.specimens import TwistedBeam
from meshes.block import beam_mesh, beam_surface
from meshes.options import MeshOptions

COARSE = MeshOptions(along=4, across=1, through=1, grading_along=0.0, grading_across=0.0)
MODEL = FeaModel.model_validate({"element": "shell", "time_step": 0.7e-3, "motion_mesh": COARSE})
SPECIMEN = TwistedBeam(twist=np.pi / 2, tip_mass=2e-3, material=Material(viscous_time=2e-3))


def shaken(experiment, specimen=SPECIMEN, model=MODEL):
    return perform(specimen, experiment, model, beam_surface(specimen, COARSE))


def linear_path(experiment, specimen=SPECIMEN):
    """Path of the tip's centre (samples, 3), m, by a complex solution of the linear equations."""
    part = make_part(specimen, MODEL, beam_surface(specimen, COARSE))
    motion, w = ShellMotion(part, {"tip": specimen.tip_mass}), 2 * np.pi * experiment.frequency
    pattern, taken = part.pattern.restrict(motion.free)
    stiffness = pattern.full(part.tangent(np.zeros((part.nodes, 3)))[1][taken]).toarray()
    carried = part.pattern.full(part.mass({"tip": specimen.tip_mass})).toarray()[motion.free][:, 2::3].sum(axis=1)
    dynamic = stiffness * (1 + 1j * w * part.material.viscous_time) - w**2 * motion.mass.toarray()
    shape = np.zeros(3 * part.nodes, complex)
    shape[motion.free] = np.linalg.solve(dynamic, w**2 * experiment.amplitude * carried)
    carrier = Carrier(part, np.zeros((1, 3)))
    tip = carrier.shares @ shape.reshape(-1, 3)[carrier.nodes] / carrier.shares.sum()
    return np.imag(tip * np.exp(1j * w * experiment.times)[:, None])


@pytest.mark.parametrize("frequency", [7.0, 24.0])
def test_small_orbit_is_that_of_the_linear_equations(frequency):
    experiment = BaseShake(frequency=frequency, amplitude=1e-6, tolerance=1e-4)
    record = shaken(experiment)
    assert record.completed, record.reason
    expected = linear_path(experiment)
    assert record["markers"].shape == (experiment.samples, 1, 3)
    # Steps of 0.65 and 0.7 ms leave some 0.3 % beside resonance.
    assert np.abs(record["tip"] - expected)[:, 1:].max() < 0.01 * np.abs(expected).max()
    assert record["time"][-1] == pytest.approx(1 / frequency)


def test_record_says_how_steady_it_is():
    record = shaken(BaseShake(frequency=24.0))
    assert record.completed
    assert record.scalars["change"].value < 1e-3
    assert record.scalars["periods"].value > 7
    dynamic = record.how["history"]["dynamic"]
    assert dynamic["steps"] == record.scalars["periods"].value * 64
    assert dynamic["time_step"] == pytest.approx(1 / 24 / 64)
    json.dumps(record.how)
    # The clamp's work is what damping takes: energies repeat.
    total = record["kinetic_energy"] + record["strain_energy"]
    assert total[-1] == pytest.approx(total[0], rel=0.02)
    assert record.fields.point_data["displacement"].values.shape[0] == 12


def test_opposite_chirality_mirrors_the_orbit():
    experiment = BaseShake(frequency=24.0, amplitude=2e-3)
    one, other = (shaken(experiment, SPECIMEN.model_copy(update={"twist": twist})) for twist in (np.pi / 2, -np.pi / 2))
    mirrored = other["markers"] * np.array([1.0, -1.0, 1.0])
    np.testing.assert_allclose(mirrored, one["markers"], atol=2e-4 * np.abs(one["markers"]).max())
    first, second = experiment.reduce(one), experiment.reduce(other)
    assert first["sense"].value == -second["sense"].value != 0
    assert first["tilt"].value == pytest.approx(-second["tilt"].value, abs=1e-3)


def test_an_orbit_that_is_not_steady_is_no_result_but_keeps_its_path():
    record = shaken(BaseShake(frequency=24.0, max_periods=8, tolerance=1e-6))
    assert record.status == "diverged"
    assert "not steady after 8 periods" in record.reason
    assert record["markers"].shape == (65, 1, 3)
    assert record.scalars["periods"].value == 8


def test_noise_is_that_of_the_seed():
    noisy = MODEL.model_copy(update={"noise": 1e-4, "origin": "virtual-lab"})
    experiment = BaseShake(frequency=24.0)
    clean, first, second = (shaken(experiment, model=m)["markers"] for m in (MODEL, noisy, noisy))
    np.testing.assert_array_equal(first, second)
    assert np.std(first - clean) == pytest.approx(1e-4, rel=0.3)


def test_solids_are_not_shaken():
    specimen, model = TwistedBeam(), FeaModel(motion_mesh=COARSE)
    record = perform(specimen, BaseShake(), model, beam_mesh(specimen, COARSE))
    assert record.status == "unsupported"
    assert "element: shell" in record.reason


def test_an_interrupted_motion_goes_on_as_if_it_were_not():
    part = make_part(SPECIMEN, MODEL, beam_surface(SPECIMEN, COARSE))
    motion, drive = ShellMotion(part, {"tip": 1e-3}), BaseShake(frequency=24.0).base.acceleration
    whole = motion.run(1e-3, 61, 2, base=drive)
    state = motion.begin(0.5e-3, drive(np.zeros(1))[0])
    parts = [motion.go_on(state, 1e-3, 31, 2, drive, since=since) for since in (0.0, 30e-3)]
    together = np.concatenate([parts[0].displacement, parts[1].displacement[1:]])
    np.testing.assert_allclose(together, whole.displacement, atol=1e-12)
    np.testing.assert_allclose(np.concatenate([parts[0].times, parts[1].times[1:]]), whole.times)
    np.testing.assert_allclose(parts[1].work, whole.work[30:], rtol=1e-9)
