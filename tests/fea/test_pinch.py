"""Pinched tubes: closing, symmetry, energy, bending, recovery, refusals; on meshes as coarse as they may be."""

from functools import cache

import numpy as np
import pytest

from fea import FeaModel, perform, pinching
from fea.batch import Batch
from fea.newton import DivergedError
from lab.experiments import NaturalModes, Pinch, PinchedBending, ShapeRecovery
from lab.experiments.pinch_drive import STAGES
from lab.materials import Material
from lab.records import Record
from lab.requests import Request
from lab.specimens import PinchedTube, TwistedBeam
from meshes.options import MeshOptions
from meshes.tube import tube_solid, tube_surface

COARSE = MeshOptions(along=8, across=6, through=1, grading_along=0.0)
MODEL = FeaModel(element="shell")
ELASTIC = Material(poisson_ratio=0.3, viscous_time=0.0)
#: Without imperfection, so that symmetries are exact.
EVEN = PinchedTube(imperfection=0.0, material=ELASTIC)
#: One pair, which allows the coarsest mesh; no pads to speak of.
BARE = PinchedTube(
    pairs=1, pad_width=0.01, pad_fillet=0.01, pad_height=0.0, pad_stiffening=1.0, imperfection=0.0, material=ELASTIC
)


def eighth(experiment: Pinch, model: FeaModel = MODEL, specimen: PinchedTube = EVEN) -> Record:
    return perform(specimen, experiment, model, tube_surface(specimen, COARSE, "eighth"))


def whole(specimen: PinchedTube, experiment: Pinch | PinchedBending, model: FeaModel = MODEL) -> Record:
    return perform(specimen, experiment, model, tube_surface(specimen, COARSE))


@cache
def closed() -> Record:
    return eighth(Pinch(increments=20))


def test_closes_where_the_pads_meet():
    record = closed()
    found = {name: scalar.value for name, scalar in Pinch(increments=20).reduce(record).items()}
    assert record.completed, record.reason
    assert not record.how["notes"]
    # Inner faces of two pads: 2 (radius - wall - height).
    assert found["touch_travel"] == pytest.approx(0.044, rel=0.01)
    assert found["closing_force"] >= found["touch_force"] > 5.0
    assert record["contact_force"][-1] >= 0.1 * record["force"][-1]
    assert record["contact_force"][-2] < 0.1 * record["force"][-2]
    assert record["stage"].tolist() == [0] + [STAGES.index("pinch")] * (len(record["stage"]) - 1)
    assert found["deformation_axis"] == pytest.approx(0.0, abs=1e-6)


def test_pictures_show_the_states_that_matter():
    record = closed()
    shown = record.fields.values.astype(int)
    first = int(np.flatnonzero(record["contact_force"] > 0)[0])
    assert {0, first, len(record["force"]) - 1} <= set(shown.tolist())
    assert len(shown) <= 5


def test_section_keeps_its_length_and_closes_on_itself():
    section = closed()["section"]
    lengths = np.linalg.norm(np.roll(section, -1, axis=1) - section, axis=2).sum(axis=1)
    # Under the pads the middle of the wall lies a little farther in.
    assert lengths[0] == pytest.approx(2 * np.pi * 0.0245, rel=0.03)
    assert lengths == pytest.approx(lengths[0], rel=0.05)
    area = 0.5 * np.sum(np.cross(section[0], np.roll(section[0], -1, axis=0)))
    assert area == pytest.approx(np.pi * 0.0245**2, rel=0.05)


def test_work_of_the_tendons_becomes_elastic_energy():
    record = eighth(Pinch(force_limit=4.0, increments=80), MODEL.model_copy(update={"steadying": 0.0}))
    work = float(np.trapezoid(record["force"], record["travel"]))
    assert record["energy"][-1] == pytest.approx(work, rel=5e-3)


def test_no_touch_is_a_result_with_a_note():
    record = eighth(Pinch(force_limit=2.0))
    assert record.completed
    assert record["force"][-1] == pytest.approx(2.0, rel=0.1)
    assert record.how["notes"] == [
        f"the pinch ended at the limit of 2 N, F_p = {record['force'][-1]:.4g} N: its walls do not touch"
    ]
    assert np.isnan(Pinch().reduce(record)["closing_force"].value)


def test_an_eighth_is_the_whole_where_nothing_buckles():
    experiment = Pinch(force_limit=2.0, increments=20)
    small, large = eighth(experiment), whole(EVEN, experiment)
    assert large["travel"] == pytest.approx(small["travel"], rel=1e-3, abs=1e-9)
    assert large["force"] == pytest.approx(small["force"], rel=1e-3)
    assert large["energy"] == pytest.approx(small["energy"], rel=1e-3, abs=1e-9)
    assert large["pose"][-1] == pytest.approx(small["pose"][-1], abs=1e-7)
    assert large["strain"] == pytest.approx(small["strain"], rel=1e-2, abs=1e-9)
    order = np.argsort(np.arctan2(*small["section"][0].T[::-1]))
    assert large["section"][-1] == pytest.approx(small["section"][-1][order], abs=2e-6)


def test_turned_by_one_pair_is_the_same_pinch():
    one, other = (
        whole(EVEN, Pinch(force_limit=2.0, increments=12, pinch_angle=angle)) for angle in (0.0, 2 * np.pi / 3)
    )
    assert other["force"] == pytest.approx(one["force"], rel=1e-6)
    assert other["pair_force"][:, [1, 2, 0]] == pytest.approx(one["pair_force"], abs=1e-6)
    turn = np.pi / 3
    matrix = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    expected = matrix @ one["flexibility"][-1][3:5, 3:5] @ matrix.T
    assert other["flexibility"][-1][3:5, 3:5] == pytest.approx(expected, rel=1e-5, abs=1e-6)


def test_forces_keep_their_ratio():
    record = whole(EVEN, Pinch(force_limit=2.0, increments=12, pinch_angle=np.deg2rad(30)))
    ratio = record["pair_force"][1:] / record["force"][1:, None]
    expected = [np.cos(np.pi / 8), np.sin(np.pi / 8), 0.0]
    assert ratio == pytest.approx(np.broadcast_to(expected, ratio.shape), abs=1e-9)


@cache
def bent(**changes: float) -> Record:
    values = {"pinched": False, "load": 2.0, "bend_increments": 2, **changes}
    return whole(BARE, PinchedBending.model_validate({k: v for k, v in values.items() if v is not None}))


def test_the_open_tube_bends_as_a_beam_with_shear():
    radius, wall, length, nu = 0.0245, 1e-3, 0.1, 0.3
    inertia, area = np.pi * radius**3 * wall, 2 * np.pi * radius * wall
    modulus, shear = 26e6, 26e6 / (2 * (1 + nu))
    # Cowper (1966), thin round tube.
    kappa = 2 * (1 + nu) / (4 + 3 * nu)
    expected = 1 / (length**3 / (3 * modulus * inertia) + length / (kappa * shear * area))
    record = bent()
    found = PinchedBending(pinched=False, load=2.0).reduce(record)["k"].value
    assert found == pytest.approx(expected, rel=0.05)
    assert record["pose"][-1][[0, 5]] == pytest.approx(0.0, abs=1e-9)
    assert record["load"] == pytest.approx([0.0, 1.0, 2.0])


def test_a_place_beyond_the_face_has_a_longer_arm():
    record, place = bent(place=0.02), 0.02
    flexibility = record["flexibility"][0]
    # Down by force, and by its moment about x at the face; the point turns along.
    arm = np.zeros(6)
    arm[1], arm[3] = -1.0, place
    moved = flexibility @ (2.0 * arm)
    assert record["pushed"][-1] == pytest.approx(-(moved[1] - place * moved[3]), rel=0.01)
    assert record["pose"][-1] == pytest.approx(moved, rel=0.02, abs=1e-5)


def test_a_push_finds_the_force_of_the_load_and_goes_back():
    load = bent()
    by = float(load["pushed"][-1])
    push = bent(load=None, push=by, returns=True)
    assert push["load"][2] == pytest.approx(2.0, rel=0.01)
    # What is left is viscous.
    assert push["load"][-1] == pytest.approx(0.0, abs=5e-3)
    assert push["stage"].tolist() == [0, 3, 3, 4, 4]
    soft = bent(load=None, push=2 * by, rig_stiffness=2.0 / by)
    assert soft["pushed"][-1] == pytest.approx(by, rel=0.01)


@pytest.mark.slow
def test_solids_pinch_as_shells_do():
    options = MeshOptions(along=16, across=12, through=1, grading_along=0.0)
    experiment, force = Pinch(force_limit=3.0, increments=12), []
    for element, mesh in (("solid", tube_solid), ("shell", tube_surface)):
        record = perform(EVEN, experiment, FeaModel(element=element), mesh(EVEN, options, "eighth"))
        assert record.completed, record.reason
        force.append(np.interp([0.002, 0.006], record["travel"], record["force"]))
    assert force[0] == pytest.approx(force[1], rel=0.07)


def test_a_pinched_tube_comes_to_rest_before_it_is_bent():
    experiment = PinchedBending(load=0.01, bend_increments=2, increments=8, force_limit=0.5, pause=0.1)
    record = perform(BARE, experiment, MODEL, tube_surface(BARE, COARSE))
    assert record.completed, record.reason
    stage, time = record["stage"], record["time"]
    rested = int(np.flatnonzero(stage == STAGES.index("settle"))[-1])
    assert stage[rested + 1] == STAGES.index("bend")
    assert time[rested] - time[stage == STAGES.index("pinch")][-1] == pytest.approx(0.1)
    # At rest, the first load moves the block as its flexibility says.
    moved = record["pose"][rested + 1, 1] - record["pose"][rested, 1]
    load = record["load"][rested + 1] - record["load"][rested]
    assert moved == pytest.approx(-load * record["flexibility"][rested, 1, 1], rel=0.02)


@pytest.mark.slow
def test_recovery_goes_through_all_stages():
    experiment = ShapeRecovery(load=0.2, increments=12, bend_increments=4)
    specimen = PinchedTube(pairs=2)
    record = perform(specimen, experiment, MODEL, tube_surface(specimen, COARSE))
    assert record.completed, record.reason
    stages = ("rest", "load", "pinch", "release", "recover", "let go")
    assert sorted(set(record["stage"].tolist())) == [STAGES.index(stage) for stage in stages]
    for stage in ("release", "let go"):
        assert record["pair_force"][record["stage"] == STAGES.index(stage)][-1] == pytest.approx(0.0, abs=1e-3)
    assert (record["pair_force"] >= 0).all()


def test_a_lost_way_keeps_what_was_reached(monkeypatch):
    real, calls = pinching.attempt, []

    def lost(system, branch, target, *others):
        calls.append(target)
        if len(calls) > 6:
            raise DivergedError("lost on purpose", branch.parameters[-1], branch.states[-1])
        return real(system, branch, target, *others)

    monkeypatch.setattr(pinching, "attempt", lost)
    record = eighth(Pinch())
    assert record.status == "diverged"
    assert record.reason.startswith("stage pinch stopped at ")
    assert "lost on purpose" in record.reason
    assert record.reason.endswith("neo-hookean does not")
    assert record["force"][-1] > 0


@pytest.mark.parametrize(
    ("specimen", "experiment", "model", "words"),
    [
        (EVEN, Pinch(pinch_angle=1.0), MODEL, "an eighth of the tube serves a Pinch by the first pair alone"),
        (EVEN, Pinch(), FeaModel(), "is no mesh for the element 'solid'"),
        (EVEN, Pinch(), FeaModel(element="shell", thickness=2e-3), "change the wall of a PinchedTube"),
    ],
)
def test_refusals(specimen, experiment, model, words):
    with pytest.raises(ValueError, match=words):
        eighth(experiment, model, specimen)


def test_beams_and_tubes_do_not_change_places():
    mesh = tube_surface(EVEN, COARSE, "eighth")
    for specimen, experiment in ((EVEN, NaturalModes()), (TwistedBeam(), Pinch())):
        record = perform(specimen, experiment, MODEL, mesh)
        assert record.status == "unsupported"
        assert experiment.kind in record.reason


def test_meshes_of_tubes_are_chosen_apart():
    model = FeaModel.model_validate({"element": "shell", "tube_mesh": {"along": 10}})
    assert model.mesh_for(Pinch()).along == 10
    assert model.mesh_for(Pinch()).across == MODEL.tube_mesh.across
    assert model.mesh_for(NaturalModes()) == MODEL.motion_mesh if NaturalModes.in_motion else MODEL.mesh


def test_a_batch_makes_tube_meshes():
    model = MODEL.model_copy(update={"tube_mesh": COARSE})
    experiment = PinchedBending(pinched=False, load=1.0, bend_increments=2)
    (response,) = Batch(model)([Request(BARE, experiment)])
    record = whole(BARE, experiment, model)
    for name, values in response.items():  # a factorization on two threads may round otherwise
        np.testing.assert_allclose(values, record[name], rtol=1e-9, atol=1e-12 * np.abs(record[name]).max())
