"""Time integration, and ``RingDown`` performed."""

import json

import numpy as np
import pytest
from scipy.sparse.linalg import eigsh

from fea import FeaModel, perform
from fea.body import Body
from fea.dynamics import Blend, Dynamics
from lab.experiments import RingDown
from lab.materials import Material
from lab.specimens import TwistedBeam
from meshes.block import beam_mesh
from meshes.options import MeshOptions

COARSE = MeshOptions(along=6, across=2, through=1, grading_along=0.3)
SPECIMEN = TwistedBeam()


def plucked(viscous_time, rho=0.9, size=1e-3):
    """Dynamics, its first mode's shape (tip ``size`` m) and period (s)."""
    body = Body(beam_mesh(SPECIMEN, COARSE), Material(viscous_time=viscous_time))
    system = Dynamics(body, tolerance=1e-9, rho=rho)
    pattern, taken = body.pattern.restrict(system.free)
    stiffness = pattern.full(body.tangent(np.zeros((body.nodes, 3)))[1][taken])
    value, shape = eigsh(stiffness.tocsc(), 1, system.mass.tocsc(), sigma=0.0)
    return system, size * shape[:, 0] / np.abs(shape).max(), 2 * np.pi / np.sqrt(value[0])


def end_of_quarter(system, shape, period, steps):
    begin = system.start(0 * shape, shape * 2 * np.pi / period)
    *_, last = system.samples(begin, period / 4, 2, steps)
    return last.u


def test_blend_is_chung_and_hulberts():
    blend = Blend(1.0)
    assert (blend.alpha_m, blend.alpha_f, blend.beta, blend.gamma) == (0.5, 0.5, 0.25, 0.5)


@pytest.mark.parametrize("viscous_time", [0.0, 2e-3])
def test_second_order_in_time(viscous_time):
    system, shape, period = plucked(viscous_time, size=1e-5)
    ends = [end_of_quarter(system, shape, period, steps) for steps in (8, 16, 32, 64)]
    errors = [np.linalg.norm(b - a) for a, b in zip(ends, ends[1:], strict=False)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders[-1] == pytest.approx(2.0, abs=0.4)


def test_energy_is_kept_without_damping_and_lost_with_it():
    for viscous_time, low, high in ((0.0, 0.99, 1.005), (1e-3, 0.1, 0.9)):
        system, shape, period = plucked(viscous_time, rho=1.0, size=3e-3)
        begin = system.start(0 * shape, shape * 2 * np.pi / period)
        motions = list(system.samples(begin, period / 4, 5, 10))
        energies = np.array([system.kinetic_energy(m) + system.strain_energy(m) for m in motions])
        assert low < energies[-1] / energies[0] < high
        assert np.all(energies[1:] <= 1.01 * energies[:-1])


@pytest.fixture(scope="module")
def record():
    return perform(SPECIMEN, RingDown(duration=0.05), FeaModel(), beam_mesh(SPECIMEN, COARSE))


def test_record(record):
    assert record.completed, record.reason
    np.testing.assert_allclose(record["time"], np.arange(19) / 360)
    assert record["markers"].shape == (19, 3, 3)
    json.dumps(record.how)
    assert record["kinetic_energy"][0] == 0
    total = record["kinetic_energy"] + record["strain_energy"]
    assert np.all(np.diff(total) < 1e-3 * total[0])
    assert record["tip"][0, 1] > 0
    shown = record.fields.point_data["displacement"].values
    assert len(record.fields.values) == len(shown)
    assert record.fields.values[0] == 0
    # Markers at +-y average to the centre of the tip, moved by the carrier's turn only.
    np.testing.assert_allclose(record["markers"][:, :2].mean(axis=1), record["tip"], atol=1e-12)


def test_load_hangs_where_statics_says(record):
    # Internal forces at t = 0 balance the weight: work along a virtual lift of the tip.
    assert record["strain_energy"][0] > 0.3 * 0.2 * 9.81 * record["tip"][0, 1]
    assert record["strain_energy"][0] < 0.7 * 0.2 * 9.81 * record["tip"][0, 1]


def test_noise_is_seeded_and_said(record):
    experiment = RingDown(duration=0.05)
    model = FeaModel(noise=1e-4, seed=3, origin="virtual-lab")
    noisy = perform(SPECIMEN, experiment, model, beam_mesh(SPECIMEN, COARSE))
    expected = np.random.default_rng(3).normal(0, 1e-4, (19, 3, 3))
    np.testing.assert_allclose(noisy["markers"] - record["markers"], expected, atol=1e-12)
    assert noisy.origin == "virtual-lab"
    assert "seed 3" in noisy.how["history"]["noise"]


def test_absurd_load_is_a_record():
    # Neo-Hookean, because Saint Venant-Kirchhoff may give way without end.
    specimen = TwistedBeam(material=Material(law="neo-hookean", youngs_modulus=1e3))
    tiny = MeshOptions(along=1, across=1, through=1)
    record = perform(specimen, RingDown(load_mass=1e9, duration=0.01), FeaModel(), beam_mesh(specimen, tiny))
    assert record.status == "diverged"
    assert "the hanging load was reached to" in record.reason
    assert record["time"].shape == (0,)
