"""The reduced model against the full one."""

import numpy as np
import pytest

from fea.reduced import reduced, shaken
from fea.shell import Shell
from fea.shell_motion import ShellMotion
from lab.experiments.shaking import SmoothShake
from lab.materials import Material
from meshes.structured import surface_mesh

TURN = np.pi / 2


def twisted(counts, material):
    def place(a, b):
        y, angle = 0.02 * (b - 0.5), TURN * a
        return np.stack([0.05 * a, y * np.cos(angle), y * np.sin(angle)], axis=1)

    return Shell(surface_mesh(counts, place, ("root", "tip", "side", "side")), 0.003, material)


@pytest.fixture(scope="module")
def motion():
    return ShellMotion(twisted((3, 1), Material()), {"tip": 1e-4})


@pytest.fixture(scope="module")
def model(motion):
    return reduced(motion, shaken(motion, (0.0, 0.0, 2e-3), (10.0, 27.0, 40.0), 0.4), 10)


def difference(model, motion, **how):
    tip = motion.shell.boundary("tip")
    ours, full = (m.run(1e-3, 401, kept=tip, **how).displacement.mean(axis=1) for m in (model, motion))
    return np.sqrt(((ours - full) ** 2).sum() / (full**2).sum())


@pytest.mark.parametrize("frequency", [17.0, 25.0, 33.0])
def test_repeats_drives_it_was_not_trained_on(model, motion, frequency):
    assert difference(model, motion, base=SmoothShake((0.0, 0.0, 2e-3), frequency).acceleration) < 0.005


def test_more_shapes_are_better(motion):
    snapshots = shaken(motion, (0.0, 0.0, 2e-3), (27.0,), 0.4)
    drive = SmoothShake((0.0, 0.0, 2e-3), 27.0).acceleration
    errors = [difference(reduced(motion, snapshots, count), motion, base=drive) for count in (2, 5, 10)]
    assert errors[2] < 0.3 * errors[1] < 0.1 * errors[0]


def test_energy_is_the_full_models(model, motion):
    driven = model.run(1e-3, 151, base=SmoothShake((0.0, 0.0, 2e-3), 27.0).acceleration)
    bent = driven.displacement[np.argmax(driven.strain)]
    start = model.run(1e-3, 1, u=bent, v=bent)
    np.testing.assert_allclose(start.displacement[0], bent, atol=1e-12)
    assert start.strain[0] == pytest.approx(motion.shell.strain_energy(bent).sum(), rel=1e-4)
    free = bent.reshape(-1)[motion.free]
    assert start.kinetic[0] == pytest.approx(0.5 * free @ (motion.mass @ free), rel=1e-9)


def test_energy_goes_where_the_full_model_sends_it(model, motion):
    drive = SmoothShake((0.0, 0.0, 2e-3), 25.0).acceleration
    ours, full = (m.run(1e-3, 201, base=drive) for m in (model, motion))
    for name in ("kinetic", "strain", "work"):
        np.testing.assert_allclose(getattr(ours, name), getattr(full, name), atol=2e-2 * getattr(full, name).max())


def test_refuses_other_laws():
    motion = ShellMotion(twisted((1, 1), Material(law="neo-hookean")))
    with pytest.raises(ValueError, match="neo-hookean"):
        reduced(motion, np.zeros((3, motion.shell.nodes, 3)), 1)


def test_refuses_more_shapes_than_snapshots(motion):
    with pytest.raises(ValueError, match="independent"):
        reduced(motion, np.ones((3, motion.shell.nodes, 3)), 5)
