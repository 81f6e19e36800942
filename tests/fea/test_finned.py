"""Tubes with fins: pinch, symmetry, energy, pushed fins, refusals; on meshes as coarse as they may be."""

from functools import cache

import numpy as np
import pytest

from fea import FeaModel, perform
from fea.batch import Batch
from fea.finned_device import set_up
from fea.finned_sensing import fitted_radius, largest_strain
from fea.newton import DivergedError
from fea.plate_edge import PlateEdge
from fea.sheet import Sheet
from lab.experiments import FinPush, NaturalModes, ShapePropagation
from lab.experiments.fin_drive import FIN_STAGES
from lab.records import Record
from lab.requests import Request
from lab.specimens import FinnedTube
from meshes import make_mesh, read_mesh
from meshes.finned_tube import PARTS, finned_surface
from meshes.options import MeshOptions
from meshes.structured import surface_mesh

COARSE = MeshOptions(along=6, across=4, through=1, grading_along=0.0)
MODEL = FeaModel.model_validate({"element": "shell", "material": {"law": "neo-hookean"}, "fin_mesh": COARSE})
TUBE = FinnedTube()


def done(experiment, part="quarter", model=MODEL) -> Record:
    return perform(TUBE, experiment, model, finned_surface(TUBE, COARSE, part))


@cache
def pinched() -> Record:
    return done(ShapePropagation(increments=12))


@cache
def pushed(sense: str) -> Record:
    return done(FinPush(travel=0.0, push=0.006, sense=sense, push_increments=6))


def test_a_pinch_sweeps_the_fin_towards_the_tube():
    record = pinched()
    found = {name: scalar.value for name, scalar in ShapePropagation().reduce(record).items()}
    assert record.completed, record.reason
    assert not record.how["notes"]
    assert record["travel"] == pytest.approx(np.linspace(0.0, 0.033, 13), abs=1e-12)
    assert found["s"] == pytest.approx(0.013, rel=0.06)
    assert found["stroke"] > np.deg2rad(15.0)
    assert record["p"][-1, 0] < 0 < record["p"][-1, 2]
    # The crease becomes more curved, the tip does not.
    assert found["y_fin"] > 0.5e-3 > 100 * abs(found["y"])
    assert record.how["pinched_length_m"] == pytest.approx(TUBE.chambers.length)
    assert record["gap"][[0, -1]] == pytest.approx([0.047, 0.014], abs=5e-4)
    assert (np.diff(record["force"]) > 0).all()


def test_the_work_of_the_pinch_is_the_elastic_energy():
    record = pinched()
    # The force is that on one side, and the travel that of both.
    work = np.trapezoid(record["force"], record["travel"])
    assert record["energy"][-1] == pytest.approx(work, rel=5e-3)


def test_increments_do_not_matter():
    few = done(ShapePropagation(increments=4))
    assert few["p"][-1] == pytest.approx(pinched()["p"][-1], abs=1e-7)


@pytest.mark.parametrize("part", [part for part in PARTS if part != "quarter"])
def test_mirrors_do_not_matter(part):
    experiment = ShapePropagation(travel=0.008, increments=4)
    one, other = done(experiment), done(experiment, part)
    assert other.how["mirrors"] == {"whole": "", "half": "y", "half-x": "x"}[part]
    for name in ("p", "force", "energy", "section", "gap", "fin_radius", "fin_angle", "strain"):
        assert other[name] == pytest.approx(one[name], rel=1e-6, abs=1e-9), name


def test_sensors_at_rest():
    record = pinched()
    assert record["fin_radius"][0] == pytest.approx(TUBE.mid_radius, rel=1e-6)
    # The root of the crown lies half-way between the two faces' on the outside of the tube.
    assert record["fin_angle"][0] == pytest.approx(TUBE.attachment_angle, abs=1e-6)
    assert np.hypot(*record["section"][0].T) == pytest.approx(np.full(64, TUBE.mid_radius), rel=2e-4)
    assert record["section"][0][16] == pytest.approx([0.0, TUBE.mid_radius], abs=1e-6)


def test_turning_the_whole_device_strains_nothing():
    device = set_up(TUBE, ShapePropagation(), MODEL, finned_surface(TUBE, COARSE, "whole"))
    c, s = np.cos(1.3), np.sin(1.3)
    turned = (
        device.points @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]]).T @ np.array([[1, 0, 0], [0, s, -c], [0, c, s]])
    )
    motion = turned - device.points
    first = 0
    for part in device.parts:
        own = motion[first : first + part.nodes]
        assert largest_strain(part, own) < 1e-12
        assert np.abs(part.internal_force(own)).max() < 1e-9 * 7.8e6 * TUBE.wall * TUBE.radius
        first += part.nodes
    # Ties are met by it: what rides on the tube comes along.
    ties = device.problem.links.ties
    assert ties @ motion.ravel() == pytest.approx(motion.ravel(), abs=1e-10)


@pytest.mark.parametrize("element", ["solid", "shell"])
def test_fins_ride_on_single_nodes_of_the_wall(element):
    model = MODEL.model_copy(update={"fin_element": element})
    device = set_up(TUBE, ShapePropagation(), model, finned_surface(TUBE, COARSE, "quarter"))
    through = device.fin.through[device.fin.edge("crease")]
    ties = device.problem.links.ties.tocsr()
    rows = ties[(3 * through.ravel()[:, None] + np.arange(3)).ravel()]
    assert np.diff(rows.indptr).tolist() == [1] * rows.shape[0]
    assert rows.data == pytest.approx(np.ones(rows.shape[0]))
    assert through.shape[1] == (3 if element == "solid" else 2)


def test_fins_of_shells_have_a_softer_joint():
    shells = done(ShapePropagation(increments=12), model=MODEL.model_copy(update={"fin_element": "shell"}))
    turned, solid = (float(np.hypot(*record["p"][-1, [0, 2]])) for record in (shells, pinched()))
    assert 1.02 < turned / solid < 1.2
    assert shells.how["mesh"]["element"] == "18-node solid shell"
    assert pinched().how["mesh"]["element"] == "18-node solid shell, 27-node hexahedron"
    assert pinched().how["unknowns"] > shells.how["unknowns"]


def test_strains_on_faces_of_a_bent_fin():
    """Pure bending to a circle, whose strain is linear through the thickness, of both kinds of elements."""
    radius, size, thickness = 0.05, 0.02, 0.002
    mesh = surface_mesh((4, 2), lambda a, b: np.column_stack([size * (a - 0.5), size * b, 0 * a]))
    half = np.tile([0.0, 0.0, thickness / 2], (mesh.doflocs.shape[1], 1))
    for element in ("solid", "shell"):
        part = Sheet.make(mesh, half, TUBE.material, element, 0).part
        x, _, z = part.points.T
        bent = np.column_stack([(radius + z) * np.sin(x / radius) - x, 0 * x, (radius + z) * np.cos(x / radius)])
        bent[:, 2] -= radius + z
        # ((r + z) / r)^2 - 1 over 2 at z = t/2; quadratic elements follow the circle to a few parts in ten thousand.
        stretch = 1.0 + thickness / 2 / radius
        assert largest_strain(part, bent) == pytest.approx((stretch**2 - 1) / 2, rel=2e-2)


@pytest.mark.parametrize(("sense", "sign"), [("opposite", 1), ("equal", -1)])
def test_a_plate_bends_the_fin_in_its_sense(sense, sign):
    record = pushed(sense)
    assert record.completed, record.reason
    assert record["stage"].tolist() == [0] + [FIN_STAGES.index("push")] * 6
    assert record["push"][1:] == pytest.approx(np.linspace(0.001, 0.006, 6))
    assert (np.diff(record["force"]) > 0).all()
    assert (sign * np.diff(record["fin_angle"]) > 0).all()
    assert np.isnan(record["contact"][0])
    assert record["contact"][1] == pytest.approx(0.85 * TUBE.fin_length, rel=0.05)
    # Both fins are pushed in a quarter; viscous stress and the spring of the plate take a little.
    work = 2 * np.trapezoid(record["force"], record["push"])
    assert record["energy"][-1] == pytest.approx(work, rel=0.03)


def test_pushing_one_fin_alone_is_what_pushing_both_is():
    one = done(FinPush(travel=0.0, push=0.003, sense="equal", push_increments=4), "half")
    both = np.interp(one["push"], pushed("equal")["push"], pushed("equal")["force"])
    assert one["force"] == pytest.approx(both, rel=0.05, abs=1e-3)


def test_the_edge_slides_along_and_off():
    """One element standing along z, its free end above: the edge crosses it at half height, and at none."""
    points = np.array([[0.0, 0, 0], [0, 0, 0.5], [0, 0, 1.0]])
    edge = PlateEdge(np.array([[0, 1, 2]]), np.ones(1), points[None, :, 2], points, 100.0, 1e-3)
    still = np.zeros((3, 3))
    edge.meet(still, np.array([1.0, 0, 0]), np.array([0.0, 0, 1]), np.array([0.0, 0, 0.5]))
    assert edge.prepare(still)
    edge.way.goes(0.0, 1.0, 0.1)
    assert edge.pressing(still, 1.0) == pytest.approx(10.0, rel=1e-3)
    assert edge.place(still, 1.0) == pytest.approx(0.5)
    sunk = still - [0, 0, 0.25]
    edge.prepare(sunk)
    assert edge.place(sunk, 1.0) == pytest.approx(0.75)
    slope = edge.tangent(sunk, 1.0)[0]
    step = np.random.default_rng(1).normal(size=(3, 3))
    change = (edge.force(sunk + 1e-6 * step, 1.0) - edge.force(sunk - 1e-6 * step, 1.0)) / 2e-6
    assert slope @ step.ravel() == pytest.approx(change.ravel(), abs=1e-6)
    edge.prepare(still - [0, 0, 0.75])
    assert edge.pressing(still, 1.0) == 0.0
    # It is under the plate now: were it caught again, the plate would be a tenth of a metre deep in it.
    edge.prepare(still)
    assert edge.pressing(still, 1.0) == 0.0
    edge.meet(still, np.array([1.0, 0, 0]), np.array([0.0, 0, 1]), np.array([0.0, 0, 0.5]))
    assert edge.pressing(still, 1.0) > 0.0


def test_a_fin_that_slips_off_the_plate_ends_the_push():
    record = done(FinPush(travel=0.0, push=0.03, sense="opposite", push_increments=12, place=0.98))
    assert record.completed, record.reason
    assert "slipped off the plate" in record.how["notes"][0]
    assert 0.0 < record["push"][-1] < 0.03
    assert record["force"].max() < 0.5


def test_pictures_show_rest_middle_and_end():
    fields = pinched().fields
    assert fields.values.tolist() == [0.0, 6.0, 12.0] or fields.values.tolist() == [0.0, 7.0, 12.0]
    assert fields.point_data["displacement"].values.shape[0] == 3


def test_a_lost_path_is_tried_again_slowly_and_then_told(monkeypatch):
    import fea.finned_stages as stages

    def lost(system, path, end, options, history):
        raise DivergedError("no way", path.parameters[-1], path.states[-1])

    monkeypatch.setattr(stages, "follow", lost)
    record = done(ShapePropagation(increments=4))
    assert record.status == "diverged"
    assert "stage pinch stopped at 0 %" in record.reason
    assert "steadying viscosity" in record.how["notes"][0]


def test_meshes_from_files_serve(tmp_path):
    path = tmp_path / "fins.msh"
    make_mesh(TUBE, COARSE, path, "shell", "quarter")
    record = perform(TUBE, ShapePropagation(increments=4), MODEL, read_mesh(path))
    assert record["p"][-1] == pytest.approx(pinched()["p"][-1], abs=1e-7)


def test_the_model_chooses_mesh_and_part():
    assert MODEL.part_for(ShapePropagation()) == "quarter"
    assert MODEL.part_for(NaturalModes()) == "whole"
    assert MODEL.model_copy(update={"fin_part": "whole"}).part_for(FinPush()) == "whole"
    assert MODEL.mesh_for(FinPush()) == COARSE


def test_a_batch_gives_the_records_channels():
    batch = Batch(MODEL)
    specimen = MODEL.applied_to(TUBE)
    (found,) = batch([Request(specimen, ShapePropagation(increments=12))])
    assert not batch.failures
    assert found["p"] == pytest.approx(pinched()["p"], abs=1e-9)


def test_refusals():
    mesh = finned_surface(TUBE, COARSE, "quarter")
    assert "not for a FinnedTube" in perform(TUBE, NaturalModes(), MODEL, mesh).reason
    with pytest.raises(ValueError, match="element 'shell'"):
        perform(TUBE, ShapePropagation(), FeaModel(), mesh)
    with pytest.raises(ValueError, match="more than the inside"):
        perform(TUBE, ShapePropagation(travel=0.05), MODEL, mesh)
    with pytest.raises(ValueError, match="thickness belongs to twisted beams"):
        MODEL.model_copy(update={"thickness": 0.002}).applied_to(TUBE)


def test_circle_through_points():
    angle = np.linspace(-0.5, 0.4, 9)
    arc = 0.02 * np.column_stack([np.cos(angle), np.sin(angle), 0 * angle]) + [1.0, 2.0, 3.0]
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    assert fitted_radius(arc @ turn) == pytest.approx(0.02, rel=1e-6)
    assert fitted_radius(np.outer(np.arange(4.0), [1.0, 1.0, 0.0])) == np.inf
