"""Pressurised chambers under a shell: volume, balance, derivatives, and that they flatten a tube."""

from functools import cache

import numpy as np
import pytest

from fea import FeaModel, perform
from fea.chambers import ChamberRow
from fea.finned_device import Device, set_up
from lab.experiments import ShapePropagation
from lab.specimens import FinnedTube
from meshes.finned_tube import finned_surface
from meshes.options import MeshOptions

COARSE = MeshOptions(along=6, across=4, through=1, grading_along=0.0)
MODEL = FeaModel.model_validate({"element": "shell", "material": {"law": "neo-hookean"}})
TUBE = FinnedTube()
CHAMBERS = TUBE.chambers
SPAN = CHAMBERS.number * CHAMBERS.pitch(TUBE.inner_radius)


@cache
def device() -> Device:
    experiment = ShapePropagation(drive="pressure")
    return set_up(TUBE, experiment, MODEL, finned_surface(TUBE, COARSE, "quarter"))


def row() -> ChamberRow:
    found = device().chambers
    assert found is not None
    device().drive.goes(0.0, 1.0, 1e5)
    return found


def shaken(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=device().points.shape)


def test_turning_the_tube_does_no_work():
    points = device().points
    c, s = np.cos(0.7), np.sin(0.7)
    motion = points @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]]).T - points
    assert row().growth(motion) == pytest.approx(1.0, rel=1e-12)
    assert np.abs(row().force(0 * motion, 1.0).sum(axis=0)).max() < 1e-12


def test_forces_derive_from_the_energy():
    x, way = 1e-4 * shaken(0), shaken(1)
    for t in (0.0, 1.0):
        change = (row().energy(x + 1e-7 * way, t) - row().energy(x - 1e-7 * way, t)) / 2e-7
        assert float((row().force(x, t) * way).sum()) == pytest.approx(change, rel=1e-4)


def test_the_tangent_is_that_of_the_forces():
    x, way = 1e-4 * shaken(2), shaken(3)
    unknowns = (3 * row().cells[:, :, None] + np.arange(3)).reshape(len(row().cells), 54)
    got = np.zeros(x.size)
    np.add.at(got, unknowns, np.einsum("eij,ej->ei", row().tangent(x, 1.0), way.ravel()[unknowns]))
    change = (row().force(x + 1e-7 * way, 1.0) - row().force(x - 1e-7 * way, 1.0)) / 2e-7
    assert got == pytest.approx(change.ravel(), abs=1e-5 * np.abs(change).max())


def test_the_layer_of_a_straight_cylinder():
    """Only a cavity's share of the layer is filled: the pressure's work on a swollen radius is that of the cavities."""
    points = device().points
    radial = points * [1.0, 1.0, 0.0]
    grown = row().growth(1e-4 * radial) - 1.0
    # The floor's radius grows, the height does not.
    inside, height = TUBE.inner_radius, CHAMBERS.height

    def layer(radius: float) -> float:
        return radius**2 - (radius - height) ** 2

    assert grown == pytest.approx(layer(1.0001 * inside) / layer(inside) - 1.0, rel=1e-2)


def test_chambers_flatten_the_tube_and_sweep_the_fins():
    experiment = ShapePropagation(drive="pressure", pressure=5e4, increments=4)
    record = perform(TUBE, experiment, MODEL, finned_surface(TUBE, COARSE, "quarter"))
    assert record.completed, record.reason
    assert record["pressure"] == pytest.approx(np.linspace(0.0, 5e4, 5))
    assert (np.diff(record["travel"]) > 0).all()
    assert (np.diff(record["fin_angle"]) < 0).all()
    assert np.abs(record["force"]).max() < 1e-6


def test_other_halves_are_refused():
    with pytest.raises(ValueError, match="alike above and below"):
        set_up(TUBE, ShapePropagation(drive="pressure"), MODEL, finned_surface(TUBE, COARSE, "half-x"))
