"""Load frame at the tip: a rigid body by hand, beam theory with it, gravity, mirror law, topologies without a place."""

import copy

import mujoco
import numpy as np
import pytest

import prb
from lab.experiments import BaseShake, NaturalModes, RingDown
from lab.materials import Material
from lab.requests import Request
from lab.specimens import TwistedBeam
from lab.specimens.load_frame import LoadFrame
from prb.batch import Batch
from prb.declaration import checked
from prb.mechanism import Ballast, Hinge, Link, Mechanism
from prb.model import PrbModel
from prb.mujoco_model import build_spec, compile_mechanism, to_mjcf, write_mechanism
from prb.release import inertia_at
from prb.statics import Chain, Load, hang
from prb.topologies import TOPOLOGIES

FRAME = LoadFrame(width=0.04, height=0.03, mass=0.01, load=0.02, corner="upper-right")
BEAM = TwistedBeam(mass=0.00517, tip_mass=0.002, load_frame=FRAME, material=Material(viscous_time=8e-3))
BARE = BEAM.model_copy(update={"load_frame": None})
TWISTED = ["five-hinge", "gauss-chain", "gauss-strip"]


def with_frame_by_hand(mechanism: Mechanism, place: tuple[float, float, float]) -> mujoco.MjModel:
    """Model of a mechanism without ballast, four rods and a weight welded to its last link at ``place``."""
    spec = build_spec(mechanism)
    tip = spec.body(mechanism.links[-1].name)
    around, w, h = 2 * (FRAME.width + FRAME.height), FRAME.width, FRAME.height
    rods = [(h, (0, 0, side * w / 2), 1) for side in (-1, 1)] + [(w, (0, side * h / 2, 0), 2) for side in (-1, 1)]
    pieces = [(FRAME.mass * side / around, centre, side, axis) for side, centre, axis in rods]
    pieces.append((FRAME.load, (0.0, h / 2, -w / 2), 1e-6, 1))
    for number, (mass, centre, side, axis) in enumerate(pieces):
        body = tip.add_body(name=f"piece{number}", pos=np.add(place, centre))
        body.explicitinertial, body.mass, body.ipos = True, mass, [0, 0, 0]
        body.inertia = [1e-16 if i == axis else mass * side**2 / 12 for i in range(3)]
    return spec.compile()


@pytest.mark.parametrize("topology", TWISTED)
def test_the_frame_is_four_rods_and_a_weight_welded_to_the_tip(topology):
    one, other = (PrbModel(topology=topology).mechanism(beam).in_motion for beam in (BEAM, BARE))
    ours = compile_mechanism(one)
    theirs = with_frame_by_hand(other, other.tip[1])
    posture = np.random.default_rng(1).normal(scale=0.3, size=ours.nv)
    inertia, bias = [], []
    for model in (ours, theirs):
        data = mujoco.MjData(model)
        model.opt.gravity[:] = (1.0, -9.0, 3.0)
        inertia.append(inertia_at(model, data, posture))
        data.qvel[:] = np.arange(1.0, 1.0 + model.nv)
        mujoco.mj_forward(model, data)
        bias.append(data.qfrc_bias.copy())
    assert inertia[0] == pytest.approx(inertia[1], rel=1e-8, abs=1e-9 * inertia[1].max())
    assert bias[0] == pytest.approx(bias[1], rel=1e-9, abs=1e-9 * np.abs(bias[1]).max())


def test_the_mjcf_text_has_the_frame():
    mechanism = PrbModel(topology="gauss-strip").mechanism(BEAM).in_motion
    loaded, compiled = mujoco.MjModel.from_xml_string(to_mjcf(mechanism)), compile_mechanism(mechanism)
    assert loaded.body_mass.sum() == pytest.approx(BEAM.beam_mass + BEAM.tip_mass + FRAME.total_mass, rel=1e-5)
    posture = np.full(compiled.nv, 0.2)
    inertia = [inertia_at(model, mujoco.MjData(model), posture) for model in (loaded, compiled)]
    assert inertia[0] == pytest.approx(inertia[1], rel=1e-4, abs=1e-5 * inertia[1].max())


def test_a_rewritten_model_is_that_of_the_other_frame():
    chain = PrbModel(topology="gauss-chain")
    heavy = BEAM.model_copy(update={"load_frame": FRAME.model_copy(update={"load": 0.05, "corner": "lower-left"})})
    model = compile_mechanism(chain.mechanism(BEAM))
    for beam in (heavy, BARE, BEAM):
        mechanism = chain.mechanism(beam)
        fresh = compile_mechanism(mechanism)
        write_mechanism(model, mujoco.MjData(model), mechanism, ())
        posture = np.full(model.nv, 0.1)
        ours, theirs = (inertia_at(m, mujoco.MjData(m), posture) for m in (model, fresh))
        assert ours == pytest.approx(theirs, rel=1e-12, abs=1e-15)


def test_ballast_keeps_to_the_fixed_axes_on_a_link_that_is_turned():
    ballast = Ballast(0.03, (0.0, 0.02, -0.01), ((5e-6, 0.0, 0.0), (0.0, 2e-6, 1e-6), (0.0, 1e-6, 3e-6)))
    link = Link(
        "bar", 0.1, 1e-6, 1e-6, 1e-12, hinges=(Hinge("h", (0.0, 0.0, 1.0), 1.0, 0.0),), rotation=(0.3, -0.5, 0.7)
    )
    chain = Chain(compile_mechanism(Mechanism((link,), ballast=ballast)))
    tip = chain.tip(chain.slack).position
    assert chain.data.xipos[1] - tip == pytest.approx(ballast.centre, abs=1e-9)
    turn = chain.data.ximat[1].reshape(3, 3)
    assert turn @ np.diag(chain.model.body_inertia[1]) @ turn.T == pytest.approx(np.array(ballast.inertia), abs=1e-10)


@pytest.mark.parametrize("corner", ["upper-left", "lower-right"])
def test_modes_of_a_light_beam_are_those_of_its_tip_compliance_with_the_frame(corner):
    # Euler and Bernoulli's compliance of a cantilever's tip along x, y, z and about x, y, z, and the frame's mass.
    frame = LoadFrame(corner=corner)
    material = Material(youngs_modulus=26e6)
    beam = TwistedBeam(twist=0.0, mass=1e-7, load_frame=frame, material=material)
    model = PrbModel(topology="gauss-chain", settings={"stations": 8})
    found = prb.perform(beam, NaturalModes(count=5), model)
    length, flat, edge = beam.length, beam.width * beam.thickness**3 / 12, beam.thickness * beam.width**3 / 12
    compliance = np.zeros((6, 6))
    for shift, turn, inertia, sign in ((1, 5, edge, 1), (2, 4, flat, -1)):
        bending = 26e6 * inertia
        compliance[shift, shift], compliance[turn, turn] = length**3 / (3 * bending), length / bending
        compliance[shift, turn] = compliance[turn, shift] = sign * length**2 / (2 * bending)
    compliance[3, 3] = length / model.values(beam)["GJ"]
    mass = np.zeros((6, 6))
    points = [(frame.load, *frame.load_place[1:])]
    steps = (np.arange(2000) + 0.5) / 2000 - 0.5
    for along, across, swap in ((frame.height, frame.width, False), (frame.width, frame.height, True)):
        for side in (-0.5, 0.5):
            share = frame.mass * along / (2 * (frame.width + frame.height)) / len(steps)
            points += [(share, side * across, s * along) if swap else (share, s * along, side * across) for s in steps]
    for share, y, z in points:
        motion = np.hstack([np.eye(3), -np.array([[0, -z, y], [z, 0, 0], [-y, 0, 0]])])
        mass += share * motion.T @ motion
    inverse = np.sort(np.linalg.eigvals(compliance @ mass).real)[::-1]
    assert found["frequency"] == pytest.approx(1 / (2 * np.pi * np.sqrt(inverse[:5])), rel=1e-3)


def test_gravity_pulls_at_the_weight():
    # One hinge about x: the frame turns until its moment is that of the spring.
    bar = Link("bar", 0.05, 0.02, 0.003, 0.004, hinges=(Hinge("h", (1.0, 0.0, 0.0), 0.3, 0.0),))
    place = np.array(FRAME.load_place)
    ballast = Ballast(FRAME.load, tuple(place), ((0.0,) * 3,) * 3)
    gravity = np.array([0.0, -9.81, 0.0])
    [turn] = hang(Chain(compile_mechanism(Mechanism((bar,), ballast=ballast))), Load(np.zeros(3), None, gravity))
    turned = [place[1] * np.cos(turn) - place[2] * np.sin(turn), place[1] * np.sin(turn) + place[2] * np.cos(turn)]
    assert turn != 0
    assert 0.3 * turn == pytest.approx(turned[1] * FRAME.load * 9.81, rel=1e-9)


@pytest.mark.parametrize("topology", TWISTED)
def test_the_mirrored_beam_travels_the_mirrored_path_half_a_period_later(topology):
    experiment, model = BaseShake(frequency=8.0, tolerance=1e-5, own_weight=np.pi), PrbModel(topology=topology)
    path, other = (experiment.path(prb.perform(beam, experiment, model)) for beam in (BEAM, BEAM.mirrored()))
    half = experiment.samples_per_period // 2
    later = np.concatenate([path[half:-1], path[: half + 1]]) * [1, -1]
    assert other == pytest.approx(later, abs=2e-4 * np.abs(path).max())


def test_a_subharmonic_motion_is_called_so():
    # Twice the first frequency (4.0 Hz) and little damping: every other period is alike.
    beam = TwistedBeam(load_frame=LoadFrame(), material=Material(youngs_modulus=26e6, viscous_time=1e-3))
    experiment = BaseShake(frequency=8.0, max_periods=150, samples_per_period=16)
    record = prb.perform(beam, experiment, PrbModel(topology="gauss-chain", time_step=1e-3))
    assert record.status == "diverged"
    assert record.reason.endswith("it is a subharmonic motion, which repeats every 2 periods")


def test_a_batch_of_frames_and_weights_equals_single_records():
    beams = [BEAM, BARE, BEAM.mirrored()]
    experiments = [BaseShake(frequency=8.0, own_weight=np.pi), BaseShake(frequency=20.0), RingDown(own_weight=0.5)]
    model = PrbModel(topology="gauss-chain")
    requests = [Request(beam, e, model.values(beam)) for beam in beams for e in experiments]
    batch = Batch(TOPOLOGIES["gauss-chain"])
    for request, response in zip(requests, batch(requests), strict=True):
        record = prb.perform(request.specimen, request.experiment, model)
        assert response["markers"] == pytest.approx(record["markers"], abs=1e-9)


def test_a_topology_whose_tip_carries_nothing_refuses_the_frame():
    document = copy.deepcopy(TOPOLOGIES["gauss-chain"].model_dump(mode="json"))
    declared = checked(document | {"name": "thread", "tip": {"carries": False}}, "test")
    assert declared.build(BARE, declared.values(BARE, {})).ballast is None
    with pytest.raises(ValueError, match="topology thread has no place for the specimen's load_frame.*allowed:"):
        prb.perform(BEAM, RingDown(), PrbModel(topology=declared))
    batch = Batch(declared)
    assert batch([Request(BEAM, RingDown(), declared.values(BEAM, {}))]) == [None]
    assert "no place for the specimen's load_frame" in batch.failures[0]
