"""Fits of marker tracks: known parameters come back, seeds repeat, doubts are said."""

import json
from dataclasses import replace

import numpy as np
import pytest

import prb
from calibrate.spec import TrackingFit
from calibrate.tracking import Tracking, fit_tracking, search_range
from calibrate.uncertainty import relative_uncertainty
from lab.experiments import RingDown, StaticStiffness
from lab.measures import tracking_error, tracking_rms
from lab.records import Record
from lab.specimens import TwistedBeam
from prb.model import PrbModel

BEAM = TwistedBeam(mass=0.00517)
MODEL = PrbModel(topology="five-hinge", time_step=0.7e-3)
TRUTH = {"k": 0.45, "b": 0.0022, "l2": 0.019}
NOISE = 1e-4


def recording(direction: float, seed: int | None = None, **changes: float) -> Record:
    model = MODEL.model_copy(update={"parameters": TRUTH})
    record = prb.perform(BEAM, RingDown(direction=direction, duration=0.15, **changes), model)
    if seed is None:
        return record
    clean = record.channels["markers"]
    noise = NOISE * np.random.default_rng(seed).standard_normal(clean.values.shape)
    return replace(record, channels={**record.channels, "markers": replace(clean, values=clean.values + noise)})


def spec(free=("k", "b", "l2"), used=2, **changes) -> TrackingFit:
    wanted = free if isinstance(free, dict) else dict.fromkeys(free)
    names = [f"record{i}" for i in range(used)]
    changes = {"population": 8, "generations": 25, **changes}
    return TrackingFit(model="prb", campaign="c", reference="lab", free=wanted, used=names, **changes)


@pytest.fixture(scope="module")
def records():
    return [recording(0.0, 1), recording(np.pi / 2, 2)]


@pytest.fixture(scope="module")
def result(records):
    return fit_tracking(BEAM, MODEL, records, spec(), threads=2)


def test_known_parameters_come_back_within_their_errors(result):
    for parameter in result.parameters:
        assert 0 < parameter.standard_error < 0.03 * parameter.value
        assert abs(parameter.value - TRUTH[parameter.name]) < 4 * parameter.standard_error
        assert parameter.lower < parameter.value < parameter.upper
    # Three coordinates of noise per marker.
    assert result.objective == pytest.approx(np.sqrt(3) * NOISE, rel=0.05)
    assert 1 < result.condition < 100
    assert len(result.notes) == 1 or "generations" in result.notes[0]


def test_the_result_is_plain_data(result):
    data = json.loads(json.dumps(result.to_json(), allow_nan=False))
    assert [p["name"] for p in data["parameters"]] == ["k", "b", "l2"]
    assert np.array(data["correlation"]).shape == (3, 3)
    assert data["objective_unit"] == "m"
    assert data["used"] == ["record0", "record1"]
    assert data["history"] == sorted(data["history"], reverse=True)


def test_the_same_seed_gives_the_same_numbers(records, result):
    again = fit_tracking(BEAM, MODEL, records, spec(), threads=1)
    assert again.values() == result.values()
    assert again.history == result.history
    other = fit_tracking(BEAM, MODEL, records, spec(seed=7), threads=2)
    assert other.history != result.history
    assert other.values() == pytest.approx(result.values(), rel=1e-5)


def test_the_objective_is_eq_5_13_over_all_records(records, result):
    model = MODEL.model_copy(update={"parameters": result.values()})
    tracks = [prb.perform(BEAM, RingDown.model_validate(r.experiment), model)["markers"] for r in records]
    pairs = [(track, record["markers"]) for track, record in zip(tracks, records, strict=True)]
    assert result.objective == pytest.approx(np.sqrt(np.mean([tracking_rms(*pair) ** 2 for pair in pairs])))
    joined = (np.concatenate([a for a, _ in pairs]), np.concatenate([b for _, b in pairs]))
    assert result.tracking_error == pytest.approx(tracking_error(*joined))


def test_parameters_that_are_not_free_keep_their_values(records):
    model = MODEL.model_copy(update={"parameters": {"l2": TRUTH["l2"]}})
    bounds = {"k": ("0.3 N*m/rad", "0.6 N*m/rad"), "b": None}
    found = fit_tracking(BEAM, model, records, spec(bounds))
    assert found.parameters[0].lower == 0.3
    assert found.values() == pytest.approx({"k": TRUTH["k"], "b": TRUTH["b"]}, rel=0.01)


def test_a_bound_that_is_reached_is_said(records):
    found = fit_tracking(BEAM, MODEL, records, spec({"k": (0.1, 0.3)}))
    assert found.values()["k"] == pytest.approx(0.3, rel=1e-3)
    assert found.notes[0] == "k ended at its upper bound: the true optimum may lie beyond it."


def test_what_the_records_do_not_show_is_said():
    # A load in the flat plane of an untwisted beam never twists it.
    flat, chain = TwistedBeam(twist=0.0), PrbModel(topology="gauss-chain", time_step=0.7e-3)
    reference = prb.perform(flat, RingDown(direction=np.pi / 2, duration=0.1), chain)
    found = fit_tracking(flat, chain, [reference], spec({"GJ": None, "tau": None}, used=1, generations=5))
    assert not found.parameters[0].identified
    assert any(note.startswith("GJ is not identified by these records") for note in found.notes)
    assert found.to_json()["parameters"][0]["standard_error"] is None or not found.parameters[0].identified


def test_records_of_different_length_weigh_the_same():
    long, short = recording(0.0), recording(np.pi / 2).experiment
    short = prb.perform(BEAM, RingDown.model_validate({**short, "duration": 0.05}), MODEL)
    values = np.array([[0.34, 0.0029, 0.02366]])
    residual = Tracking(BEAM, MODEL, [long, short]).residuals(values)[0]
    squares = residual @ residual
    track = prb.perform(BEAM, RingDown.model_validate(long.experiment), MODEL)["markers"]
    assert squares == pytest.approx(tracking_rms(track, long["markers"]) ** 2 / 2, rel=1e-9)


@pytest.mark.parametrize(
    ("bounds", "message"),
    [
        (("30 mm", "20 mm"), "bounds of l2: 30 mm is not below 20 mm"),
        (("30 N", "40 mm"), "'30 N' has the unit newton; expected one like m"),
        (("0.1 mm", "40 mm"), "parameter l2 = 0.1 mm is out of bounds; allowed: 1 mm to 49 mm"),
    ],
)
def test_wrong_bounds_are_refused(bounds, message):
    with pytest.raises(ValueError, match="^" + message.replace("'", ".")):
        search_range(BEAM, MODEL, spec({"l2": bounds}))


def test_unknown_parameters_and_wrong_records_are_refused():
    with pytest.raises(ValueError, match="topology five-hinge has no parameter 'E'; it has k, b, l2"):
        search_range(BEAM, MODEL, spec({"E": None}))
    static = prb.perform(BEAM, StaticStiffness(), MODEL)
    with pytest.raises(ValueError, match="a tracking fit needs ring-downs, not StaticStiffness"):
        Tracking(BEAM, MODEL, [static])
    broken = replace(recording(0.0), status="diverged", reason="it fell off")
    with pytest.raises(ValueError, match="is diverged: it fell off"):
        Tracking(BEAM, MODEL, [broken])


def test_uncertainty_of_a_straight_line():
    # y = a + c x with known textbook errors; derivatives by the logarithms are scaled by the values.
    rng, truth, sigma = np.random.default_rng(0), np.array([2.0, 5.0]), 0.1
    x = np.linspace(0, 1, 2000)
    design = np.column_stack([np.ones_like(x), x])
    residual = sigma * rng.standard_normal(x.size)
    found = relative_uncertainty(design * truth, residual)
    exact = np.sqrt(np.diag(np.linalg.inv(design.T @ design))) * sigma
    assert found.standard_errors * truth == pytest.approx(exact, rel=0.05)
    assert found.correlation[0, 1] == pytest.approx(-np.sqrt(3) / 2, rel=1e-2)


def test_a_direction_that_is_not_seen_has_no_error_bar():
    derivative = np.column_stack([np.arange(9.0), np.zeros(9), np.ones(9)])
    found = relative_uncertainty(derivative, np.full(9, 0.1))
    assert np.isinf(found.standard_errors).tolist() == [False, True, False]
    assert found.condition == np.inf
