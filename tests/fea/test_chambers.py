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
def device_with(tops: float) -> Device:
    experiment = ShapePropagation(drive="pressure")
    model = MODEL.model_copy(update={"chamber_tops": tops})
    return set_up(TUBE, experiment, model, finned_surface(TUBE, COARSE, "quarter"))


def device() -> Device:
    return device_with(1.0)


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


@pytest.mark.parametrize("share", [0.0, 0.9])
def test_the_tangent_is_that_of_the_forces(share):
    """Also where tops have met their images: ``share`` flattens the tube, and neighbours touch where it folds."""
    x, way = 1e-4 * shaken(2), shaken(3)
    x[:, 1] -= share * device().points[:, 1]
    assert (row().report(x)["force of meeting tops [N]"] > 0) == (share > 0)
    unknowns = (3 * row().cells[:, :, None] + np.arange(3)).reshape(len(row().cells), 54)
    got = np.zeros(x.size)
    matrices = row().tangent(x, 1.0)
    np.add.at(got, unknowns, np.einsum("eij,ej->ei", matrices, way.ravel()[unknowns]))
    change = (row().force(x + 1e-8 * way, 1.0) - row().force(x - 1e-8 * way, 1.0)) / 2e-8
    assert got == pytest.approx(change.ravel(), abs=1e-5 * np.abs(change).max())
    assert matrices == pytest.approx(matrices.swapaxes(1, 2), abs=1e-12 * np.abs(matrices).max())


def test_forces_of_meeting_tops_derive_from_the_energy():
    x, way = 1e-4 * shaken(4), shaken(5)
    x[:, 1] -= 0.9 * device().points[:, 1]
    change = (row().energy(x + 1e-7 * way, 1.0) - row().energy(x - 1e-7 * way, 1.0)) / 2e-7
    assert float((row().force(x, 1.0) * way).sum()) == pytest.approx(change, rel=1e-4)


def test_fibres_only_push_where_neighbours_touch():
    """A tube that grows opens the gaps between the tops for nothing; one that shrinks by a fifth has closed them."""
    points = device().points * [1.0, 1.0, 0.0]
    tops = device_with(tops=0.0).chambers
    assert tops is not None
    assert tops.energy(0.05 * points, 0.0) == pytest.approx(0.0, abs=1e-9)
    assert tops.energy(-0.2 * points, 0.0) > 1e-3


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


@pytest.mark.parametrize("tops", [0.0, 1.0])
def test_chambers_flatten_the_tube_and_sweep_the_fins_up_to_40_psi(tops):
    """Bulging chambers meet their images beside the fins on the way, which ends the flattening; taut ones do not."""
    experiment = ShapePropagation(drive="pressure", increments=8)
    model = MODEL.model_copy(update={"chamber_tops": tops})
    record = perform(TUBE, experiment, model, finned_surface(TUBE, COARSE, "quarter"))
    assert record.completed, record.reason
    assert record["pressure"] == pytest.approx(np.linspace(0.0, experiment.pressure, 9))
    free = slice(None) if tops else slice(0, 6)
    assert (np.diff(record["travel"][free]) > 0).all()
    assert (np.diff(record["fin_angle"][free]) < 0).all()
    assert np.abs(record["force"]).max() < 1e-6
    assert bool(record.how["notes"]) == (not tops)


def test_walls_that_fold_let_air_flatten_the_tube_farther():
    """The stiffness along the tube decides: nobody knows it, so that it is a number of the performer."""
    experiment = ShapePropagation(drive="pressure", increments=4, pressure=1e5)
    reached = []
    for share in (1.0, 0.1):
        model = MODEL.model_copy(update={"chamber_walls": share})
        record = perform(TUBE, experiment, model, finned_surface(TUBE, COARSE, "quarter"))
        assert record.completed, record.reason
        reached.append(float(record["travel"][-1]))
    assert reached[1] > 1.3 * reached[0]


def test_edges_of_the_row_do_not_follow_the_elements():
    """Its volume is that between two cylinders, over its own angle and length."""
    finer = finned_surface(TUBE, COARSE.model_copy(update={"along": 10, "across": 6}), "quarter")
    for mesh in (finned_surface(TUBE, COARSE, "quarter"), finer):
        found = set_up(TUBE, ShapePropagation(drive="pressure"), MODEL, mesh).chambers
        assert found is not None
        inside, height = TUBE.inner_radius, CHAMBERS.height
        layer = SPAN / 4 * (inside**2 - (inside - height) ** 2) * CHAMBERS.length
        assert found.layer_volume == pytest.approx(layer, rel=0.02)


def test_other_halves_are_refused():
    with pytest.raises(ValueError, match="alike above and below"):
        set_up(TUBE, ShapePropagation(drive="pressure"), MODEL, finned_surface(TUBE, COARSE, "half-x"))
