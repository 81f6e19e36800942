"""Tubes on a hinge: beam theory where nothing is pinched, statics by hand, and honest refusals."""

import json

import mujoco
import numpy as np
import pytest
from pydantic import ValidationError

import prb
from lab.experiments import NaturalModes, Pinch, PinchedBending, ShapeRecovery
from lab.experiments.pinch_drive import STAGES
from lab.requests import Request
from lab.specimens import PinchedTube, TwistedBeam
from prb.batch import Batch
from prb.hinge_curves import COLUMNS, TOUCH, HingeCurves, HingeTable
from prb.model import PrbModel
from prb.mujoco_model import to_mjcf

TUBE = PinchedTube()


def curves(low: float = 0.0, high: float = 60.0, *, touches: bool = True, soft: float = 0.5) -> HingeCurves:
    """The same numbers at two pinch angles: stiffness falls evenly from 10 to ``soft`` and 2 N*m/rad."""
    s = np.array([0.0, TOUCH, 1.0])
    weak, strong = 10.0 + (soft - 10.0) * s, 10.0 - 8.0 * s
    given = {
        "travel": 0.04 * s, "force": 10.0 * s, "contact": [0.0, 0.0, 0.5], "gap": [0.04, 0.0, -1e-5],
        "flat_along": 0.8 * s, "bend_mean": (weak + strong) / 2, "bend_along": (strong - weak) / 2, "torsion": 3.0,
        "lever": 0.05 - 0.005 * s, "shortening": 0.01 * s, "give_across": 1e-5, "give_along": 1e-5,
    }  # fmt: skip
    columns = {name: tuple(np.broadcast_to(given.get(name, 0.0), 3).tolist()) for name in COLUMNS}
    tables = [HingeTable(pinch_angle=np.deg2rad(a), touches=touches, columns=columns) for a in (low, high)]
    return HingeCurves(pairs=3, shares=tuple(s.tolist()), tables=tuple(tables), specimen=TUBE.model_dump(mode="json"))


MODEL = PrbModel(topology="tube-shear", hinge=curves())


def test_an_open_tube_is_timoshenko_s_beam():
    e, g = TUBE.material.youngs_modulus, TUBE.material.shear_modulus
    r, t, length = TUBE.mid_radius, TUBE.wall, TUBE.length
    theory = 1 / (length**3 / (3 * e * np.pi * r**3 * t) + length / (g * np.pi * r * t))
    push = PinchedBending(pinched=False, push=1e-4)
    stiffness = {
        name: push.reduce(prb.perform(TUBE, push, PrbModel(topology=name)))["k"].value
        for name in ("tube-two-axis", "tube-shear")
    }
    assert stiffness["tube-shear"] == pytest.approx(theory, rel=1e-4)
    # A pin at mid-length alone knows 3/4 of the bending and no shear.
    assert stiffness["tube-two-axis"] == pytest.approx(4 * e * np.pi * r**3 * t / length**3, rel=1e-4)


def test_a_pinch_closes_as_it_was_learned():
    record = prb.perform(TUBE, Pinch(), MODEL)
    found = Pinch().reduce(record)
    assert found["closing_force"].value == pytest.approx(10.0 * TOUCH, rel=1e-6)
    assert found["touch_travel"].value == pytest.approx(0.04 * TOUCH, rel=1e-6)
    assert (found["k_soft"].value, found["k_stiff"].value) == pytest.approx((0.5, 2.0))
    assert found["hinge_axis"].value == pytest.approx(0.0, abs=1e-9)
    assert found["flattening"].value == pytest.approx(0.8, abs=2e-3)
    assert record["pose"][-1] == pytest.approx([0, 0, -0.01, 0, 0, 0], abs=1e-12)


def test_the_section_keeps_the_perimeter_and_lies_along_its_axis():
    section = prb.perform(TUBE, Pinch(pinch_angle=np.deg2rad(120.0)), MODEL)["section"][-1]
    perimeter = np.linalg.norm(section - np.roll(section, 1, axis=0), axis=1).sum()
    assert perimeter == pytest.approx(2 * np.pi * TUBE.mid_radius, rel=0.01)
    furthest = section[np.linalg.norm(section, axis=1).argmax()]
    assert np.arctan2(furthest[1], furthest[0]) % np.pi == pytest.approx(np.deg2rad(60.0), abs=1e-6)


def test_a_third_of_a_turn_turns_everything_by_60_degrees():
    loads = [
        PinchedBending(load=0.5, direction=a, pinch_angle=b) for a, b in ((-1.2, 0.0), (-1.2 + np.pi / 3, 2.0943951))
    ]
    one, other = (prb.perform(TUBE, load, MODEL)["pose"][-1] for load in loads)
    turn = np.exp(1j * np.pi / 3)
    for start in (0, 3):
        assert complex(*other[start : start + 2]) == pytest.approx(turn * complex(*one[start : start + 2]), rel=1e-6)


def test_a_bend_about_the_soft_axis_is_a_pendulum_and_eases_the_tendons():
    load = PinchedBending(load=4.0)
    record = prb.perform(TUBE, load, PrbModel(topology="tube-two-axis", hinge=curves()))
    turn = record["pose"][-1, 3]
    assert 0.5 * turn == pytest.approx(4.0 * 0.045 * np.cos(turn), rel=1e-9)
    # U = F q + K(q) turn^2 / 2 gives the force at a held travel; K falls by 9.5 over 0.04 m.
    assert record["force"][-1] == pytest.approx(10.0 - 9.5 / 0.04 * turn**2 / 2, rel=1e-6)


def bent(load: float, *, beyond: float = 0.5, topology: str = "tube-two-axis", **held: float):
    tables = [t.model_copy(update={"held": {"beyond_soft": beyond, "knee_soft": 0.2, **held}}) for t in curves().tables]
    model = PrbModel(topology=topology, hinge=curves().model_copy(update={"tables": tuple(tables)}))
    record = prb.perform(TUBE, PinchedBending(load=load), model)
    assert record.completed
    return record["pose"][-1]


@pytest.mark.parametrize("beyond", [0.2, 2.0])
def test_a_spring_with_a_knee_bears_any_load(beyond):
    for load, knee in ((1.0, False), (4.0, True), (40.0, True)):
        turn = bent(load, beyond=beyond)[3]
        assert (turn > 0.2) == knee
        moment = 0.5 * (turn if turn < 0.2 else 0.2 + beyond * (turn - 0.2))
        assert moment == pytest.approx(load * 0.045 * np.cos(turn), rel=1e-6)


def test_a_bend_brings_twist_with_it():
    straight, twisted = (bent(0.01, topology="tube-three-axis", twist_x=x) for x in (0.0, -0.2))
    assert straight[5] == pytest.approx(0.0, abs=1e-9)
    assert twisted[5] == pytest.approx(-0.2 * twisted[3], rel=1e-3)
    # Bending does not feel it.
    assert twisted[3] == pytest.approx(straight[3], rel=1e-3)


def test_held_tendons_change_the_closed_tube_alone():
    table = curves().tables[0].model_copy(update={"held": {"bend_mean": 3.0, "torsion": 1.0}})
    held = curves().model_copy(update={"tables": (table,)})
    assert held.state(0.0, 1.0).parameters["k_torsion"] == pytest.approx(1.0)
    assert held.state(0.0, 1.0, pinching=True).parameters == pytest.approx(curves().state(0.0, 1.0).parameters)
    assert held.state(0.0, 0.5).parameters == pytest.approx(curves().state(0.0, 0.5).parameters)
    document = held.model_dump(mode="json")
    document["tables"][0]["held"]["hardening"] = 1.0
    with pytest.raises(ValidationError, match="held has no number 'hardening'; it may have bend_mean"):
        HingeCurves.model_validate(document)


def test_a_push_holds_what_a_dead_load_cannot():
    snapping = PrbModel(topology="tube-two-axis", hinge=curves(soft=-0.5))
    dead = prb.perform(TUBE, PinchedBending(load=0.1), snapping)
    assert dead.status == "diverged"
    assert "no stable equilibrium" in dead.reason
    pushed = prb.perform(TUBE, PinchedBending(push=0.005), snapping)
    assert pushed.completed
    assert pushed["load"][-1] < 0
    assert pushed["unstable"][-1] == 1


def test_a_push_goes_through_its_rig_and_back():
    push = PinchedBending(push=0.004, rig_stiffness=500.0, returns=True, place=0.005)
    record = prb.perform(TUBE, push, MODEL)
    last = np.flatnonzero(record["stage"] == STAGES.index("bend"))[-1]
    assert record["pushed"][last] + record["load"][last] / 500.0 == pytest.approx(0.004, rel=1e-9)
    assert push.reduce(record)["loss"].value == pytest.approx(0.0, abs=1e-6)
    assert record["pose"][-1, :2] == pytest.approx(0.0, abs=1e-9)


def test_loaded_first_or_last_it_ends_the_same():
    first, last = (prb.perform(TUBE, PinchedBending(load=1.0, order=o), MODEL) for o in ("load first", "pinch first"))
    assert first["pose"][-1] == pytest.approx(last["pose"][-1], rel=1e-9)
    assert [STAGES[s] for s in np.unique(first["stage"])] == ["rest", "load", "pinch"]


def test_the_flexibility_is_the_slope_of_the_pose():
    e = PinchedBending(load=2.0, bend_increments=2, direction=0.4)
    loads = [e.load * (1 + 1e-5 * s) for s in (-1, 1)]
    down, up = (prb.perform(TUBE, e.model_copy(update={"load": load}), MODEL)["pose"][-1, :3] for load in loads)
    slope = prb.perform(TUBE, e, MODEL)["flexibility"][-1][:3, :2] @ [np.cos(0.4), np.sin(0.4)]
    assert (up - down) / (loads[1] - loads[0]) == pytest.approx(slope, rel=1e-4, abs=1e-9)


def test_a_hinge_with_two_axes_does_not_claim_to_know_torsion():
    record = prb.perform(TUBE, Pinch(), PrbModel(topology="tube-two-axis", hinge=curves()))
    assert np.isnan(record["flexibility"][:, 5]).all()
    assert np.isnan(Pinch().reduce(record)["k_torsion"].value)


def test_the_closed_tube_is_exported():
    closed = MODEL.pinched(curves().state(0.0, 1.0).parameters)
    model = mujoco.MjModel.from_xml_string(to_mjcf(closed.mechanism(TUBE)))
    assert model.jnt_stiffness == pytest.approx([1e5, 1e5, 0.5, 2.0, 3.0])
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert data.site("tip").xpos == pytest.approx([0, 0, 0.09], abs=1e-6)


def test_an_open_tube_vibrates():
    record = prb.perform(TUBE, NaturalModes(count=2), PrbModel(topology="tube-shear"))
    assert record["frequency"][0] == pytest.approx(record["frequency"][1], rel=1e-9)


@pytest.mark.parametrize(
    ("specimen", "experiment", "hinge", "reason"),
    [
        (TUBE, Pinch(), None, "how a pinched tube bends must be learned first"),
        (TUBE, PinchedBending(load=1.0), None, "how a pinched tube bends must be learned first"),
        (TwistedBeam(), Pinch(), curves(), "a TwistedBeam has no pads to pinch"),
        (TUBE, Pinch(pair_forces=(1, 1, 1)), curves(), "pair_forces are none of the states"),
        (TUBE, Pinch(law="even"), curves(), "law 'even' with 3 pairs: the hinge was fitted to law 'published' with 3"),
        (
            TUBE,
            Pinch(pinch_angle=1.0),
            curves(0, 30),
            "the image of 57.3 deg, and the hinge was fitted from 0 to 30 deg",
        ),
        (TUBE, ShapeRecovery(), curves(), "whether the wall snaps back"),
    ],
)
def test_what_the_hinge_cannot_do_is_unsupported_with_the_reason(specimen, experiment, hinge, reason):
    record = prb.perform(specimen, experiment, PrbModel(topology="tube-shear", hinge=hinge))
    assert record.status == "unsupported"
    assert reason in record.reason


def test_a_search_is_told_of_the_fit_for_hinges():
    model = PrbModel(topology="tube-shear")
    batch = Batch(model.topology)
    assert batch([Request(TUBE, Pinch(), model.values(TUBE))]) == [None]
    assert batch.failures == {0: "a Pinch has no searched parameters; use a fit of kind hinge"}


def test_another_tube_and_a_force_limit_are_noted():
    record = prb.perform(TUBE.model_copy(update={"wall": 0.0012}), Pinch(force_limit=5.0), MODEL)
    assert record.how["notes"] == [
        "wall is 0.0012, but was 0.001 in the fit", "force_limit 5 N was reached before the pinch closed"
    ]  # fmt: skip
    assert 5.0 < record["force"][-1] < 5.5


def test_curves_survive_being_written_and_wrong_ones_do_not():
    document = json.loads(json.dumps(MODEL.model_dump(mode="json")))
    assert PrbModel.model_validate(document) == MODEL
    document["hinge"]["tables"][0]["columns"]["force"] = [1.0]
    with pytest.raises(ValidationError, match="column force must have one number for each of the shares"):
        PrbModel.model_validate(document)
    document["hinge"]["tables"].reverse()
    with pytest.raises(ValidationError, match="tables: pinch angles must rise"):
        PrbModel.model_validate(document)
