import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.experiments import RingDown, StaticStiffness
from lab.readers import Recording
from lab.signals import (
    Window,
    align,
    crop,
    detect_release,
    fill_gaps,
    kabsch,
    low_pass,
    move_moments,
    release_at,
    resample,
    reversed_wrench,
    take_rest,
    tare,
)
from lab.signals.legs import find_legs
from lab.signals.steps import Crop, MapAxes, Release, Resample, Rest, Turn

RATE = 200.0


def recording(motion, rate=RATE, **others):
    """Markers A, B, C on one motion (n, 3), 20 to 40 mm apart."""
    places = {"A": [0.1, 0.0, 0.0], "B": [0.1, 0.02, 0.0], "C": [0.1, 0.0, 0.04]}
    n = len(motion)
    return Recording(
        source="take.csv", time=np.arange(n) / rate, rate=rate, rows=np.arange(n) + 8,
        markers={name: np.array(place) + motion for name, place in places.items()}, **others,
    )  # fmt: skip


def sway(count=200, frequency=5.0, rate=RATE):
    return 0.01 * np.sin(2 * np.pi * frequency * np.arange(count) / rate)[:, None] * [0.0, 1.0, 0.3]


def hidden(found, name, first, last):
    values = found.markers[name].copy()
    values[first : last + 1] = np.nan
    return Recording(**{**vars(found), "markers": {**found.markers, name: values}})


# ---- gaps


def test_gaps_up_to_the_limit_are_filled_and_counted():
    whole = recording(sway())
    gappy = hidden(hidden(whole, "A", 50, 53), "A", 90, 90)
    filled = fill_gaps(gappy, 4)
    assert filled.markers["A"] == pytest.approx(whole.markers["A"], abs=2e-5)  # of 10 mm, over an eighth of a period
    assert filled.markers["B"] is whole.markers["B"]
    assert filled.history == ("filled gaps of up to 4 samples by a cubic spline: marker 'A': 5 samples in 2 gaps",)


def test_a_gap_over_the_limit_is_an_error():
    with pytest.raises(ValueError, match=r"^take.csv, rows 58 to 62, marker 'B': a gap of 5 samples; at most 4 may be"):
        fill_gaps(hidden(recording(sway()), "B", 50, 54), 4)


@pytest.mark.parametrize(("first", "last", "rows"), [(0, 2, "rows 8 to 10"), (199, 199, "row 207")])
def test_a_gap_at_an_end_cannot_be_filled(first, last, rows):
    with pytest.raises(ValueError, match=rf"^take.csv, {rows}, marker 'B': \d samples are missing at the record's end"):
        fill_gaps(hidden(recording(sway()), "B", first, last), 10)


def without_rows(found, first, last):
    keep = np.r_[:first, last + 1 : len(found.time)]
    return Recording(
        **{
            **vars(found), "time": found.time[keep], "rows": found.rows[keep],
            "markers": {name: values[keep] for name, values in found.markers.items()},
        }
    )  # fmt: skip


def test_rows_that_lack_altogether_count_as_a_gap():
    whole = recording(sway())
    lacking = without_rows(whole, 50, 52)
    with pytest.raises(ValueError, match=r"^take.csv, rows 57 to 61: 4 sampling intervals lie between these"):
        resample(lacking, whole.time, "spline")
    with pytest.raises(ValueError, match=r"a gap of 3 samples; at most 2 may be filled"):
        fill_gaps(lacking, 2)
    filled = fill_gaps(lacking, 3)
    assert filled.time == pytest.approx(whole.time)
    assert filled.markers["C"] == pytest.approx(whole.markers["C"], abs=1e-5)
    assert filled.history[0] == "3 samples lack in 1 places of the file: rows of missing values put there"


def test_a_jump_of_the_clock_is_no_gap():
    jumped = recording(sway())
    jumped.time[100:] += 2.4 / RATE
    with pytest.raises(ValueError, match=r"^take.csv, rows 107 to 108: 3.4 sampling intervals lie between these"):
        fill_gaps(jumped, 10)


# ---- rates


@pytest.mark.parametrize(("method", "error"), [("spline", 1e-3), ("band-limited", 1e-3)])
@pytest.mark.parametrize("rate", [90.0, 360.0])
def test_resampling_keeps_a_slow_motion(method, error, rate):
    times = np.arange(int(0.8 * rate)) / rate + 0.1
    found = resample(recording(sway()), times, method)
    expected = 0.01 * np.sin(2 * np.pi * 5 * times)
    assert found.markers["A"][:, 1] == pytest.approx(expected, abs=error * 0.01)
    assert found.rate == pytest.approx(rate)
    assert f"resampled from 200 to {rate:g} Hz" in found.history[0]
    assert abs(found.rows[0] - (8 + 20)) <= 1


def test_only_the_band_limited_way_keeps_fast_motion_from_turning_up_slow():
    """70 Hz, sampled at 50 Hz, would look like 20 Hz."""
    fast = recording(sway(400, 70.0))
    times = np.arange(70) / 50 + 0.3
    naive = resample(fast, times, "spline").markers["A"][:, 1]
    assert np.abs(naive).max() > 0.008
    assert np.abs(resample(fast, times, "band-limited").markers["A"][:, 1]).max() < 1e-5


def test_resampling_stays_inside_the_record():
    with pytest.raises(ValueError, match=r"^take.csv: 0 to 2 s is asked for, but the record runs from 0 to 0.995 s$"):
        resample(recording(sway()), np.linspace(0, 2, 50), "spline")


def test_band_limited_needs_even_samples():
    uneven = recording(sway())
    uneven.time[::2] += 0.2 / RATE
    with pytest.raises(ValueError, match=r"band-limited resampling needs even ones; put a step 'resample' before$"):
        resample(uneven, np.linspace(0.1, 0.8, 50), "band-limited")


def test_the_steps_rate_or_the_experiments():
    released = release_at(recording(sway()), 0.1026, 0.0)
    found = Resample(rate=100.0).apply(released, RingDown())
    assert found.time[0] == pytest.approx(-0.10)
    assert found.time * 100 == pytest.approx(np.round(found.time * 100))
    found = Resample().apply(released, RingDown(rate=360, duration=0.25))
    assert found.time == pytest.approx(np.arange(91) / 360)
    with pytest.raises(ValueError, match="StaticStiffness has no sampling rate; give the step a rate"):
        Resample().apply(released, StaticStiffness())


def test_low_pass_has_no_phase_and_half_the_power_at_its_cutoff():
    slow, corner = recording(sway(800, 4.0)), recording(sway(800, 40.0))
    middle = slice(200, 600)
    kept = low_pass(slow, 40.0).markers["A"][middle]
    assert kept == pytest.approx(slow.markers["A"][middle], abs=2e-6)
    halved = low_pass(corner, 40.0).markers["A"][middle] - [0.1, 0, 0]
    raw = corner.markers["A"][middle] - [0.1, 0, 0]
    assert np.linalg.norm(halved) / np.linalg.norm(raw) == pytest.approx(math.sqrt(0.5), rel=5e-3)
    assert "-3 dB" in low_pass(slow, 40.0).history[0]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda r: low_pass(r, 100.0), "low-pass at 100 Hz is not below half the sampling rate of 200 Hz"),
        (lambda r: low_pass(crop(r, Window(first=0.02)), 5.0), "5 samples are too few for this low-pass"),
        (lambda r: low_pass(hidden(r, "A", 3, 4), 50.0), "1 samples are missing, and a low-pass needs all"),
    ],
)
def test_low_pass_refuses(change, message):
    with pytest.raises(ValueError) as refused:  # noqa: PT011
        change(recording(sway()))
    assert message.replace("1 samples", "2 samples") in str(refused.value)


# ---- frames


@given(st.tuples(*[st.floats(-1, 1)] * 3), st.tuples(*[st.floats(-0.5, 0.5)] * 3))
def test_kabsch_gives_back_a_rigid_motion(axis, shift):
    from scipy.spatial.transform import Rotation

    turn = Rotation.from_rotvec(3 * np.array(axis)).as_matrix()
    places = np.array([[0.1, 0, 0], [0.1, 0.02, 0], [0.1, 0, 0.04], [0.0, 0.01, 0.01]])
    rotation, moved = kabsch(places, places @ turn.T + shift)
    assert rotation == pytest.approx(turn, abs=1e-9)
    assert moved == pytest.approx(np.array(shift), abs=1e-9)


def test_alignment_finds_the_frame_and_says_what_remains():
    from scipy.spatial.transform import Rotation

    true = recording(sway())
    turn, shift = Rotation.from_rotvec([0.3, -1.0, 2.0]).as_matrix(), np.array([1.0, 2.0, 3.0])
    seen = {name: values @ turn.T + shift for name, values in true.markers.items()}
    found = Recording(**{**vars(true), "markers": seen, "up": turn @ [0.0, 0.0, 1.0]})
    places = {name: values[0] for name, values in true.markers.items()}
    aligned = align(found, places, 1e-4, Window(end=0.0))
    for name, values in true.markers.items():
        assert aligned.markers[name] == pytest.approx(values, abs=1e-12)
    assert aligned.up == pytest.approx([0, 0, 1])
    assert "aligned to the known places of A, B, C over 0 to 0 s (1 samples)" in aligned.history[0]


def test_alignment_refuses_another_or_a_mirrored_set():
    found = recording(sway())
    places = {name: values[0] for name, values in found.markers.items()}
    off = places | {"C": places["C"] + [0, 0, 0.003]}
    with pytest.raises(
        ValueError, match=r"^take.csv: align: marker '[AC]' stays [\d.]+ mm from its known place \(allowed"
    ):
        align(found, off, 1e-3, Window(end=0.0))
    four = Recording(**{**vars(found), "markers": found.markers | {"D": found.markers["A"] + [0.05, 0.01, 0.01]}})
    mirrored = {name: values[0] * [-1, 1, 1] for name, values in four.markers.items()}
    with pytest.raises(ValueError, match=r"another marker set, or a mirrored one$"):
        align(four, mirrored, 1e-3, Window(end=0.0))
    line = {name: np.array([0.1, 0.0, 0.01 * n]) for n, name in enumerate("ABC")}
    with pytest.raises(
        ValueError, match=r"^take.csv: align: an alignment needs three markers that do not lie on one li"
    ):
        align(Recording(**{**vars(found), "markers": {n: p + sway() for n, p in line.items()}}), line, 1, Window())


def test_axes_by_letters_and_turns():
    found = recording(sway(), wrench=np.tile(np.arange(6.0), (200, 1)), up=np.array([0.0, 1.0, 0.0]))
    mapped = MapAxes(x="z", y="x", z="y").apply(found, RingDown())
    assert mapped.markers["C"] == pytest.approx(found.markers["C"][:, [2, 0, 1]])
    assert mapped.wrench[0] == pytest.approx([2, 0, 1, 5, 3, 4])
    assert mapped.up == pytest.approx([0, 0, 1])
    assert mapped.history == ("axes: our x is the record's z, y its x, z its y",)
    only = MapAxes(x="z", y="x", z="y", only=("wrench",)).apply(found, RingDown())
    assert only.markers["C"] is found.markers["C"]
    assert only.wrench[0] == pytest.approx([2, 0, 1, 5, 3, 4])
    turned = Turn(about="x", angle=np.pi / 2).apply(found, RingDown())
    assert turned.up == pytest.approx([0, 0, 1])
    with pytest.raises(ValueError, match="would mirror the record"):
        MapAxes(x="y", y="x", z="z")


def test_rest_is_a_mean_and_says_over_what():
    motion = sway() + [0.0, 0.002, 0.0]
    found = take_rest(recording(motion), Window(last=0.2 - 1 / RATE))  # a whole period of 5 Hz
    assert found.rest["B"] == pytest.approx([0.1, 0.022, 0.0], abs=1e-9)
    assert found.markers["A"] == pytest.approx(sway(), abs=1e-9)
    assert found.history[0].startswith("rest: mean over 0.8 to 0.995 s (40 samples); markers scatter by up to")
    with pytest.raises(ValueError, match="rest needs places, but 'rest' has made them displacements"):
        take_rest(found, Window(last=0.1))
    with pytest.raises(ValueError, match=r"rest: marker 'A' is not seen throughout 0.945 to 0.995 s"):
        take_rest(hidden(recording(motion), "A", 190, 190), Window(last=0.05))


def test_windows_and_crops():
    found = crop(recording(sway()), Window(0.1, 0.2))
    assert found.time == pytest.approx(np.arange(20, 41) / RATE)
    assert found.history == ("cropped to 0.1 to 0.2 s (21 samples) of 200",)
    with pytest.raises(
        ValueError, match=r"^take.csv: crop: no sample between 2 s and its end; the record runs from 0 to"
    ):
        crop(recording(sway()), Window(start=2.0))


@pytest.mark.parametrize(
    ("kind", "fields", "message"),
    [
        (Crop, {}, "crop needs start, end, first or last"),
        (Crop, {"start": 1.0, "end": 0.5}, "start 1 s is not before end 0.5 s"),
        (Crop, {"first": 1.0, "last": 0.5}, "first and last together name no stretch"),
        (Rest, {}, "rest needs the stretch"),
        (Release, {}, "release needs either a threshold"),
        (Release, {"threshold": 0.001}, "release with a threshold needs the stretch in which the part is held"),
        (Release, {"threshold": 0.001, "at": 1.0, "first": 1.0}, "release needs either a threshold"),
    ],
)
def test_steps_say_what_they_need(kind, fields, message):
    with pytest.raises(ValueError, match=message):
        kind(**fields)


# ---- release


def falling(held=61, count=300, frequency=8.0, noise=0.0, late=0.4):
    """Held, let go ``late`` of an interval after the last held sample, then a decaying swing about 10 mm below."""
    time = (np.arange(count) - (held - 1) - late) / RATE
    swing = np.where(time > 0, np.exp(-5 * time) * np.cos(2 * np.pi * frequency * time), 1.0)
    motion = 0.01 * swing[:, None] * [0.0, 1.0, 0.0]
    return recording(motion + noise * np.random.default_rng(3).normal(size=motion.shape))


@pytest.mark.parametrize("noise", [0.0, 5e-6])
@pytest.mark.parametrize("late", [0.05, 0.4, 0.95])
def test_the_release_is_found_within_its_uncertainty(noise, late):
    found = detect_release(falling(noise=noise, late=late), 0.0002, Window(first=0.2))
    truth = (60 + late) / RATE
    assert found.release.uncertainty >= 1 / RATE
    assert abs(found.release.time - truth) <= found.release.uncertainty
    assert found.release.uncertainty < 2 / RATE
    assert found.time[np.abs(found.time).argmin()] == 0.0
    assert "time zero" in found.history[0]


def test_a_slow_start_is_less_certain():
    found = detect_release(falling(frequency=1.0), 0.002, Window(first=0.2))
    truth = 60.4 / RATE
    assert found.release.uncertainty > 4 / RATE
    assert 0 < found.release.time - truth <= found.release.uncertainty
    assert "more than one sample since the part starts slowly" in found.history[0]


def test_a_glitch_is_no_release():
    found = falling()
    for values in found.markers.values():
        values[45:47] += 0.004
    assert detect_release(found, 0.0005, Window(first=0.2)).release.time == pytest.approx(60.4 / RATE, abs=1 / RATE)


@pytest.mark.parametrize(
    ("change", "threshold", "message"),
    [
        (lambda r: r, 0.5, "release: no marker ever goes 500 mm away from the held state"),
        (lambda r: falling(noise=2e-4), 0.0005, "release: threshold 0.5 mm is within the noise of marker 'A'"),
        (lambda r: falling(held=31), 0.02, "release: threshold 20 mm is within the noise"),
        (lambda r: hidden(r, "B", 20, 21), 0.001, "release: marker 'B' is occluded while held"),
    ],
)
def test_a_release_that_cannot_be_found(change, threshold, message):
    with pytest.raises(ValueError) as refused:  # noqa: PT011
        detect_release(change(falling()), threshold, Window(first=0.25))
    assert str(refused.value).startswith(f"take.csv: {message}")


def test_nobody_looked_when_it_was_let_go():
    blind = falling()
    for name in "ABC":
        blind = hidden(blind, name, 55, 64)
    with pytest.raises(ValueError, match=r"^take.csv, row 63: release: no watched marker is seen here"):
        detect_release(blind, 0.001, Window(first=0.2))


# ---- forces


def test_forces_are_zeroed_moved_and_reversed():
    wrench = np.tile([1.0, 2.0, 3.0, 0.1, 0.2, 0.3], (200, 1))
    wrench[100:, :3] += [0.0, 10.0, 0.0]
    found = tare(recording(sway(), wrench=wrench), Window(first=0.2))
    assert found.wrench[150] == pytest.approx([0, 10, 0, 0, 0, 0])
    moved = move_moments(found, np.array([0.05, 0.0, 0.0]))
    # 10 N along y at the sensor have the moment -0.05 * 10 about a point that lies 50 mm further along x.
    assert moved.wrench[150] == pytest.approx([0, 10, 0, 0, 0, -0.5])
    assert reversed_wrench(moved).wrench[150] == pytest.approx([0, -10, 0, 0, 0, 0.5])
    with pytest.raises(ValueError, match="tare: the file has no forces and moments"):
        tare(recording(sway()), Window(first=0.2))


STIFFNESS = np.diag([1e5, 5e3, 500.0, 0.1, 30.0, 300.0])


def static_log(experiment, hold=0, rate=RATE, drift=0.0, order=range(6)):
    """Ramps out and back along every leg; ``hold`` samples rest at each increment."""
    steps = 40 * experiment.increments
    share = np.linspace(0, 1, steps + 1)
    if hold:
        share = np.insert(share, np.repeat(np.arange(40, steps + 1, 40), hold), np.repeat(share[40::40], hold))
    there_and_back = np.concatenate([np.zeros(30), share, share[::-1]])
    legs = experiment.legs()
    pose = np.vstack([np.outer(there_and_back, legs[n][1] * np.eye(6)[legs[n][0]]) for n in order])
    n = len(pose)
    wrench = pose @ STIFFNESS + drift * np.arange(n)[:, None]
    found = Recording(
        "log.csv", np.arange(n) / rate, rate, np.arange(n) + 2, wrench=wrench, pose=pose + [0.4, 0.1, 0.2, 0, 0, 0]
    )
    return take_rest(found, Window(first=0.1))


@pytest.mark.parametrize("hold", [0, 25])
def test_legs_are_found_and_averaged_at_the_increments(hold):
    experiment = StaticStiffness(increments=4)
    found = find_legs(static_log(experiment, hold), experiment, 0.1)
    assert found.leg.tolist() == [n for n in range(6) for _ in range(4)]
    expected = [end * k / 4 for _, end in experiment.legs() for k in (1, 2, 3, 4)]
    driven = [found.pose[row, experiment.legs()[leg][0]] for row, leg in enumerate(found.leg)]
    assert driven == pytest.approx(expected, rel=0.03)
    assert found.wrench == pytest.approx(found.pose @ STIFFNESS, abs=1e-9)
    assert found.history[-1].startswith(
        "legs found from the motion: 6 legs, ways out only; each of 24 increments is the"
    )


def test_legs_in_another_order_and_by_a_column():
    experiment = StaticStiffness(increments=4)
    log = static_log(experiment, order=[5, 0, 2, 4, 1, 3])
    assert find_legs(log, experiment, 0.1).pose == pytest.approx(
        find_legs(static_log(experiment), experiment, 0.1).pose
    )
    column = np.repeat([5, 0, 2, 4, 1, 3], len(log.time) // 6)
    named = find_legs(Recording(**{**vars(log), "leg": column}), experiment, 0.1)
    assert "legs found from the file's column" in named.history[-1]
    with pytest.raises(ValueError, match=r"column of legs: 6; legs are 0 to 5"):
        find_legs(Recording(**{**vars(log), "leg": column + 2}), experiment, 0.1)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            lambda e: static_log(e, order=[0, 1, 2, 4, 5]),
            "log.csv: leg 3 (along z to -5 mm) is not in the record; the furthest that way is 0 mm",
        ),
        (
            lambda e: static_log(StaticStiffness(translation=0.004)),
            "log.csv: leg 0 (along y to 5 mm) is not in the record",
        ),
        (
            lambda e: static_log(StaticStiffness(translation=0.006)),
            "log.csv, rows 41 to 424: leg 0 (along y to 5 mm) goes",
        ),
        (
            lambda e: static_log(e, order=[0, 1, 2, 3, 4, 5, 0]),
            "log.csv, rows 43 to 422 and log.csv, rows 2635 to 3014: leg 0 (along y to 5 mm) stands there twice",
        ),
    ],
)
def test_legs_that_do_not_fit(change, message):
    experiment = StaticStiffness(increments=5)
    with pytest.raises(ValueError) as refused:  # noqa: PT011
        find_legs(change(experiment), experiment, 0.1)
    assert str(refused.value).startswith(message)


def test_a_tip_that_is_not_held_is_noticed():
    experiment = StaticStiffness()
    log = static_log(experiment)
    log.pose[:, 2] += 0.1 * log.pose[:, 1]
    with pytest.raises(ValueError, match=r"while the tip moves along y, it also moves along z by 10 % of that travel"):
        find_legs(log, experiment, 0.1)
    with pytest.raises(ValueError, match=r"put a step 'rest' before"):
        find_legs(Recording(**{**vars(log), "rest": {}}), experiment, 0.1)
