"""A fin is recovered from what it does, and few peaks do not tell many numbers."""

import json

import numpy as np
import pytest
from pydantic import ValidationError

import calibrate.paddler_fit as paddler_fit
import calibrate.paddler_targets as paddler_targets
import prb
from calibrate.fin_data import FinDatum, exponentials, learn_fin, lever_of, spring_of, widths
from calibrate.paddler_fit import fit_paddler
from calibrate.paddler_scores import plates_area, speeds_table
from calibrate.paddler_sets import correlated, directions_of
from calibrate.paddler_targets import STROKES, devices, published, thrust_targets
from calibrate.spec import PaddlerFit
from lab.experiments import FinPush, PaddleThrust, ShapePropagation
from lab.experiments.fin_drive import FIN_STAGES
from lab.records import Channel, Record, Scalar, channels
from lab.specimens import FinnedTube
from prb.fin_curves import FinCurves, SenseCurves, two_term
from prb.model import PrbModel

DEVICE = FinnedTube()
MODEL = PrbModel(topology="paddler")
TRUTH = FinCurves(
    widening=0.0094, travels=((0.0, 0.0), (0.033, 0.0094)), turn=(1.05, -60.0, -1500.0, 1e4, 2e5),
    opposite=SenseCurves(stiffness=(0.3, 0.4, 0.02, 2.0), limit=(0.05, 0.6, 0.0, 0.0), beyond=0.2),
    equal=SenseCurves(stiffness=(0.25, -0.4, 0.0, 0.0), limit=(0.012, -0.7, 0.0, 0.0), beyond=0.05),
)  # fmt: skip
STATES = (0.0, 0.25, 0.5, 0.75, 1.0)


def _record(experiment: ShapePropagation | FinPush, **values: np.ndarray) -> Record:
    made = [Channel(name, "1", v, tuple(f"d{i}" for i in range(np.ndim(v)))) for name, v in values.items()]
    return Record("fea", "truth", DEVICE.model_dump(mode="json"), experiment.model_dump(mode="json"), channels(*made))


def shape() -> FinDatum:
    """A section that widens as the truth says."""
    s = np.linspace(0.0, 1.0, 41)
    angle = np.linspace(0.0, 2 * np.pi, 64, endpoint=False)
    half = 0.02425 + TRUTH.widening * s
    section = np.stack([np.outer(half, np.cos(angle)), np.outer(0.02425 - 0.0165 * s, np.sin(angle))], axis=-1)
    turned = np.polynomial.polynomial.polyval(s * TRUTH.widening, TRUTH.turn)
    return FinDatum("shape", True, _record(ShapePropagation(), travel=0.033 * s, section=section, fin_angle=turned))


def push(sense: str, state: float, *, used: bool = True, place: float = 0.85) -> FinDatum:
    """A plate that feels the truth's spring at the model's hinge."""
    e = FinPush(sense=sense, place=place, travel=max(0.033 * state, 1e-6))
    lever, way = lever_of(DEVICE, e, 0.5), np.linspace(0.0, 0.02, 60)
    spring = getattr(TRUTH, sense)
    k, limit = (float(two_term(four, np.array(state))) for four in (spring.stiffness, spring.limit))
    turn, knee = np.arctan2(way, lever), limit / k
    moment = k * np.minimum(turn, knee) + spring.beyond * k * np.maximum(turn - knee, 0.0)
    stage, travel = np.full(60, FIN_STAGES.index("push")), np.full(60, 0.033 * state)
    return FinDatum(f"{sense} {state:g}", used, _record(e, stage=stage, travel=travel, push=way, force=moment / lever))


def test_a_fin_is_recovered_from_its_records():
    data = [shape(), *(push(sense, s) for sense in ("opposite", "equal") for s in STATES)]
    found = learn_fin(data, 0.5, 0.005)
    assert found.widening == pytest.approx(TRUTH.widening, rel=1e-9)
    assert found.turn == pytest.approx(TRUTH.turn, rel=1e-5)
    s = np.linspace(0.0, 1.0, 21)
    for sense in ("opposite", "equal"):
        for name in ("stiffness", "limit"):
            ours, truth = (two_term(getattr(getattr(c, sense), name), s) for c in (found, TRUTH))
            assert ours == pytest.approx(truth, rel=0.03)
        assert getattr(found, sense).beyond == pytest.approx(getattr(TRUTH, sense).beyond, abs=0.02)
    assert max(found.errors.values()) < 0.02
    assert found.flattening(0.0165) == pytest.approx(0.5, abs=1e-6)
    # The learned fin paddles as the true one.
    e = PaddleThrust(cycles=1, warm_up=0)
    thrust = [prb.perform(DEVICE, e, MODEL.model_copy(update={"fin": c}))["thrust"] for c in (found, TRUTH)]
    assert np.abs(thrust[0] - thrust[1]).max() < 0.03 * np.abs(thrust[1]).max()


def test_widths_come_from_the_section():
    assert widths(shape().record)[-1] == pytest.approx(TRUTH.widening)


def test_a_spring_without_a_limit_is_straight():
    record = push("opposite", 0.0).record
    lever = 0.35 * DEVICE.fin_length
    force = 0.35 * np.arctan2(record["push"], lever) / lever
    changed = dict(record.channels) | {"force": Channel("force", "N", force, ("d0",))}
    stiffness, *_ = spring_of(Record("fea", "x", record.specimen, record.experiment, changed), lever)
    assert stiffness == pytest.approx(0.35, rel=1e-6)


def test_exponentials_take_as_many_terms_as_there_are_states():
    s = np.array(STATES)
    one, error = exponentials(s[:1], np.array([0.3]))
    assert (one, error) == ((0.3, 0.0, 0.0, 0.0), 0.0)
    truth = two_term((0.2, 1.0, 0.05, -6.0), s)
    found, error = exponentials(s, truth)
    assert error < 2e-3
    single, worse = exponentials(s[:3], truth[:3])
    assert single[2] == 0.0
    assert worse > error


def test_what_cannot_be_learned_is_refused_in_one_line():
    with pytest.raises(ValueError, match="does not reach beyond its hinge"):
        learn_fin([push("equal", 0.0, place=0.85), push("equal", 1.0)], 0.9, 0.0094)
    other = shape().record
    changed = Record("fea", "x", FinnedTube(wall=0.0016).model_dump(mode="json"), other.experiment, other.channels)
    with pytest.raises(ValueError, match="another specimen"):
        learn_fin([shape(), FinDatum("b", True, changed)], 0.5, 0.0094)
    wrong = Record("fea", "x", other.specimen, PaddleThrust().model_dump(mode="json"), other.channels)
    with pytest.raises(ValueError, match="learned from ShapePropagation"):
        learn_fin([FinDatum("b", True, wrong)], 0.5, 0.0094)


def test_a_fit_scores_what_it_has_not_seen():
    spec = PaddlerFit.model_validate({"model": "m", "data": [{"campaign": "a", "reference": "b", "used": ["c"]}]})
    data = [shape(), *(push("equal", s) for s in (0.0, 0.5, 1.0)), push("equal", 0.25, used=False)]
    result = fit_paddler(spec, MODEL, data, None)
    json.dumps(result)
    held = next(score for score in result["scores"] if score["use"] == "held out")
    assert held["error"] < 0.05
    assert FinCurves.model_validate(result["fin"]).opposite is None
    assert result["parameters"] == []


def _follow_model(monkeypatch: pytest.MonkeyPatch, **changed: float) -> None:
    """Let the published thrust be that of a known device."""
    truth = []
    for device in devices(DEVICE):
        known = MODEL.model_copy(update={"parameters": changed})
        reduced = STROKES.reduce(prb.perform(device, STROKES, known))
        truth.append({name: Scalar(reduced[name].value, "N") for name in ("thrust_max", "thrust_min", "thrust_mean")})
    monkeypatch.setattr(paddler_targets, "published", lambda follows: truth)


def test_known_numbers_are_found_again_and_others_are_left_open(monkeypatch):
    _follow_model(monkeypatch, piston=6e-5, fill=0.04)
    spec = PaddlerFit(
        model="m", specimen="d", sets=1, tolerance=0.02, search={"population": 5, "generations": 3},
        free={"piston": (1e-5, 1e-4), "fill": (0.01, 0.15), "body_drag": None},
    )  # fmt: skip
    result = fit_paddler(spec, MODEL, [], DEVICE)
    json.dumps(result)
    found = {p["name"]: p for p in result["parameters"]}
    assert result["objective"] < 2e-3
    assert found["piston"]["value"] == pytest.approx(6e-5, rel=0.02)
    assert found["fill"]["value"] == pytest.approx(0.04, rel=0.03)
    assert found["piston"]["seen"] > 0.99
    assert found["body_drag"]["seen"] < 1e-6
    assert any("body_drag" in note and "left open" in note for note in result["notes"])
    assert all(s["objective"] <= 0.02 for s in result["sets"])
    assert {t["title"] for t in result["tables"]} >= {"free numbers", "published speeds and the plate law"}


def test_buckling_can_be_asked_for(monkeypatch):
    problem = paddler_targets.thrust_problem(
        thrust_targets(DEVICE, "lab"), {"equal_limit": (1e-3, 0.1)}, paddler_fit.performer_of(MODEL), buckles=True
    )  # fmt: skip
    stiff = problem.residuals(np.array([[1.0]]))[0]
    soft = problem.residuals(np.array([[0.0]]))[0]
    assert len(stiff) == problem.size == 8
    assert stiff[-1] > 0.2  # the loaded fin does not buckle
    assert soft[-1] < stiff[-1]
    assert np.isfinite(problem.derivative(np.array([0.4]))).all()


def test_means_can_count_more():
    free, performer = {"piston": (2e-5, 1e-4)}, paddler_fit.performer_of(MODEL)
    targets, here = thrust_targets(DEVICE, "lab"), np.array([[0.5]])
    once, thrice = (
        paddler_targets.thrust_problem(targets, free, performer, mean_weight=w).residuals(here)[0] for w in (1.0, 3.0)
    )
    assert thrice / once == pytest.approx([1, 1, 3, 1, 1, 3])


def test_learned_numbers_are_not_searched():
    spec = PaddlerFit(model="m", specimen="d", free={"sweep": None})
    with pytest.raises(ValueError, match="sweep cannot be searched"):
        fit_paddler(spec, MODEL.model_copy(update={"fin": TRUTH}), [], DEVICE)
    with pytest.raises(ValueError, match="does not paddle"):
        fit_paddler(spec, PrbModel(topology="tube-shear"), [], DEVICE)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"free": {}}, "nothing to fit"),
        ({"specimen": ""}, "name the FinnedTube"),
        ({"data": [{"campaign": "a", "reference": "b", "used": ["c"], "nuisances": {"gain": None}}]}, "no use"),
    ],
)
def test_a_specification_that_cannot_be_is_refused(changed, message):
    with pytest.raises(ValidationError, match=message):
        PaddlerFit.model_validate({"model": "m", "specimen": "d", "free": {"piston": None}, **changed})


def test_directions_tell_what_is_seen():
    seen = directions_of(np.array([[2.0, 2.0, 0.0], [0.0, 0.0, 1e-6]]))
    assert seen.rank == 1
    assert seen.seen == pytest.approx([0.5, 0.5, 0.0], abs=1e-9)
    line = np.linspace(0.0, 1.0, 9)
    pairs = correlated(np.column_stack([line, 1 - line, np.sin(40 * line)]), ["a", "b", "c"])
    assert pairs[0][:2] == ("b", "a")
    assert pairs[0][2] == pytest.approx(-1.0)


def test_published_speeds_give_milli_newtons():
    table = speeds_table(DEVICE)
    rows = {(row[0], row[1]): row for row in table["rows"]}
    push = float(rows["with load fin", "power"][3])
    area = plates_area(devices(DEVICE)[1])
    assert push == pytest.approx(2 * 1000 * 0.02976**2 * area, rel=0.02)
    assert push < 0.01
    assert float(rows["with load fin", "power"][6]) > 500.0
    assert published("lab")[1]["thrust_max"].value == 2.6
