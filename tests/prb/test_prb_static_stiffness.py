"""Records of the clamped static test."""

import numpy as np
import pytest

import prb
from lab.experiments import StaticStiffness
from lab.requests import Request
from lab.specimens import TwistedBeam
from prb.batch import Batch
from prb.declaration import checked
from prb.model import PrbModel
from prb.topologies import TOPOLOGIES

CHAIN = PrbModel(topology="gauss-chain")


@pytest.fixture(scope="module")
def record():
    return prb.perform(TwistedBeam(), StaticStiffness(increments=4), CHAIN)


def test_channels_have_the_agreed_names_and_shapes(record):
    assert record.status == "completed"
    assert record.origin == "prb"
    shapes = {name: (c.values.shape, c.dims) for name, c in record.channels.items()}
    table = ((24, 6), ("increment", "dof"))
    assert shapes == {
        "increment": ((24,), ("increment",)),
        "leg": ((24,), ("increment",)),
        "motion": table,
        "pose": table,
        "wrench": table,
        "tip_compliance": ((6, 6), ("dof", "wrench_dof")),
        "tangent_stiffness": ((6, 6), ("dof", "dof_moved")),
    }
    assert record["leg"].tolist() == sorted([*range(6)] * 4)
    assert record.how["parameters"]["E"] == {"value": 26e6, "unit": "Pa"}
    assert record.how["wall_time_s"] > 0


def test_a_rigid_rig_moves_the_tip_as_told(record):
    assert record["pose"] == pytest.approx(record["motion"], abs=1e-9)
    ends = record["motion"][3::4]
    turn = np.pi / 12
    assert ends[range(6), [1, 1, 2, 2, 3, 3]] == pytest.approx([5e-3, -5e-3, 5e-3, -5e-3, turn, -turn])


def test_the_tangent_at_rest_is_the_slope_of_the_record():
    small = StaticStiffness(translation=1e-6, rotation=1e-5, increments=1)
    record = prb.perform(TwistedBeam(), small, CHAIN)
    for row, dof in ((0, 1), (2, 2), (4, 3)):
        forth, back = record["wrench"][row], record["wrench"][row + 1]
        slope = (forth - back) / (record["motion"][row, dof] - record["motion"][row + 1, dof])
        tangent = record["tangent_stiffness"]
        assert slope == pytest.approx(tangent[:, dof], abs=1e-5 * np.abs(tangent[:, dof]).max())


def test_the_tangent_is_symmetric_and_k_prime_comes_out(record):
    tangent = record["tangent_stiffness"]
    assert tangent == pytest.approx(tangent.T, abs=1e-6)
    reduced = {name: scalar.value for name, scalar in StaticStiffness().reduce(record).items()}
    # Travel of 5 mm stretches a held beam, so that K' is stiffer than the tangent; never softer.
    assert reduced["k_yy"] > tangent[1, 1]
    assert reduced["p_xy"] > 0


def test_a_very_stiff_rig_is_a_rigid_one(record):
    stiff = prb.perform(TwistedBeam(), StaticStiffness(increments=4, rig_stiffness=1e10), CHAIN)
    assert stiff["wrench"] == pytest.approx(record["wrench"], rel=1e-4, abs=1e-4)


def test_a_compliant_rig_takes_its_share():
    rig = 500.0
    record = prb.perform(TwistedBeam(), StaticStiffness(increments=2, rig_stiffness=rig), CHAIN)
    assert record["wrench"][:, :3] == pytest.approx(rig * (record["motion"] - record["pose"])[:, :3], abs=1e-7)
    assert record["pose"][:, 3:] == pytest.approx(record["motion"][:, 3:], abs=1e-9)
    in_series = np.linalg.inv(record["tip_compliance"] + np.diag([1 / rig] * 3 + [0] * 3))
    assert record["tangent_stiffness"] == pytest.approx(in_series)


def test_mirror_images_have_opposite_coupling(record):
    mirrored = prb.perform(TwistedBeam(twist=-np.pi / 2), StaticStiffness(increments=4), CHAIN)
    one, other = (StaticStiffness().reduce(r) for r in (record, mirrored))
    for name, sign in (("k_yy", 1), ("k_zz", 1), ("k_yz", -1), ("k_zy", -1), ("n_xx", 1)):
        assert other[name].value == pytest.approx(sign * one[name].value, rel=1e-6)


@pytest.mark.parametrize("topology", ["five-hinge", "five-hinge-anisotropic"])
@pytest.mark.parametrize("rig", [None, 3000.0])
def test_a_model_that_cannot_follow_a_held_tip_says_so(topology, rig):
    record = prb.perform(TwistedBeam(), StaticStiffness(rig_stiffness=rig), PrbModel(topology=topology))
    assert record.status == "unsupported"
    assert record.reason.startswith("rank of the tip compliance is 4 of 6: the hinges cannot follow a held tip")
    assert record.scalars["rank"].value == 4
    assert list(record.channels) == ["tip_compliance"]
    assert np.linalg.matrix_rank(record["tip_compliance"], rtol=1e-9) == 4


def test_a_joint_without_a_spring_has_no_static_stiffness():
    document = TOPOLOGIES["five-hinge"].model_dump(mode="json")
    del document["bodies"][0]["joints"][0]["spring"]
    loose = checked(document, "test")
    record = prb.perform(TwistedBeam(), StaticStiffness(), PrbModel(topology=loose))
    assert record.status == "unsupported"
    assert record.reason.startswith("a joint has no spring at rest")
    batch = Batch(loose)
    assert batch([Request(TwistedBeam(), StaticStiffness(), loose.values(TwistedBeam(), {}))]) == [None]
    assert batch.failures[0] == record.reason
