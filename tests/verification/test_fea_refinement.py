"""The default mesh against the mesh refined once: what the accuracy tables show stays within 1 %."""

import numpy as np
import pytest

from fea import FeaModel, perform
from fea.body import Body
from fea.held_tip import HeldTip
from lab.experiments import KPRIME_ENTRIES, RingDown, StaticStiffness
from lab.specimens import TwistedBeam
from meshes.block import beam_mesh
from meshes.options import MeshOptions

TWISTS = [0, 45, 90]


def both(degrees, experiment):
    """The experiment's numbers on the default mesh and on the refined one."""
    specimen = TwistedBeam(twist=np.deg2rad(degrees))
    meshes = (MeshOptions(), MeshOptions().refined())
    records = [perform(specimen, experiment, FeaModel(), beam_mesh(specimen, options)) for options in meshes]
    assert all(record.completed for record in records)
    return [experiment.reduce(record) for record in records]


@pytest.mark.parametrize("degrees", TWISTS)
def test_tangent_at_rest(degrees):
    specimen = TwistedBeam(twist=np.deg2rad(degrees))
    tangents = []
    for options in (MeshOptions(), MeshOptions().refined()):
        held = HeldTip(Body(beam_mesh(specimen, options), specimen.material), np.full(6, np.inf))
        tangents.append(held.tangent_stiffness(held.rest, 0.0)[1:4, 1:4])
    coarse, fine = tangents
    there = np.abs(fine) > 1e-6 * np.sqrt(np.outer(np.diag(fine), np.diag(fine)))
    assert there.sum() == (3 if degrees == 0 else 5)
    np.testing.assert_allclose(coarse[there], fine[there], rtol=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("degrees", TWISTS)
def test_stiffness_matrix(degrees):
    coarse, fine = both(degrees, StaticStiffness(increments=2))
    largest = fine["k_yy"].value
    compared = 0
    for name, _ in KPRIME_ENTRIES:
        if name[0] in "kn" and abs(fine[name].value) > (0 if name == "n_xx" else 1e-3 * largest):
            assert coarse[name].value == pytest.approx(fine[name].value, rel=0.01), name
            compared += 1
    assert compared == (3 if degrees == 0 else 5)


@pytest.mark.slow
@pytest.mark.parametrize("degrees", TWISTS)
def test_ring_down(degrees):
    direction = np.pi / 2 if degrees == 0 else 0.0
    coarse, fine = both(degrees, RingDown(direction=direction, duration=0.1))
    for name in ("release_y", "release_z", "frequency"):
        assert coarse[name].value == pytest.approx(fine[name].value, rel=0.01, abs=1e-6), name
