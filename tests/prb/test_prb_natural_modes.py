"""Natural modes: closed forms, Maxwell branches, massless motions, the ring-down, mirror images."""

import numpy as np
import pytest

import prb
from lab.experiments import NaturalModes, RingDown
from lab.materials import Material
from lab.measures import dominant_mode
from lab.requests import Request
from lab.specimens import TwistedBeam
from prb.batch import Batch
from prb.declaration import checked
from prb.mechanism import Branch, Hinge, Link, Mechanism, Tie
from prb.model import PrbModel
from prb.mujoco_model import compile_mechanism
from prb.statics import Chain
from prb.topologies import TOPOLOGIES
from prb.vibration import Modes, vibrations

Z = (0.0, 0.0, 1.0)
INERTIA = 0.02 * (0.2**2 / 3 + 0.03**2 / 12)


def bar(*hinges: Hinge) -> Link:
    return Link("bar", 0.2, 0.03, 0.01, 0.02, hinges=hinges)


def modes_of(mechanism: Mechanism, count: int = 6) -> Modes:
    return vibrations(mechanism, Chain(compile_mechanism(mechanism)), count)


def test_a_bar_on_a_hinge():
    found = modes_of(Mechanism((bar(Hinge("h", Z, 0.3, 1e-3)),)))
    turning = np.sqrt(0.3 / INERTIA)
    assert found.frequencies == pytest.approx([turning / (2 * np.pi)])
    assert found.damping_ratios == pytest.approx([1e-3 / (2 * np.sqrt(0.3 * INERTIA))])
    assert abs(found.shapes) == pytest.approx(np.array([[1 / np.sqrt(INERTIA)]]))


def test_a_branch_stiffens_at_the_frequency_of_its_mode():
    stiffness, time = 0.2, 0.01
    found = modes_of(Mechanism((bar(Hinge("h", Z, 0.3, 0.0, branches=(Branch(stiffness, time),))),)))
    turning = 2 * np.pi * found.frequencies[0]
    square = (turning * time) ** 2
    assert INERTIA * turning**2 == pytest.approx(0.3 + stiffness * square / (1 + square), rel=1e-9)
    loss = stiffness * time / (1 + square)
    assert found.damping_ratios[0] == pytest.approx(loss / (2 * INERTIA * turning), rel=1e-9)


def test_two_hinges_at_one_place_are_springs_in_series():
    found = modes_of(Mechanism((bar(Hinge("one", Z, 0.3, 0.0), Hinge("two", Z, 0.6, 0.0)),)))
    assert found.frequencies == pytest.approx([np.sqrt(0.2 / INERTIA) / (2 * np.pi)], rel=1e-9)


def test_a_tie_stiffens_and_damps_what_it_couples():
    # About z and about -y, tied to move against each other: only the difference feels the tie.
    hinges = Hinge("z", Z, 0.3, 0.0), Hinge("y", (0.0, -1.0, 0.0), 0.3, 0.0)
    link = Link("bar", 0.2, 0.01, 0.01, 0.02, hinges=hinges)
    inertia = 0.02 * (0.2**2 / 3 + 0.01**2 / 12)
    found = modes_of(Mechanism((link,), ties=(Tie("tie", (("z", 1.0), ("y", -1.0)), 0.2, damping=1e-3),)))
    assert 2 * np.pi * found.frequencies == pytest.approx(np.sqrt([0.3 / inertia, 0.7 / inertia]), rel=1e-9)
    assert found.damping_ratios == pytest.approx([0.0, 2e-3 / (2 * np.sqrt(0.7 * inertia))], abs=1e-12)


def test_a_chain_of_many_stations_is_a_cantilever():
    beam = TwistedBeam(length=0.2, width=0.01, thickness=0.002, twist=0.0, material=Material(youngs_modulus=26e6))
    record = prb.perform(beam, NaturalModes(count=8), PrbModel(topology="gauss-chain", settings={"stations": 16}))
    per_length, rigidity = beam.beam_mass / beam.length, 26e6 * 0.01 * 0.002**3 / 12
    roots = np.array([1.8751041, 4.6940911, 7.8547574])  # cos x cosh x = -1
    flat = roots**2 / (2 * np.pi * beam.length**2) * np.sqrt(rigidity / per_length)
    expected = np.sort([*flat, 5 * flat[0]])
    tip = record["tip"]
    bending = np.array(NaturalModes.kinds(record)) == "bending"
    assert record["frequency"][bending][:4] == pytest.approx(expected, rel=0.01)
    # At a modal mass of 1 kg the tip of every bending mode of a cantilever moves by 2 / sqrt(mass).
    assert np.hypot(tip[:, 1], tip[:, 2])[bending][:2] == pytest.approx(2 / np.sqrt(beam.beam_mass), rel=0.01)


@pytest.mark.parametrize("topology", ["gauss-chain", "gauss-strip", "five-hinge-anisotropic"])
def test_the_first_mode_is_that_of_a_small_ring_down(topology):
    beam = TwistedBeam(twist=0.7, tip_mass=0.01)
    released = RingDown(load_mass=1e-4, direction=np.pi / 2, duration=0.5)
    model = PrbModel(topology=topology, parameters={"tau": 2e-4}, time_step=2e-4)
    record = prb.perform(beam, released, model)
    swing, _ = dominant_mode(record["time"], record["tip"][:, 1:])
    assert prb.perform(beam, NaturalModes(), model)["frequency"][0] == pytest.approx(swing, rel=2e-3)


def test_mirror_images_have_the_same_frequencies_and_mirrored_shapes():
    beam, model = TwistedBeam(twist=1.0, root_angle=0.2), PrbModel(topology="gauss-strip")
    one, other = (prb.perform(b, NaturalModes(), model) for b in (beam, beam.mirrored()))
    assert one["frequency"] == pytest.approx(other["frequency"], rel=1e-9)
    mirrored = one["tip"] * [1, 1, -1, -1, -1, 1]
    mirrored *= np.sign(np.sum(mirrored * other["tip"], axis=1, keepdims=True))
    assert other["tip"] == pytest.approx(mirrored, abs=1e-6 * np.abs(mirrored).max())


def test_a_record_has_one_state_per_mode_and_says_what_is_missing():
    beam = TwistedBeam(tip_mass=0.002)
    record = prb.perform(beam, NaturalModes(), PrbModel(topology="five-hinge"))
    assert record.completed
    assert {n: (c.values.shape, c.dims) for n, c in record.channels.items()} == {
        "mode": ((5,), ("mode",)),
        "frequency": ((5,), ("mode",)),
        "tip": ((5, 6), ("mode", "dof")),
    }
    assert record.how["missing"] == "the last 1 of 6 modes: the mechanism has only 5"
    assert list(NaturalModes().reduce(record)) == ["f_1", "f_2", "f_3", "f_4", "f_5"]
    displacement = record.fields.point_data["displacement"].values
    assert displacement.shape == (5, len(record.fields.points), 3)
    assert np.linalg.norm(displacement, axis=2).max(axis=1) == pytest.approx(0.1 * beam.length, rel=0.1)
    full = prb.perform(beam, NaturalModes(), PrbModel(topology="gauss-chain"))
    assert "missing" not in full.how
    assert (np.diff(full["frequency"]) > 0).all()


def test_torsion_shows_in_the_picture():
    record = prb.perform(TwistedBeam(twist=0.0), NaturalModes(), PrbModel(topology="gauss-chain"))
    torsion = NaturalModes.kinds(record).index("torsion")
    corners = record.fields.point_data["displacement"].values[torsion].reshape(-1, 4, 3)
    assert corners.mean(axis=1) == pytest.approx(0, abs=1e-9)
    assert np.abs(corners[-1, :, 2]).max() > 0.09 * 0.05


def test_a_joint_without_a_spring_is_unsupported():
    document = TOPOLOGIES["hinge-chain"].model_dump(mode="json")
    document["bodies"][1]["joints"][0]["spring"] = 0
    declared, beam = checked(document, "test"), TwistedBeam()
    record = prb.perform(beam, NaturalModes(), PrbModel(topology=declared))
    assert record.status == "unsupported"
    assert "give every joint a spring" in record.reason
    batch = Batch(declared)
    assert batch([Request(beam, NaturalModes(), declared.values(beam, {}))]) == [None]
    assert batch.failures == {0: record.reason}
