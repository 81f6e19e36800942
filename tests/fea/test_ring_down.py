"""``RingDown``: compiled steps of shells against the general integrator, off-axis weights, own weight."""

import json

import numpy as np
import pytest

from fea import FeaModel, perform
from fea.carrier import Carrier
from fea.dynamics import Dynamics
from fea.hanging import hang
from fea.ring_down import _DYNAMIC_TOLERANCE, hanging_load
from fea.setting_up import make_part
from lab.experiments import RingDown
from lab.materials import Material
from lab.specimens import TwistedBeam
from meshes.block import beam_mesh, beam_surface
from meshes.options import MeshOptions

SPECIMEN = TwistedBeam(twist=np.pi / 2, tip_mass=0.5e-3)
EXPERIMENT = RingDown(duration=0.02)
COARSE = MeshOptions(along=5, across=2, grading_along=0.3, grading_across=0.0)
MODEL = FeaModel.model_validate({"element": "shell", "time_step": 0.7e-3})


@pytest.fixture(scope="module")
def mesh():
    return beam_surface(SPECIMEN, COARSE)


@pytest.fixture(scope="module")
def record(mesh):
    return perform(SPECIMEN, EXPERIMENT, MODEL, mesh)


def test_record(record):
    assert record.completed, record.reason
    assert record["markers"].shape == (EXPERIMENT.samples, 3, 3)
    assert record.how["mesh"]["element"] == "18-node solid shell"
    assert record.how["history"]["dynamic"]["steps"] == 4 * (EXPERIMENT.samples - 1)
    json.dumps(record.how)
    energy = record["kinetic_energy"] + record["strain_energy"]
    assert record["kinetic_energy"][0] == 0
    assert (np.diff(energy) < 0).all()
    assert record.fields.point_data["displacement"].values.shape[1:] == (len(record.fields.points), 3)


def test_same_motion_as_the_general_integrator(record, mesh):
    part = make_part(SPECIMEN, MODEL, mesh)
    slow = Dynamics(part, {"tip": SPECIMEN.tip_mass}, None, "auto", _DYNAMIC_TOLERANCE)
    picture = record.fields.point_data["displacement"].values[0][: part.nodes]
    start = picture.reshape(-1)[slow.free]
    carrier = Carrier(part, np.array(EXPERIMENT.markers))
    samples = slow.samples(slow.start(start, np.zeros_like(start)), 1 / EXPERIMENT.rate, EXPERIMENT.samples, 4)
    tip = np.array([carrier.read(slow.nodal(motion.u))[1] for motion in samples])
    np.testing.assert_allclose(record["tip"], tip, atol=3e-3 * np.abs(tip).max())


# ---------------------------------------------------------------- where the weight hangs, and the beam's own

HELD = MeshOptions(along=10, across=2, through=1, grading_along=0.3, grading_across=0.0)
SLENDER = TwistedBeam(length=0.1, width=0.010, thickness=0.001, twist=0.0)
Y_AXIS, Z_AXIS = ((0.0, 1e-2, 0.0), (0.0, -1e-2, 0.0)), ((0.0, 0.0, 1e-2), (0.0, 0.0, -1e-2))
GRAVITY = 9.81


def start_of(specimen, element="shell", **experiment):
    """Record of the start alone, markers at +-10 mm along y unless said."""
    model = FeaModel.model_validate({"element": element})
    one = RingDown.model_validate({"duration": 1 / 360, "markers": Y_AXIS} | experiment)
    return perform(specimen, one, model, (beam_surface if element == "shell" else beam_mesh)(specimen, HELD))


def turn_about_x(record):
    """Of the tip, rad, from markers on both sides along y; small."""
    return (record["markers"][0, 0, 2] - record["markers"][0, 1, 2]) / 0.02


def torsional_stiffness(specimen):
    """Saint-Venant's of a strip, the stretch of the outer fibres of a pre-twisted one included, N m^2."""
    width, thickness, modulus = specimen.width, specimen.thickness, specimen.material.youngs_modulus
    shear = modulus / (2 + 2 * specimen.material.poisson_ratio)
    rate = specimen.twist / specimen.length
    flat = shear * width * thickness**3 / 3 * (1 - 0.63 * thickness / width)
    return flat + modulus * width**5 * thickness * rate**2 / 180


@pytest.mark.parametrize("degrees", [0, 40, 80])
def test_a_weight_off_the_axis_turns_the_tip(degrees):
    specimen = SLENDER.model_copy(update={"twist": np.radians(degrees)})
    across = np.array([0.0, np.cos(specimen.twist), np.sin(specimen.twist)])
    weight, arm = 1e-6 * GRAVITY, 0.004
    record = start_of(
        specimen, load_mass=1e-6, load_place=tuple(arm * across), direction=np.pi / 2 + specimen.twist,
    )  # fmt: skip
    rate = weight * arm / torsional_stiffness(specimen)
    # The clamp keeps the section there from warping: one decay length, b sqrt((1 + nu) / 24), turns little.
    free = specimen.length - specimen.width * np.sqrt((1 + specimen.material.poisson_ratio) / 24)
    assert turn_about_x(record) == pytest.approx(rate * free, rel=0.06)
    centred = start_of(specimen, load_mass=1e-6, direction=np.pi / 2 + specimen.twist)
    assert abs(turn_about_x(centred)) < 0.01 * rate * free


@pytest.mark.parametrize("element", ["shell", "solid"])
def test_reactions_balance_a_weight_at_its_place_when_it_hangs_low(element):
    model = FeaModel.model_validate({"element": element})
    specimen = TwistedBeam(twist=np.pi / 2, tip_mass=5e-3)
    experiment = RingDown(load_place=(0.0, 0.001, 0.008), direction=0.3, own_weight=-1.0)
    part = make_part(specimen, model, (beam_surface if element == "shell" else beam_mesh)(specimen, HELD))
    carrier = Carrier(part, np.array([experiment.load_place]))
    start = hang(part, specimen, model, experiment.own_gravity, hanging_load(carrier, part, experiment))
    run, root = start.run, part.boundary("root")
    held = run.problem.out_of_balance(run.state(), 2.0)[root]
    force, moved = np.array(experiment.load), part.points + start.hung
    np.testing.assert_allclose(held.sum(axis=0), -force - start.weight.sum(axis=0), atol=1e-6)
    weight = (specimen.beam_mass + specimen.tip_mass) * GRAVITY
    assert np.linalg.norm(start.weight.sum(axis=0)) == pytest.approx(weight, rel=1e-6)
    hook = carrier.hung_at(np.array(experiment.load_place)) @ moved[carrier.nodes]
    moments = np.cross(moved[root], held).sum(axis=0) + np.cross(moved, start.weight).sum(axis=0)
    np.testing.assert_allclose(moments, -np.cross(hook, force), atol=1e-6)
    # The hook rides on the face: where a rigid one would have it, but for the face's strain.
    markers, _ = carrier.read(start.hung)
    centre = carrier.shares @ part.points[carrier.nodes] / carrier.shares.sum()
    assert np.linalg.norm(hook - centre - experiment.load_place - markers[0]) < 2e-4


def test_shares_of_a_weight_have_its_place_as_their_mean():
    part = make_part(SPECIMEN, MODEL, beam_surface(SPECIMEN, HELD))
    carrier = Carrier(part, np.zeros((1, 3)))
    for place in ((0.0, 0.0, 0.0), (0.0, 0.001, 0.01), (0.0, -0.0015, 0.004)):
        share = carrier.hung_at(np.array(place))
        assert share.sum() == pytest.approx(1.0)
        np.testing.assert_allclose(share @ carrier.arms, place, atol=1e-12)


@pytest.mark.parametrize("element", ["shell", "solid"])
def test_sag_under_the_own_weight(element):
    specimen = SLENDER.model_copy(update={"thickness": 0.003, "tip_mass": 2e-4})
    record = start_of(specimen, element, load_mass=1e-6, own_weight=-np.pi / 2)
    part = make_part(specimen, FeaModel.model_validate({"element": element}),
                     (beam_surface if element == "shell" else beam_mesh)(specimen, HELD))  # fmt: skip
    carrier = Carrier(part, np.zeros((1, 3)))
    whole = record.fields.point_data["displacement"].values[0][: part.nodes]
    sag = carrier.read(whole)[1] - record["tip"][0]
    bending = specimen.material.youngs_modulus * specimen.width * specimen.thickness**3 / 12
    length, weight = specimen.length, specimen.beam_mass * GRAVITY
    by_own = weight * length**3 / (8 * bending)
    by_tip = specimen.tip_mass * GRAVITY * length**3 / (3 * bending)
    # The clamp stiffens a wide strip, and so does so big a sag.
    assert 0.93 < -sag[2] / (by_own + by_tip) < 1.0
    assert abs(sag[1]) < 1e-6
    assert record["tip"][0, 1] == pytest.approx(
        1e-6 * GRAVITY * length**3 / (3 * bending) * (specimen.thickness / specimen.width) ** 2, rel=0.1
    )


def test_a_beam_held_up_at_its_tip_swings_about_its_rest_under_its_weight():
    """Let go from above: it ends at rest, which is where displacements count from, however far that sags."""
    specimen = SLENDER.model_copy(
        update={"thickness": 0.002, "tip_mass": 5e-4, "material": Material(viscous_time=0.05)}
    )
    experiment = RingDown(load_mass=1.4e-3, own_weight=-np.pi / 2, direction=np.pi / 2, duration=0.8, rate=50.0)
    model = FeaModel.model_validate({"element": "shell", "time_step": 4e-3})
    record = perform(specimen, experiment, model, beam_surface(specimen, COARSE))
    assert record["tip"][0, 2] > 5e-3
    assert np.abs(record["tip"][-1]).max() < 1e-3 * record["tip"][0, 2]


def test_own_weight_changes_nothing_in_the_linear_range():
    stiff = TwistedBeam(tip_mass=1e-3, material=Material(youngs_modulus=2e9))
    model = FeaModel.model_validate({"element": "shell", "time_step": 0.1e-3})
    one, other = (
        perform(stiff, RingDown(duration=0.01, own_weight=w), model, beam_surface(stiff, COARSE)) for w in (None, 0.7)
    )
    np.testing.assert_allclose(other["markers"], one["markers"], atol=2e-3 * np.abs(one["markers"]).max())


def test_too_heavy_a_beam_is_said_to_be_so():
    soft = SLENDER.model_copy(update={"mass": 1e9})
    record = start_of(soft, own_weight=0.5, load_mass=0.1)
    assert record.status == "diverged"
    assert record.reason.startswith("the own weight was reached to")
