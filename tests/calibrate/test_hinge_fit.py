"""The hinge of a pinched tube: known ones are recovered from what they do."""

import dataclasses
import json

import numpy as np
import pytest
from pydantic import ValidationError

import prb
from calibrate.hinge_data import HingeDatum, hinge_of
from calibrate.hinge_fit import fit_hinge, learn_hinge
from calibrate.hinge_scores import score_of
from calibrate.spec import HingeFit
from lab.experiments import Pinch, PinchedBending, ShapeRecovery
from lab.experiments.pinch_drive import STAGES
from lab.pinching import axis_difference
from lab.records import Channel
from lab.specimens import PinchedTube, TwistedBeam
from prb.hinge_curves import TOUCH, HingeCurves, HingeTable
from prb.model import PrbModel

TUBE = PinchedTube()
SPEC = HingeFit.model_validate({"model": "prb", "data": [{"campaign": "a", "reference": "b", "used": ["c"]}]})
SHARES = np.linspace(0.0, 1.0, 11)
HELD = {
    "knee_soft": 0.05,
    "beyond_soft": 0.6,
    "knee_stiff": 0.05,
    "beyond_stiff": 1.5,
    "twist_x": 0.15,
    "twist_y": 0.05,
}


def table(degrees: float) -> HingeTable:
    """A hinge that softens 12-fold; what changes with the pinch angle does so evenly."""
    s, askew = SHARES, 0.02 * degrees * SHARES
    soft, stiff = 12.0 - 11.0 * s, 12.0 - (4.0 + 0.02 * degrees) * s
    columns = {
        "travel": 0.04 * s, "force": 12.0 * s, "contact": np.maximum(s - TOUCH, 0.0) * 8.0, "strain": 0.05 * s,
        "gap": 0.04 * (TOUCH - s), "flat_along": 0.8 * s, "flat_askew": 0.02 * s, "bend_mean": (soft + stiff) / 2,
        "bend_along": (stiff - soft) / 2, "bend_askew": askew, "torsion": 8.0 - 5.0 * s, "lever": 0.05 - 0.005 * s,
        "shortening": 0.008 * s, "give_across": 2e-4 + 1e-4 * s, "give_along": 2e-4 + 3e-4 * s,
    }  # fmt: skip
    return HingeTable(
        pinch_angle=np.deg2rad(degrees), touches=True, held=HELD,
        columns={k: tuple(v.tolist()) for k, v in columns.items()},
    )  # fmt: skip


CURVES = HingeCurves(
    pairs=3, shares=tuple(SHARES.tolist()), tables=tuple(table(a) for a in (0.0, 30.0, 60.0)),
    specimen=TUBE.model_dump(mode="json"),
)  # fmt: skip
TRUTH = PrbModel(topology="tube-shear", hinge=CURVES)


def pinch(degrees: float, *, used: bool = True, **fields) -> HingeDatum:
    record = prb.perform(TUBE, Pinch(pinch_angle=np.deg2rad(degrees), increments=10, **fields), TRUTH)
    assert record.completed
    return HingeDatum(f"pinch {degrees:g}", used, record)


def bending(degrees: float, *, used: bool = True, **fields) -> HingeDatum:
    fields = {"load": 2.0, "increments": 10, **fields}
    record = prb.perform(TUBE, PinchedBending(pinch_angle=np.deg2rad(degrees), **fields), TRUTH)
    assert record.completed
    return HingeDatum(f"bend {degrees:g}", used, record)


@pytest.fixture(scope="module")
def seen():
    return [pinch(0), pinch(30), pinch(60), bending(0), bending(60), bending(0, direction=0.0, load=20.0)]


@pytest.fixture(scope="module")
def learned(seen):
    return learn_hinge(seen)


@pytest.mark.parametrize("share", [0.3, TOUCH, 1.0])
@pytest.mark.parametrize("degrees", [0, 30, 60, 105, 225])
def test_a_known_hinge_is_recovered(learned, degrees, share):
    alpha = np.deg2rad(degrees)
    found, true = learned.state(alpha, share), CURVES.state(alpha, share)
    for name in ("travel", "force", "contact", "strain"):
        assert getattr(found, name) == pytest.approx(getattr(true, name), rel=1e-3, abs=1e-9), name
    assert found.flatness == pytest.approx(true.flatness, rel=1e-2)
    # By forces and poses of bendings where the tube is closed, by flexibilities before.
    assert found.bending == pytest.approx(true.bending, rel=5e-3 if share > TOUCH else 1e-3, abs=3e-3)
    parameters = dict(found.parameters)
    assert axis_difference(parameters.pop("axis"), true.parameters["axis"]) == pytest.approx(0.0, abs=1e-3)
    for name in ("k_soft", "k_stiff", "k_torsion", "place", "shortening", "k_across", "k_along"):
        assert parameters[name] == pytest.approx(true.parameters[name], rel=5e-3), name


def moment_of(parameters, turn: float, name: str) -> float:
    """Moment of a spring at a turn."""
    knee, beyond = parameters[f"knee_{name}"], parameters[f"beyond_{name}"]
    return parameters[f"k_{name}"] * (min(turn, knee) + beyond * max(turn - knee, 0.0))


def test_springs_follow_from_forces_and_poses(learned):
    found, true = learned.state(0.0, 1.0).parameters, CURVES.state(0.0, 1.0).parameters
    for name, largest in (("soft", 0.1), ("stiff", 0.12)):
        assert (found[f"beyond_{name}"] > 1) == (true[f"beyond_{name}"] > 1)
        for turn in np.linspace(0.2, 1.0, 5) * largest:
            assert moment_of(found, turn, name) == pytest.approx(moment_of(true, turn, name), rel=0.03)


def test_a_jump_as_tendons_are_held_is_no_part_of_the_spring(seen):
    item = bending(0)
    rows = item.record["stage"] == STAGES.index("bend")
    settled = item.record["pose"] + np.outer(rows, [0.0, -0.003, 0.0, 0.06, 0.0, 0.0])
    pose = dataclasses.replace(item.record.channels["pose"], values=settled)
    record = dataclasses.replace(item.record, channels={**item.record.channels, "pose": pose})
    found = learn_hinge([seen[0], HingeDatum("it", True, record)])
    straight = learn_hinge([seen[0], item])
    for name in ("k_soft", "beyond_soft"):
        assert found.state(0.0, 1.0).parameters[name] == pytest.approx(
            straight.state(0.0, 1.0).parameters[name], rel=0.1
        )
    model = PrbModel(topology="tube-shear", hinge=found)
    assert "of the record's motion is not by the load" in score_of(model, HingeDatum("it", True, record))["note"]
    assert score_of(model, item)["note"] == ""


def test_a_bending_of_an_image_teaches_the_same(seen):
    here = learn_hinge([seen[0], bending(30, direction=0.4)])
    # 90 deg is the mirror image of 30 deg in the line at 120 deg.
    there = learn_hinge([seen[0], bending(90, direction=2 * np.deg2rad(120) - 0.4)])
    one, other = (curves.state(0.5, 1.0).parameters for curves in (here, there))
    assert dict(other) == pytest.approx(dict(one), rel=1e-6, abs=1e-9)


def test_turns_beyond_those_of_the_fit_are_noted(learned):
    largest = np.linalg.norm(bending(0).record["pose"][-1, 3:5])
    assert learned.turned == pytest.approx(largest, rel=1e-6)
    record = prb.perform(TUBE, PinchedBending(load=30.0, direction=0.0), PrbModel(topology="tube-shear", hinge=learned))
    [note] = record.how["notes"]
    assert note.startswith("it turns by 7.")
    assert note.endswith(f"learned up to {np.rad2deg(largest):.3g} deg")


def test_a_flexibility_is_taken_apart_about_any_point():
    # A hinge at height 0.03 m with slides, seen from 0.1 m: C = J K^-1 J^T.
    lever, angle = 0.07, 0.4
    soft, stiff = np.array([np.cos(angle), np.sin(angle), 0]), np.array([-np.sin(angle), np.cos(angle), 0])
    up = np.array([0, 0, lever])
    columns = [
        np.r_[np.cross(soft, up), soft], np.r_[np.cross(stiff, up), stiff], np.r_[stiff, 0, 0, 0], np.r_[soft, 0, 0, 0],
        [0, 0, 0, 0, 0, 1.0],
    ]  # fmt: skip
    jacobian = np.column_stack(columns)
    flexible = jacobian @ np.diag(1 / np.array([0.5, 3.0, 1e4, 4e3, 2.0])) @ jacobian.T
    bend, rest = hinge_of(flexible[None])
    assert bend[0, 0].real == pytest.approx(1.75)
    assert bend[0, 1] == pytest.approx(1.25 * np.exp(2j * angle))
    assert {name: values[0] for name, values in rest.items()} == pytest.approx(
        {"torsion": 2.0, "lever": lever, "give_across": 1e-4, "give_along": 1 / 4e3}
    )


def test_unseen_cases_are_scored_and_the_simpler_hinges_are_worse(seen):
    held_out = [
        pinch(45, used=False), bending(120, used=False, load=3.0), bending(60, used=False, direction=1.0),
        bending(0, used=False, order="load first"),
    ]  # fmt: skip
    errors = {}
    for topology in ("tube-two-axis", "tube-shear"):
        result = fit_hinge(SPEC, PrbModel(topology=topology), [*seen, *held_out])
        json.dumps(result, allow_nan=False)
        assert [score["use"] for score in result["scores"]] == ["in sample"] * 6 + ["held out"] * 4
        errors[topology] = [score["error"] for score in result["scores"] if score["name"].startswith("bend")]
        assert [len(row) == len(t["header"]) for t in result["tables"] for row in t["rows"]]
    assert max(errors["tube-shear"]) < 0.015
    assert min(errors["tube-two-axis"]) > 0.02
    again = HingeCurves.model_validate(json.loads(json.dumps(result["hinge"])))
    assert again.state(0.5, 0.7).parameters == learn_hinge(seen).state(0.5, 0.7).parameters


def test_states_amid_a_snap_say_nothing_of_stiffness(seen):
    record = seen[0].record
    wild, unstable = record["flexibility"].copy(), record["unstable"].copy()
    wild[4], unstable[4] = -7.0 * wild[4], 1
    changes = {"flexibility": wild, "unstable": unstable}
    changed = {k: dataclasses.replace(record.channels[k], values=v) for k, v in changes.items()}
    broken = dataclasses.replace(record, channels={**record.channels, **changed})
    found = learn_hinge([HingeDatum("snap", True, broken)])
    share = TOUCH * 4 / 10
    true = CURVES.state(0.0, share).parameters["k_soft"]
    assert found.state(0.0, share).parameters["k_soft"] == pytest.approx(true, rel=1e-3)


def test_a_pinch_that_never_touches_stays_open(seen):
    record = seen[0].record
    open_rows = {
        name: dataclasses.replace(c, values=c.values[:8]) if c.dims[:1] == ("increment",) else c
        for name, c in record.channels.items()
    }
    found = learn_hinge([HingeDatum("open", True, dataclasses.replace(record, channels=open_rows))])
    assert not found.touches(0.0)
    model = PrbModel(topology="tube-shear", hinge=found)
    closed = prb.perform(TUBE, Pinch(), model)
    assert closed.how["notes"] == ["the walls never touched in what the hinge was fitted to"]
    assert np.isnan(Pinch().reduce(closed)["closing_force"].value)
    assert closed["travel"][-1] == pytest.approx(record["travel"][7])


def of_kind(specimen, experiment) -> HingeDatum:
    record = dataclasses.replace(pinch(0).record, specimen=specimen.model_dump(), experiment=experiment.model_dump())
    return HingeDatum("it", True, record)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (lambda: [bending(0, pinched=False)], "no used record pinches a free tube"),
        (lambda: [pinch(0), bending(0, order="load first")], "bend 0 is loaded first"),
        (lambda: [of_kind(TwistedBeam(), Pinch())], "it is of a TwistedBeam; a hinge is learned from PinchedTube"),
        (lambda: [of_kind(TUBE, ShapeRecovery())], "it is of a ShapeRecovery; a hinge is learned from Pinch or"),
        (lambda: [pinch(0), of_kind(PinchedTube(wall=0.002), Pinch())], "it is of another specimen than pinch 0"),
        (lambda: [pinch(0), of_kind(TUBE, Pinch(law="even"))], "used records must share one law of forces"),
    ],
)
def test_what_does_not_belong_together_is_refused_in_one_line(data, message):
    with pytest.raises(ValueError, match=message):
        learn_hinge(data())


def test_too_few_states_are_refused(seen):
    record = seen[0].record
    travel = Channel("travel", "m", np.minimum(record["travel"], record["travel"][1]), ("increment",))
    short = dataclasses.replace(record, channels={**record.channels, "travel": travel})
    with pytest.raises(ValueError, match="short holds 2 states along its pinch; at least 3 are needed"):
        learn_hinge([HingeDatum("short", True, short)])


@pytest.mark.parametrize(
    ("item", "message"),
    [
        ({"used": []}, "no record is used; name at least one under used"),
        ({"used": ["c"], "quantities": ["k_soft"]}, r"data.0.quantities: a hinge fit has no use for it"),
    ],
)
def test_a_specification_that_cannot_be_is_refused(item, message):
    with pytest.raises(ValidationError, match=message):
        HingeFit.model_validate({"model": "prb", "data": [{"campaign": "a", "reference": "b", **item}]})
