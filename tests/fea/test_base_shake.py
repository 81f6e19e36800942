"""``BaseShake`` with shells: the linear orbit, the mirror law, and orbits that are not steady."""

import json

import numpy as np
import pytest

from fea import FeaModel, perform
from fea.carrier import Carrier
from fea.hanging import hang
from fea.setting_up import make_part
from fea.shell_motion import ShellMotion
from lab.experiments import BaseShake
from lab.materials import Material
from lab.specimens import TwistedBeam
from lab.specimens.load_frame import LoadFrame
from meshes.block import beam_mesh, beam_surface
from meshes.options import MeshOptions

COARSE = MeshOptions(along=4, across=1, through=1, grading_along=0.0, grading_across=0.0)
MODEL = FeaModel.model_validate({"element": "shell", "time_step": 0.7e-3, "motion_mesh": COARSE})
SPECIMEN = TwistedBeam(twist=np.pi / 2, tip_mass=2e-3, material=Material(viscous_time=2e-3))


def shaken(experiment, specimen=SPECIMEN, model=MODEL):
    return perform(specimen, experiment, model, beam_surface(specimen, COARSE))


def linear_path(experiment, specimen=SPECIMEN):
    """Path of the tip's centre (samples, 3), m, from rest by a complex solution of the equations linear about it."""
    part = make_part(specimen, MODEL, beam_surface(specimen, COARSE))
    motion, w = ShellMotion(part, {"tip": specimen.tip_mass}), 2 * np.pi * experiment.frequency
    gravity, rest = experiment.own_gravity, np.zeros((part.nodes, 3))
    if gravity is not None:
        rest = hang(part, specimen, MODEL, gravity).rest
    pattern, taken = part.pattern.restrict(motion.free)
    elastic = part.tangent(rest)[1]
    # Viscous stress of the strain's rate alone: that of rest is taken out.
    viscous = part.tangent(rest, 1.0, -part.strains(rest))[1] - elastic
    stiffness, damping = (pattern.full(data[taken]).toarray() for data in (elastic, viscous))
    carried = part.pattern.full(part.mass({"tip": specimen.tip_mass})).toarray()[motion.free][:, 2::3].sum(axis=1)
    dynamic = stiffness + 1j * w * part.material.viscous_time * damping - w**2 * motion.mass.toarray()
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


HEAVY = TwistedBeam(
    twist=np.pi / 2, tip_mass=5e-3, load_frame=LoadFrame(width=0.02, height=0.02, mass=5e-3, load=2e-3),
    material=Material(viscous_time=15e-3),
)  # fmt: skip


@pytest.mark.parametrize("own_weight", [-np.pi / 2, np.pi])
def test_small_orbit_about_a_sagged_rest_is_that_of_the_equations_linear_there(own_weight):
    experiment = BaseShake(frequency=12.0, amplitude=1e-6, tolerance=1e-3, own_weight=own_weight)
    record = shaken(experiment, HEAVY)
    assert record.completed, record.reason
    expected = linear_path(experiment, HEAVY)
    level = linear_path(experiment.model_copy(update={"own_weight": None}), HEAVY)
    assert np.abs(record["tip"] - expected).max() < 0.01 * np.abs(expected).max()
    # Where the beam sags is felt: without it the path is another.
    assert np.abs(record["tip"] - level).max() > 0.03 * np.abs(expected).max()
    assert record.how["history"]["static"]
    json.dumps(record.how)


def test_mirror_law_holds_with_frame_and_gravity():
    """The mirror image in z = 0 of beam, frame and shake: the clamp runs the other way, half a period apart."""
    experiment = BaseShake(frequency=12.0, own_weight=np.pi)
    one, other = shaken(experiment, HEAVY), shaken(experiment, HEAVY.mirrored())
    assert one.completed, one.reason
    later = np.roll(one["markers"][:-1], -experiment.samples_per_period // 2, axis=0)
    mirrored = later * np.array([1.0, 1.0, -1.0])
    np.testing.assert_allclose(other["markers"][:-1], mirrored, atol=3e-3 * np.abs(mirrored).max())
    first, second = experiment.reduce(one), experiment.reduce(other)
    assert first["sense"].value == -second["sense"].value != 0


def test_a_beam_too_heavy_to_stand_its_weight_is_said_to_be_so():
    record = shaken(BaseShake(own_weight=0.5), SPECIMEN.model_copy(update={"mass": 1e9}))
    assert record.status == "diverged"
    assert record.reason.startswith("the own weight was reached to")
    assert record.fields.point_data["displacement"].values.shape[0] == 1
    json.dumps(record.how)


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


@pytest.mark.parametrize("specimen", [SPECIMEN, HEAVY])
def test_longer_steps_of_slow_shakes_change_the_orbit_by_little(specimen):
    experiment = BaseShake(frequency=3.0, tolerance=1e-4)
    counts = np.array([512, 256, 128, 64])
    models = [MODEL.model_copy(update={"steps_per_period": int(count)}) for count in counts]
    records = [shaken(experiment, specimen, model) for model in models]
    steps = [record.how["history"]["dynamic"]["time_step"] for record in records]
    np.testing.assert_allclose(steps, 1 / (3 * counts))
    fine = records[0]["markers"]
    errors = np.array([np.abs(record["markers"] - fine).max() / np.abs(fine).max() for record in records[1:]])
    assert errors[0] < 3e-4
    # Second order.
    assert errors[2] / errors[1] == pytest.approx(4.0, rel=0.2)


def test_an_orbit_that_is_not_steady_is_no_result_but_keeps_its_path():
    record = shaken(BaseShake(frequency=24.0, max_periods=8, tolerance=1e-6))
    assert record.status == "diverged"
    assert "not steady after 8 periods" in record.reason
    assert "more than the 0.0001 % that is allowed may be left" in record.reason
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
