"""The paddling device: closed forms, energy, symmetry, steps, and MuJoCo beside it."""

import dataclasses
import json

import mujoco
import numpy as np
import pytest

import prb
from lab.experiments import FinPush, PaddleThrust, ShapePropagation
from lab.requests import Request
from lab.specimens import FinnedTube, TwistedBeam
from lab.specimens.finned_tube import LoadFin
from prb.batch import Batch
from prb.fin_curves import FinCurves, SenseCurves, two_term
from prb.model import PrbModel
from prb.paddler import NEEDED, Paddler, Stroke, longest_step, paddle, paddler_of
from prb.paddler_kernel import STATE, buckling_spring, rates, turned
from prb.paddler_mujoco import actuator_force, paddle_in_mujoco, paddler_mjcf, paddler_spec
from prb.plate_law import plate_load, speed_needed
from prb.water import paddle_in

BARE, LOADED = FinnedTube(), FinnedTube(load_fin=LoadFin())
MODEL = PrbModel(topology="paddler")
PRESSURE = PaddleThrust().pressure
#: Springs that change with the flattening, and a fin that turns unevenly.
CURVES = FinCurves(
    widening=0.0094, travels=((0.0, 0.0), (0.033, 0.0094)), turn=(1.05, -60.0, -1500.0, 1e4, 0.0),
    opposite=SenseCurves(stiffness=(0.3, 0.5, 0.02, 1.5), limit=(0.1, 0.6, 0.0, 0.0), beyond=0.2),
    equal=SenseCurves(stiffness=(0.25, -0.4, 0.0, 0.0), limit=(0.007, -0.7, 0.0, 0.0), beyond=0.05),
)  # fmt: skip


def device(specimen: FinnedTube = LOADED, curves: FinCurves | None = None, **changed: float) -> Paddler:
    return paddler_of(specimen, {**MODEL.values(specimen), **changed}, curves)


def stroke(**changed: float) -> Stroke:
    return dataclasses.replace(Stroke(PRESSURE, 1.0, 2), **changed)


@pytest.mark.parametrize("degrees", [0.0, 10.0, 45.0, 90.0, 135.0])
def test_a_plate_in_uniform_flow_has_the_published_lift_and_drag(degrees):
    angle, u, area = np.deg2rad(degrees), 0.3, 2e-3
    force = plate_load(np.array([-u, 0.0]), np.array([np.sin(angle), np.cos(angle)]), area)
    # The flow comes along +x at the plate that moves along -x: eqs. 4.1 and 4.2, drag along the flow.
    sense = np.sign(np.sin(angle))
    assert force[0] == pytest.approx(1000 * u**2 * area * np.sin(angle) ** 2, abs=1e-15)
    assert force[1] == pytest.approx(sense * 1000 * u**2 * area * np.cos(angle) * np.sin(angle), abs=1e-15)
    back = plate_load(np.array([u, 0.0]), np.array([np.sin(angle), np.cos(angle)]), area)
    assert back == pytest.approx(-force, abs=1e-15)


def test_speed_needed_inverts_the_law():
    assert 1000 * speed_needed(0.6, 1.4e-3) ** 2 * 1.4e-3 == pytest.approx(0.6)


def test_the_compiled_motion_uses_that_law():
    paddler = device()
    numbers, state = paddler.numbers(stroke(free=True)), np.array([0.0, 0.004, -0.3, 0.05, 0.2, -3.0, 1.0, 0, 0, 0, 0])
    out, told = np.zeros(STATE), np.zeros(4)
    rates(state, 0.0, 0.0, numbers, out, told)
    theta, slope, _ = turned(0.004, numbers.turn)
    along = lambda a: np.array([np.sin(a), -np.cos(a)])  # noqa: E731
    across = lambda a: np.array([np.cos(a), np.sin(a)])  # noqa: E731
    forwards = 0.0
    for plate in paddler.plates():
        velocity = np.array([0.2, 0.05])
        reach = numbers.hinge[0] if plate.outer else plate.arm
        velocity += slope * 0.2 * reach * across(theta)
        turn = theta - 0.3 if plate.outer else theta
        if plate.outer:
            velocity += (slope * 0.2 - 3.0) * plate.arm * across(turn)
        forwards += plate_load(velocity, across(turn), plate.area)[1]
        assert along(turn) @ across(turn) == pytest.approx(0.0, abs=1e-15)
    assert told[1] == pytest.approx(forwards, rel=1e-12)


def test_a_towed_device_reaches_its_terminal_speed():
    stiff = {"equal": 5.0, "opposite": 5.0, "equal_limit": 2.0, "opposite_limit": 2.0, "flat_pressure": 1e7}
    paddler = device(BARE, **stiff)
    moved = paddle(paddler, Stroke(0.0, 0.1, 1, free=True, pull=0.05))
    area = sum(p.area for p in paddler.plates())
    resistance = 500.0 * paddler["body_drag"] + 1000.0 * area * np.sin(moved.fin_angle[-1]) ** 2
    assert moved["body_speed"][-1] == pytest.approx(np.sqrt(0.025 / resistance), rel=1e-3)


@pytest.mark.parametrize("curves", [None, CURVES])
@pytest.mark.parametrize("carried", [0.0, 1.0])
@pytest.mark.parametrize("free", [False, True])
def test_energy_is_kept(curves, carried, free):
    books = paddle(device(LOADED, curves, carried=carried), stroke(free=free, pull=0.01 * free), 0.1e-3).books()
    assert books["given"] > 0.01
    assert books["water"] > 0.0
    assert abs(books["missing"]) < 2e-6 * books["given"]


@pytest.mark.parametrize("s", [0.0, 0.4, 1.0])
@pytest.mark.parametrize("q", [-0.8, -0.01, 0.02, 0.9])
def test_the_hinge_s_moment_is_the_derivative_of_its_energy(q, s):
    numbers, h = device(LOADED, CURVES).numbers(stroke()), 1e-6
    moment, _, by_s = buckling_spring(q, s, numbers)
    rise = buckling_spring(q + h, s, numbers)[1] - buckling_spring(q - h, s, numbers)[1]
    assert moment == pytest.approx(rise / (2 * h), rel=1e-6)
    if 0.0 < s < 1.0:
        rise = buckling_spring(q, s + h, numbers)[1] - buckling_spring(q, s - h, numbers)[1]
        assert by_s == pytest.approx(rise / (2 * h), rel=1e-5)


def _reciprocal(**changed: float) -> Paddler:
    """A fin that sweeps evenly about straight out, root at rest, valve as quick either way."""
    tiny = 1e-3
    values = dict(MODEL.values(LOADED))
    values |= {
        "widening": tiny * values["widening"], "piston": values["piston"] / tiny,
        "tube_mass": values["tube_mass"] / tiny**2, "tube_damper": values["tube_damper"] / tiny**2,
        "stop": 0.0, "fill": 0.05, "vent": 0.05, "equal": 0.3,
        "opposite": 0.3, "equal_limit": 0.006, "opposite_limit": 0.006, "equal_beyond": 0.02, "opposite_beyond": 0.02,
        "flat_pressure": PRESSURE, "rest_angle": np.deg2rad(115.0), "sweep": np.deg2rad(50.0), **changed,
    }  # fmt: skip
    return Paddler(values, LOADED.fin_length, (0.00205, 0.03, 0.045))


def _mean(paddler: Paddler) -> tuple[float, float]:
    motion = paddle(paddler, stroke(cycles=3))
    last = motion["time"] >= 2.0 - 1e-9
    thrust, time = motion.thrust[last], motion["time"][last]
    return float(np.trapezoid(thrust, time)), float(np.abs(thrust).max())


def test_a_symmetric_fin_that_goes_back_as_it_came_gives_no_mean_thrust():
    mean, peak = _mean(_reciprocal())
    assert peak > 0.1
    assert abs(mean) < 2e-3 * peak
    # The same stroke with a fin that gives way in recovery alone.
    gained, peak = _mean(_reciprocal(opposite_limit=0.5))
    assert gained > max(0.01 * peak, 20 * abs(mean))


def test_steps_converge():
    exact = paddle(device(), stroke(), 0.02e-3)
    errors = []
    for step in (1e-3, 0.5e-3, 0.25e-3):
        motion = paddle(device(), stroke(), step)
        errors.append(abs(motion.sensed.max() - exact.sensed.max()) / exact.sensed.max())
        errors[-1] += np.abs(np.interp(exact["time"], motion["time"], motion["x1"]) - exact["x1"]).max() / 0.0094
    assert errors[1] < 1e-3
    assert errors[2] < errors[0] / 4


def test_stiff_devices_take_shorter_steps():
    soft, stiff = device(), device(opposite=5.0, fin_mass=0.001, hinge_share=0.8)
    steps = [longest_step(p, p.numbers(stroke()), 0.5e-3) for p in (soft, stiff)]
    assert steps[1] < steps[0] <= 0.5e-3
    assert paddle(stiff, stroke(cycles=1)).completed


@pytest.mark.parametrize(("specimen", "curves"), [(LOADED, None), (BARE, None), (LOADED, CURVES)])
def test_mujoco_agrees(specimen, curves):
    paddler, quick = device(specimen, curves), stroke(frequency=4.0, cycles=1)
    ours, theirs = paddle(paddler, quick, 0.1e-3), paddle_in_mujoco(paddler, quick, time_step=0.1e-3)
    span = lambda motion, f: np.interp(np.arange(0.0, 0.25, 1e-3), motion["time"], f)  # noqa: E731
    for name in ("x1", "buckling"):
        mine, other = (span(motion, motion[name]) for motion in (ours, theirs))
        assert np.abs(mine - other).max() < 0.01 * max(np.abs(mine).max(), 0.02)
    mine, other = (np.convolve(span(motion, motion.thrust), np.ones(10) / 10, "valid") for motion in (ours, theirs))
    assert other.max() == pytest.approx(mine.max(), rel=0.01)
    assert other.min() == pytest.approx(mine.min(), rel=0.01)


def test_mujoco_agrees_on_a_swimming_body():
    paddler, quick = device(), stroke(frequency=4.0, cycles=2, free=True)
    ours, theirs = paddle(paddler, quick, 0.1e-3), paddle_in_mujoco(paddler, quick, time_step=0.2e-3)
    assert theirs["body"][-1] == pytest.approx(ours["body"][-1], rel=0.01)
    assert theirs["body_speed"].max() == pytest.approx(ours["body_speed"].max(), rel=0.01)
    assert theirs.sensed.max() == pytest.approx(ours.sensed.max(), rel=0.01)
    assert theirs.tip_speed.max() == pytest.approx(ours.tip_speed.max(), rel=0.01)


def test_mujoco_has_no_water_that_a_plate_carries():
    with pytest.raises(ValueError, match="carried"):
        paddle_in_mujoco(device(carried=1.0), stroke())


def test_native_springs_are_the_law():
    paddler = device()
    model = paddler_spec(paddler, stroke()).compile()
    data, numbers = mujoco.MjData(model), paddler.numbers(stroke())
    for q in (-0.5, -0.01, 0.1, 0.7):
        data.qpos[:] = [0.0, 0.0, 0.0, q]
        mujoco.mj_forward(model, data)
        assert data.qfrc_passive[3] == pytest.approx(-buckling_spring(q, 0.0, numbers)[0], rel=1e-9)


def test_exported_model_holds_the_coupling_and_says_what_is_missing():
    text = paddler_mjcf(device(LOADED, CURVES), stroke())
    model = mujoco.MjModel.from_xml_string(text)
    assert model.eq_data[0, :5] == pytest.approx([0.0, *CURVES.turn[1:]], rel=1e-5)
    assert "qfrc_passive" in text
    assert model.numeric("plate load").data[0] == pytest.approx(1000 * 0.0309 * 0.045, rel=1e-5)


@pytest.mark.parametrize(
    ("water", "degrees", "share"),
    [("inertia-box", 90.0, 0.5), ("inertia-box", 60.0, 0.5 * 0.75**1.5), ("ellipsoid", 90.0, np.pi / 8)],
)
def test_mujoco_s_own_fluids_are_no_plate_law(water, degrees, share):
    """Drag of plates that go forwards, over rho A u^2: half of it square on as a box, pi / 8 as an ellipsoid."""
    paddler, u = device(BARE, rest_angle=np.deg2rad(degrees)), 1.0
    model = paddler_spec(paddler, stroke(free=True), water=water).compile()
    data = mujoco.MjData(model)
    data.qvel[0] = u
    mujoco.mj_forward(model, data)
    area = sum(plate.area for plate in paddler.plates())
    assert data.qfrc_passive[0] == pytest.approx(-share * 1000 * area * u**2, rel=0.01)


@pytest.mark.parametrize("curves", [None, CURVES])
@pytest.mark.parametrize("free", [False, True])
def test_no_water_is_water_without_density(curves, free):
    paddler, quick = device(LOADED, curves), stroke(frequency=4.0, cycles=1, free=free)
    ours = paddle(paddler, dataclasses.replace(quick, density=0.0), 0.1e-3)
    theirs = paddle_in("none", paddler, quick, 0.5e-3)
    assert theirs.fault == ""
    for name in ("x1", "buckling", "body", "input_force"):
        other = np.interp(ours["time"], theirs["time"], theirs[name])
        assert np.abs(other - ours[name]).max() <= 0.01 * np.abs(ours[name]).max() + 1e-8
    assert np.ptp(theirs.sensed) == pytest.approx(np.ptp(ours.sensed), rel=0.01)


@pytest.mark.parametrize("water", ["ellipsoid", "inertia-box", "none"])
@pytest.mark.parametrize("body", ["fixed", "free"])
def test_another_water_gives_the_same_kind_of_record(water, body):
    e = PaddleThrust(cycles=2, body=body, frequency=2.0)
    usual = prb.perform(LOADED, e, MODEL)
    record = prb.perform(LOADED, e, MODEL.model_copy(update={"water": water}))
    assert record.completed, record.reason
    assert {n: c.unit for n, c in record.channels.items()} == {n: c.unit for n, c in usual.channels.items()}
    assert record.how["water"] == water
    assert "MuJoCo" in record.how["run_by"]
    assert 0.0 < record.how["step_error"] < 0.01
    assert (usual.how["water"], usual.how["run_by"]) == ("plate", "the compiled motion")
    assert record.fields.points == pytest.approx(usual.fields.points)
    found, known = e.reduce(record), e.reduce(usual)
    assert abs(found["thrust_max"].value - known["thrust_max"].value) > 0.05 * known["thrust_max"].value
    if water == "none":
        assert abs(found["thrust_mean"].value) < 1e-3 * known["thrust_max"].value
    if body == "free":
        # Ellipsoids push the other way, boxes as plates do but less; without water a body stays where it is.
        speed = found["swim_speed"].value / known["swim_speed"].value
        assert {"ellipsoid": speed < -0.1, "inertia-box": 0.1 < speed < 0.9, "none": abs(speed) < 0.01}[water]
    json.dumps(record.how)


def test_a_fin_that_rattles_in_mujoco_is_no_result():
    """Steps too long for its springs: everything stays finite, and is wrong by half."""
    e, rough = PaddleThrust(cycles=2), MODEL.model_copy(update={"water": "ellipsoid", "time_step": 100e-3})
    record = prb.perform(BARE, e, rough)
    assert (record.status, record.channels) == ("diverged", {})
    assert "not steady: steps of 0.00125 s" in record.reason
    assert "shorten time_step" in record.reason
    batch = Batch(MODEL.topology, water="ellipsoid", time_step=100e-3)
    assert batch([Request(BARE, e, MODEL.values(BARE))]) == [None]
    assert batch.failures[0] == record.reason
    rattling = paddle_in_mujoco(device(BARE), stroke(), water="ellipsoid", time_step=1.25e-3)
    assert np.isfinite(rattling.thrust).all()
    # Steps are halved until it does not rattle.
    steady = paddle_in("ellipsoid", device(BARE), stroke(), 5e-3)
    assert (steady.fault, steady.step) == ("", pytest.approx(0.125e-3))
    assert rattling.sensed.max() > 1.5 * steady.sensed.max()


@pytest.mark.parametrize("pressure", [1e12, 1e18])
def test_a_motion_that_runs_away_in_mujoco_is_no_result(pressure):
    """Too fast after some steps, or so strong in one that MuJoCo, left alone, would begin anew from rest."""
    motion = paddle_in("none", device(), stroke(pressure=pressure, cycles=1), 0.5e-3)
    assert not motion.completed
    assert "runs away" in motion.fault


def test_only_what_paddles_has_water():
    assert PrbModel(topology="paddler", water="ellipsoid").water == "ellipsoid"
    with pytest.raises(ValueError, match="water: topology five-hinge does not paddle; leave water out"):
        PrbModel(topology="five-hinge", water="none")
    with pytest.raises(ValueError, match="'plate', 'ellipsoid', 'inertia-box' or 'none'"):
        PrbModel(topology="paddler", water="honey")


def test_a_batch_paddles_in_the_same_water():
    e = PaddleThrust(cycles=1, warm_up=0, frequency=4.0)
    requests = [Request(s, e, MODEL.values(s)) for s in (BARE, LOADED)]
    found = Batch(MODEL.topology, water="inertia-box", threads=2)(requests)
    for specimen, response in zip((BARE, LOADED), found, strict=True):
        record = prb.perform(specimen, e, MODEL.model_copy(update={"water": "inertia-box"}))
        assert np.array_equal(response["thrust"], record["thrust"])


def test_exported_model_is_in_its_water():
    text = paddler_mjcf(device(), stroke(), water="ellipsoid")
    model = mujoco.MjModel.from_xml_string(text)
    assert (model.opt.density, model.nnumeric) == (1000.0, 0)
    assert "as ellipsoids" in text
    assert "rho" not in text


def test_actuator_follows_the_valve():
    paddler, times = device(), np.array([0.0, 0.1, 0.5, 0.55, 1.0])
    full = paddler["piston"] * PRESSURE
    force = actuator_force(paddler, stroke(cycles=1), times)
    rise = full * (1 - np.exp(-0.5 / paddler["fill"]))
    expected = [0.0, full * (1 - np.exp(-0.1 / paddler["fill"])), rise, rise * np.exp(-0.05 / paddler["vent"])]
    assert force[:4] == pytest.approx(expected)
    motion = paddle(paddler, stroke(cycles=1))
    assert np.interp(times[1:4], motion["time"], motion["input_force"]) == pytest.approx(expected[1:], rel=1e-4)


def test_record_has_what_the_experiment_promises():
    e = PaddleThrust(cycles=2, body="free")
    record = prb.perform(LOADED, e, MODEL)
    assert record.completed
    assert set(record.channels) == {
        "time", "thrust", "x1", "fin_angle", "buckling", "tip_speed", "input_force", "body", "body_speed"
    }  # fmt: skip
    assert all(len(record[name]) == e.samples for name in record.channels)
    found = e.reduce(record)
    assert found["swim_speed"].value > 0.0
    assert record["fin_angle"][0] == pytest.approx(LOADED.attachment_angle)
    assert np.diff(record["body"]) @ np.ones(e.samples - 1) == pytest.approx(record["body"][-1])
    assert record["input_force"].max() < 2 * MODEL.values(LOADED)["piston"] * PRESSURE
    assert record.fields is not None
    assert record.fields.points[3] == pytest.approx(record.fields.points[0] * [-1, 1, 1])
    json.dumps(record.how)


def test_a_load_fin_pushes_harder_and_buckles():
    e = PaddleThrust(cycles=2)
    bare, loaded = (e.reduce(prb.perform(s, e, MODEL)) for s in (BARE, LOADED))
    assert loaded["thrust_max"].value > 1.5 * bare["thrust_max"].value
    assert loaded["buckling_min"].value < 10 * bare["buckling_min"].value < 0.0


def test_a_batch_does_as_single_runs_do():
    e = PaddleThrust(cycles=2)
    values = MODEL.values(LOADED)
    requests = [Request(s, e, values) for s in (BARE, LOADED)] + [Request(LOADED, e, {**values, "piston": 5e-5})]
    one = Batch(MODEL.topology, fin=CURVES)(requests)
    two = Batch(MODEL.topology, fin=CURVES, threads=2)(requests)
    record = prb.perform(LOADED, e, MODEL.model_copy(update={"fin": CURVES}))
    for first, second in zip(one, two, strict=True):
        assert np.array_equal(first["thrust"], second["thrust"])
    assert np.array_equal(one[1]["thrust"], record["thrust"])


def test_what_cannot_paddle_is_refused_with_the_reason():
    e = PaddleThrust(cycles=2)
    assert "no fins" in prb.perform(TwistedBeam(), e, PrbModel(topology="five-hinge")).reason
    assert "no parameter 'tube_mass'" in prb.perform(BARE, e, PrbModel(topology="tube-shear")).reason
    for given in (ShapePropagation(), FinPush()):
        assert prb.perform(BARE, given, MODEL).status == "unsupported"


def test_every_number_says_why():
    for name in NEEDED:
        assert MODEL.topology.parameters[name].meaning
    skeleton = MODEL.mechanism(BARE)
    assert [hinge.name for hinge in skeleton.hinges] == ["swim", "widen", "turn", "buckle"]


def test_curves_of_another_device_are_doubted():
    curves = CURVES.model_copy(update={"specimen": BARE.model_dump(mode="json")})
    assert curves.doubts(LOADED) == ()
    assert "attachment_angle" in curves.doubts(FinnedTube(attachment_angle=1.2))[0]
    learned = MODEL.model_copy(update={"fin": curves})
    record = prb.perform(FinnedTube(attachment_angle=1.2), PaddleThrust(cycles=2), learned)
    assert record.how["notes"]


def test_curves_that_give_way_to_nothing_are_refused():
    with pytest.raises(ValueError, match="must stay positive"):
        SenseCurves(stiffness=(1.0, 0.0, -0.5, 1.0), limit=(0.1, 0, 0, 0), beyond=0.0)
    assert two_term((1.0, 0.5, 0.2, -1.0), np.array([0.0]))[0] == pytest.approx(1.2)
    assert CURVES.flattening(0.0165) == pytest.approx(0.5)
