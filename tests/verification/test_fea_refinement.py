"""The default mesh against the mesh refined once: what the accuracy tables show stays within 1 %."""

import numpy as np
import pytest
from scipy.sparse.linalg import eigsh

from fea import FeaModel, perform
from fea.body import Body
from fea.dynamics import Dynamics
from fea.static_stiffness import tip_stiffness
from lab.experiments import KPRIME_ENTRIES, RingDown, StaticStiffness
from lab.specimens import TwistedBeam
from meshes.block import beam_mesh
from meshes.options import MeshOptions

TWISTS = [0, 45, 90]


def records_of(degrees, experiment):
    """Records on the mesh that the experiment gets by default, and on that refined once."""
    specimen, model = TwistedBeam(twist=np.deg2rad(degrees)), FeaModel()
    options = model.mesh_for(experiment)
    records = [perform(specimen, experiment, model, beam_mesh(specimen, o)) for o in (options, options.refined())]
    assert all(record.completed for record in records)
    return records


def both(degrees, experiment):
    """The experiment's numbers on both meshes."""
    return [experiment.reduce(record) for record in records_of(degrees, experiment)]


@pytest.mark.parametrize("degrees", TWISTS)
def test_tangent_at_rest(degrees):
    specimen = TwistedBeam(twist=np.deg2rad(degrees))
    tangents = []
    for options in (MeshOptions(), MeshOptions().refined()):
        tangents.append(tip_stiffness(Body(beam_mesh(specimen, options), specimen.material))[1:4, 1:4])
    coarse, fine = tangents
    there = np.abs(fine) > 1e-6 * np.sqrt(np.outer(np.diag(fine), np.diag(fine)))
    assert there.sum() == (3 if degrees == 0 else 5)
    np.testing.assert_allclose(coarse[there], fine[there], rtol=0.01)


def compare_stiffness(degrees, experiment):
    coarse, fine = both(degrees, experiment)
    largest = fine["k_yy"].value
    compared = 0
    for name, _ in KPRIME_ENTRIES:
        if name[0] in "kn" and abs(fine[name].value) > (0 if name == "n_xx" else 1e-3 * largest):
            assert coarse[name].value == pytest.approx(fine[name].value, rel=0.01), name
            compared += 1
    assert compared == (3 if degrees == 0 else 5)


@pytest.mark.slow
@pytest.mark.parametrize("degrees", [0, 45])
def test_stiffness_matrix(degrees):
    compare_stiffness(degrees, StaticStiffness(increments=3))


def test_stiffness_matrix_of_the_fully_twisted_beam():
    """The row of the table whose couplings converge last, in the normal run."""
    compare_stiffness(90, StaticStiffness(increments=3))


@pytest.mark.slow
def test_hanging_load():
    """Start of the ring-down; one sample interval is followed, to get a record."""
    coarse, fine = (r["markers"][0] for r in records_of(90, RingDown(direction=np.pi / 2, duration=1 / 360)))
    np.testing.assert_allclose(coarse.mean(axis=0)[1:], fine.mean(axis=0)[1:], rtol=0.01)


@pytest.mark.parametrize("degrees", TWISTS)
def test_first_frequency(degrees):
    specimen, frequencies = TwistedBeam(twist=np.deg2rad(degrees)), []
    for options in (FeaModel().motion_mesh, FeaModel().motion_mesh.refined()):
        system = Dynamics(Body(beam_mesh(specimen, options), specimen.material))
        pattern, taken = system.body.pattern.restrict(system.free)
        stiffness = pattern.full(system.body.tangent(np.zeros((system.body.nodes, 3)))[1][taken])
        square = eigsh(stiffness.tocsc(), 1, system.mass.tocsc(), sigma=0.0, return_eigenvectors=False)
        frequencies.append(np.sqrt(square.item()) / (2 * np.pi))
    assert frequencies[0] == pytest.approx(frequencies[1], rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("degrees", TWISTS)
def test_ring_down(degrees):
    direction = np.pi / 2 if degrees == 0 else 0.0
    coarse, fine = both(degrees, RingDown(direction=direction, duration=0.1))
    for name in ("release_y", "release_z", "frequency"):
        assert coarse[name].value == pytest.approx(fine[name].value, rel=0.01, abs=1e-6), name
