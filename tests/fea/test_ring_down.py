"""``RingDown`` with shells: compiled steps against the general integrator."""

import json

import numpy as np
import pytest

from fea import FeaModel, perform
from fea.dynamics import Dynamics
from fea.ring_down import _DYNAMIC_TOLERANCE, Carrier
from fea.setting_up import make_part
from lab.experiments import RingDown
from lab.specimens import TwistedBeam
from meshes.block import beam_surface
from meshes.options import MeshOptions

SPECIMEN = TwistedBeam(twist=np.pi / 2, tip_mass=0.5e-3)
EXPERIMENT = RingDown(duration=0.02)
MODEL = FeaModel.model_validate({"element": "shell", "time_step": 0.7e-3})


@pytest.fixture(scope="module")
def mesh():
    return beam_surface(SPECIMEN, MeshOptions(along=5, across=2, grading_along=0.3, grading_across=0.0))


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
