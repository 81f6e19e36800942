"""Load frame in elements: the inertia and weight of the rigid frame, a face that it holds, formulae of beams."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.spatial.transform import Rotation

from fea import Case, FeaModel, perform, vibrations
from fea.affine import affine_shares
from fea.coupled_mass import CoupledMass
from fea.coupled_scatter import coupled_scatter
from fea.hanging import hang
from fea.rigid_part import mean_rigid_motion
from fea.setting_up import make_part
from lab.experiments import BaseShake, NaturalModes, RingDown, StaticStiffness
from lab.materials import Material
from lab.specimens import TwistedBeam
from lab.specimens.load_frame import LoadFrame
from meshes.block import beam_mesh, beam_surface
from meshes.options import MeshOptions

COARSE = MeshOptions(along=5, across=2, through=1, grading_along=0.5, grading_across=0.0)
FRAME = LoadFrame(width=0.05, height=0.03, corner="upper-left")
BEAM = TwistedBeam(twist=np.pi / 2, root_angle=0.2, load_frame=FRAME)
BOTH = pytest.mark.parametrize("element", ["shell", "solid"])


def part_of(specimen, element, options=COARSE):
    mesh = (beam_surface if element == "shell" else beam_mesh)(specimen, options)
    return make_part(specimen, FeaModel.model_validate({"element": element}), mesh)


def bare(specimen):
    return specimen.model_copy(update={"load_frame": None})


def points_of(frame, length):
    """Places (n, 3), m, and masses (n,), kg, of a frame: many points along its sides, and the weight."""
    share = (np.arange(400) + 0.5) / 400 - 0.5
    y, z = frame.height * share, frame.width * share
    sides = [(y, half * np.ones_like(y)) for half in (-frame.width / 2, frame.width / 2)]
    sides += [(half * np.ones_like(z), z) for half in (-frame.height / 2, frame.height / 2)]
    around = 2 * (frame.width + frame.height)
    masses = [np.full(400, frame.mass * size / around / 400) for size in (frame.height,) * 2 + (frame.width,) * 2]
    places = np.vstack([*(np.column_stack([0 * a, a, b]) for a, b in sides), [frame.load_place]])
    return places + [length, 0, 0], np.append(np.concatenate(masses), frame.load)


@BOTH
@pytest.mark.parametrize("turn", [(0.0, 0.0, 0.0), (0.9, -0.5, 0.7)])
def test_a_rigid_motion_has_the_kinetic_energy_of_beam_and_rigid_frame(element, turn):
    """Whatever the beam has turned by before."""
    with_frame, without = part_of(BEAM, element), part_of(bare(BEAM), element)
    places, masses = points_of(FRAME, BEAM.length)
    frame_turned = Rotation.from_rotvec(turn)
    draw = np.random.default_rng(3)
    for _ in range(4):
        shift, spin = draw.normal(size=3), 30 * draw.normal(size=3)
        energies = []
        for part in (with_frame, without):
            velocity = shift + np.cross(spin, frame_turned.apply(part.points))
            flat = velocity.ravel()
            energies.append(0.5 * flat @ part.pattern.times(part.mass(), flat))
        speeds = np.linalg.norm(shift + np.cross(spin, frame_turned.apply(places)), axis=1)
        expected = 0.5 * float(masses @ speeds**2)
        # The block that holds the face has a thousandth of the frame's mass, near the axis.
        assert energies[0] - energies[1] == pytest.approx(expected, rel=2e-3)


@BOTH
def test_weight_acts_at_the_centre_of_mass(element):
    part = part_of(BEAM, element)
    nodal, own = Case(part).nodal_mass(), Case(part_of(bare(BEAM), element)).nodal_mass()
    assert nodal.sum() - own.sum() == pytest.approx(FRAME.total_mass, rel=1e-9)
    places, masses = points_of(FRAME, BEAM.length)
    moment = nodal @ part.points - own @ part_of(bare(BEAM), element).points
    np.testing.assert_allclose(moment[1:], (masses @ places)[1:], atol=2e-3 * FRAME.load * 0.02)
    assert moment[0] == pytest.approx(FRAME.total_mass * BEAM.length, rel=1e-3)


@BOTH
def test_modes_are_those_of_a_face_held_by_a_rigid_part(element):
    part, places = part_of(bare(BEAM), element), points_of(FRAME, BEAM.length)
    centre = places[1] @ places[0] / places[1].sum()
    arms = places[0] - centre
    squares = (places[1][:, None] * arms).T @ arms
    case = Case(part).fix("root")
    case.rigid("frame", "tip", at=centre, mass=places[1].sum(), inertia=np.trace(squares) * np.eye(3) - squares)
    expected = vibrations(case, 6).frequencies
    found = vibrations(Case(part_of(BEAM, element)).fix("root"), 6)
    assert found.missed == 0
    np.testing.assert_allclose(found.frequencies, expected, rtol=2e-3)
    # A mass that rides on the face's strain without the block would be too soft, and not only in high modes.
    moments = np.zeros((4, 4))
    moments[np.ix_([0, 2, 3], [0, 2, 3])] = FRAME.moments()
    riding = vibrations(Case(replace(part, coupled_mass=CoupledMass("tip", moments))).fix("root"), 4).frequencies
    assert riding[1] < 0.97 * expected[1]
    assert riding[3] < 0.9 * expected[3]


def test_frequencies_of_a_light_beam_with_an_eccentric_mass_are_those_of_beam_formulae():
    """Six numbers of the tip: both bendings, torsion and stretch, all coupled by where the weight sits."""
    material = Material(youngs_modulus=50e6, poisson_ratio=0.0, density=1.0)
    frame = LoadFrame(width=0.008, height=0.03, mass=2e-3, load=6e-3, corner="upper-left")
    beam = TwistedBeam(length=0.1, width=0.01, thickness=0.002, twist=0.0, material=material, load_frame=frame)
    options = MeshOptions(along=16, across=2, through=1, grading_along=0.7, grading_across=0.0)
    found = vibrations(Case(part_of(beam, "shell", options)).fix("root"), 5).frequencies
    modulus, length, ratio = material.youngs_modulus, beam.length, beam.thickness / beam.width
    weak, strong = (modulus * beam.area * size**2 / 12 for size in (beam.thickness, beam.width))
    torsion = modulus / 2 * beam.width * beam.thickness**3 / 3 * (1 - 0.63 * ratio)
    # The clamp and the frame hinder warping: b / sqrt(24) of the length at either end turns little.
    free = length - 2 * beam.width / np.sqrt(24)
    stiffness = np.diag([modulus * beam.area / length, 0, 0, torsion / free, 0, 0])
    for rigidity, moved, turned, sense in ((strong, 1, 5, 1), (weak, 2, 4, -1)):
        block = rigidity / length**3 * np.array([[12, -6 * sense * length], [-6 * sense * length, 4 * length**2]])
        stiffness[np.ix_([moved, turned], [moved, turned])] = block
    mass = np.zeros((6, 6))
    for place, share in zip(*points_of(frame, 0.0), strict=True):
        moves = np.hstack([np.eye(3), -np.cross(np.eye(3), place)])
        mass += share * moves.T @ moves
    expected = np.sqrt(eigh(stiffness, mass, eigvals_only=True)) / (2 * np.pi)
    # Shear, which the formulae leave out, and warping limit the agreement.
    np.testing.assert_allclose(found, expected[:5], rtol=0.03)


@BOTH
def test_elements_write_what_they_wrote_without_the_coupling(element):
    part = part_of(bare(BEAM), element)
    wide = coupled_scatter(part.cells, part.nodes, part.boundary("tip"))
    moved = 1e-5 * np.random.default_rng(1).normal(size=part.points.shape)
    nodes = np.ix_(part.boundary("tip"), part.boundary("tip"))
    room = wide.pattern.full(np.ones(len(wide.pattern.indices))).toarray()[::3, ::3]
    assert (room[nodes] > 0).all()
    framed = replace(part, coupled_mass=CoupledMass("tip", np.diag([1e-2, 0, 1e-6, 1e-6])))
    expected, found = (p.pattern.full(p.tangent(moved)[1]).toarray() for p in (part, framed))
    np.testing.assert_allclose(found, expected, atol=1e-12 * np.abs(expected).max())


def test_shares_carry_an_affine_motion_exactly():
    draw = np.random.default_rng(5)
    arms, weights = draw.normal(size=(20, 3)), draw.uniform(1, 2, 20)
    arms -= weights @ arms / weights.sum()
    gradient, shift, place = draw.normal(size=(3, 3)), draw.normal(size=3), draw.normal(size=3)
    shares = affine_shares(arms, weights)
    np.testing.assert_allclose(shares @ [1.0, *place] @ (shift + arms @ gradient.T), shift + gradient @ place)


def test_mass_off_the_plane_of_the_face_is_refused():
    moments = np.diag([1e-2, 1e-6, 1e-6, 1e-6])
    part = part_of(bare(BEAM), "shell")
    with pytest.raises(ValueError, match="must lie in its plane"):
        CoupledMass("tip", moments).between(part)


def test_a_pattern_without_room_for_the_coupling_says_so():
    part = part_of(bare(BEAM), "shell")
    with pytest.raises(ValueError, match="no room"):
        part.pattern.places(np.array([0]), np.array([3 * part.nodes - 1]))


@BOTH
def test_the_block_is_part_of_no_measured_length(element):
    """The tip stays where it was, elements and boundaries keep their order and names."""
    part, plain = part_of(BEAM, element), part_of(bare(BEAM), element)
    assert part.points[part.boundary("tip"), 0] == pytest.approx(BEAM.length)
    assert part.points[:, 0].max() == pytest.approx(BEAM.length + BEAM.thickness)
    np.testing.assert_allclose(part.volumes[: len(plain.cells)], plain.volumes, rtol=1e-9)
    np.testing.assert_allclose(part.shares("tip").sum(), plain.shares("tip").sum(), rtol=1e-9)
    assert part.volumes.sum() - plain.volumes.sum() == pytest.approx(BEAM.area * BEAM.thickness, rel=1e-6)


@BOTH
def test_mirror_images_vibrate_alike(element):
    one, other = (vibrations(Case(part_of(b, element)).fix("root"), 4) for b in (BEAM, BEAM.mirrored()))
    np.testing.assert_allclose(other.frequencies, one.frequencies, rtol=1e-6)


def test_statics_do_not_feel_the_frame():
    model = FeaModel.model_validate({"element": "shell"})
    experiment = StaticStiffness(translation=1e-3, rotation=0.05, increments=1)
    one, other = (perform(b, experiment, model, beam_surface(b, COARSE)) for b in (BEAM, bare(BEAM)))
    np.testing.assert_allclose(one["wrench"], other["wrench"], atol=1e-9 * np.abs(other["wrench"]).max())


@BOTH
def test_a_hung_frame_pulls_where_a_rigid_one_is(element):
    part, model = part_of(BEAM, element), FeaModel.model_validate({"element": element})
    gravity = np.array([0.0, -9.81, 0.0])
    start = hang(part, BEAM, model, tuple(gravity))
    assert not start.reason
    root, tip, moved = part.boundary("root"), part.boundary("tip"), part.points + start.rest
    held = start.run.problem.out_of_balance(start.run.state(), 1.0)[root]
    weight = (BEAM.beam_mass + FRAME.total_mass) * 9.81
    np.testing.assert_allclose(held.sum(axis=0), [0.0, weight, 0.0], atol=1e-4 * weight)
    share = part.shares("tip")[tip]
    centre, turn = mean_rigid_motion(part.points[tip] - [BEAM.length, 0, 0], share, start.rest[tip])
    places, masses = points_of(FRAME, 0.0)
    frame = np.cross(places @ turn.T + centre + [BEAM.length, 0, 0], np.outer(masses, gravity)).sum(axis=0)
    own = np.outer(Case(replace(part, coupled_mass=None)).nodal_mass(), gravity)
    expected = frame + np.cross(moved, own).sum(axis=0)
    moment = np.cross(moved[root], held).sum(axis=0)
    np.testing.assert_allclose(moment, -expected, atol=2e-3 * np.abs(expected).max())


def test_ring_down_swings_with_the_frame():
    """Small release: both kinds of element swing in the first natural vibration."""
    beam = BEAM.model_copy(update={"material": Material(viscous_time=0.0)})
    model = FeaModel.model_validate({"element": "shell", "time_step": 4e-3})
    first = perform(beam, NaturalModes(count=1), model, beam_surface(beam, COARSE))["frequency"][0]
    experiment = RingDown(load_mass=1e-6, duration=1.0, rate=100.0, direction=np.pi / 2)
    record = perform(beam, experiment, model, beam_surface(beam, COARSE))
    assert record.completed, record.reason
    assert experiment.reduce(record)["frequency"].value == pytest.approx(first, rel=0.02)


def test_shaking_below_resonance_follows_the_frame():
    """Far below resonance the relative displacement is the static one under the inertia of frame and beam."""
    beam = BEAM.model_copy(update={"material": Material(youngs_modulus=26e8, viscous_time=1e-3)})
    model = FeaModel.model_validate({"element": "shell", "time_step": 2e-3})
    experiment = BaseShake(frequency=2.0, amplitude=1e-4, ramp_periods=2, tolerance=5e-3)
    record = perform(beam, experiment, model, beam_surface(beam, COARSE))
    assert record.completed, record.reason
    push = 1e-4 * (2 * np.pi * 2.0) ** 2
    part = part_of(beam, "shell")
    bent = hang(part, beam, model, (0.0, 0.0, push))
    share = part.shares("tip") / part.shares("tip").sum()
    size = np.ptp(record["tip"], axis=0) / 2
    np.testing.assert_allclose(size[1:], np.abs(share @ bent.rest)[1:], rtol=0.02, atol=0.02 * size.max())
