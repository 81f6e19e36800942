"""From files to records: the same motion through every format, and everything that is refused on the way."""

import csv
import hashlib
import os
from pathlib import Path

import numpy as np
import pytest

from lab.experiments import BaseShake, RingDown, StaticStiffness
from lab.measures import dominant_mode, tracking_error
from lab.recordings import LabModel, inputs, lab_model, perform
from lab.specimens import TwistedBeam

RATE = 200.0
BEAM = TwistedBeam(twist=np.pi / 2)
EXPERIMENT = RingDown(rate=RATE, duration=0.5, markers=((0.0, 0.01, 0.0), (0.0, -0.01, 0.0), (0.0, 0.0, 0.01)))
#: Rest places of the tip's markers and of three on the clamp in our axes, m.
PLACES = {
    "Tip-1": (0.05, 0.01, 0.0), "Tip-2": (0.05, -0.01, 0.0), "Tip-3": (0.05, 0.0, 0.01),
    "Base-1": (0.0, 0.02, 0.0), "Base-2": (0.0, -0.02, 0.0), "Base-3": (-0.01, 0.0, 0.02),
}  # fmt: skip
#: The lab's axes are Motive's: y up, the beam along z; our y is up, then, and our z the lab's x.
TO_LAB = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
RELEASED = 0.4


def swing(time):
    """Displacement of the tip after the release in our axes, (n, 3), m."""
    free = np.where(time > 0, np.exp(-4 * time), 1.0)
    y = -0.01 * free * np.cos(2 * np.pi * 8 * np.clip(time, 0, None))
    return np.column_stack([0 * y, y, 0.3 * y])


def motions():
    """Places of all markers in the lab's axes, (n, 3), m; held for 0.4 s, then free for 2.6 s."""
    time = np.arange(601) / RATE
    moved = swing(time - RELEASED)
    mirror = np.diag([1.0, 1.0, -1.0])  # keeps TO_LAB a rotation
    return time, {
        name: (np.array(place) + (moved if name.startswith("Tip") else 0 * moved)) @ (TO_LAB @ mirror).T
        + [1.0, 0.8, 2.0]
        for name, place in PLACES.items()
    }


AXES = {"do": "axes", "x": "z", "y": "y", "z": "-x"}
STEPS = [
    AXES,
    {"do": "fill-gaps", "limit": 4},
    {"do": "release", "threshold": "0.2 mm", "first": "0.3 s"},
    {"do": "rest", "last": "0.5 s"},
    {"do": "crop", "start": "0 s", "end": "0.5 s"},
]
TABLE = {
    "kind": "markers",
    "columns": "{marker}_{axis}_mm",
    "unit": "mm",
    "time": "time_s",
    "rate": "200 Hz",
    "up": "y",
}


def document(**changes):
    return {"reader": TABLE, "markers": ["Tip-1", "Tip-2", "Tip-3"], "steps": STEPS} | changes


def write_table(path, change=None):
    time, markers = motions()
    titles = ["time_s", *(f"{name}_{axis}_mm" for name in markers for axis in "xyz")]
    rows = np.column_stack([time, *(values * 1e3 for values in markers.values())])
    cells = [[f"{value:.6f}" for value in row] for row in rows]
    with path.open("w", newline="") as file:
        csv.writer(file).writerows([titles, *(change(cells) if change else cells)])
    return path


def write_motive(path):
    """Millimetres, Y-up; Tip-2 hidden for three samples in free motion."""
    time, markers = motions()
    facts = ["Format Version", "1.23", "Take Name", "beam", "Capture Frame Rate", "200.000000", "Length Units"]
    columns = [("Marker", name, "Position", axis) for name in markers for axis in "XYZ"]
    lines = [[*facts, "Millimeters", "Coordinate Space", "Global"], []]
    for row, title in enumerate(("Type", "Name", "", "")):
        lead = ["", title] if row < 3 else ["Frame", "Time (Seconds)"]
        lines.append(lead + [column[row] for column in columns])
    for number, at in enumerate(time):
        cells = [
            "" if name == "Tip-2" and 150 <= number < 153 else f"{1e3 * markers[name][number]['XYZ'.index(axis)]:.6f}"
            for _, name, _, axis in columns
        ]
        lines.append([str(number), f"{at:.6f}", *cells])
    path.write_text("\n".join(",".join(line) for line in lines) + "\n")
    return path


def write_c3d(path):
    import ezc3d

    _, markers = motions()
    made = ezc3d.c3d()
    made["parameters"]["POINT"]["RATE"]["value"] = [RATE]
    made["parameters"]["POINT"]["LABELS"]["value"] = list(markers)
    made["parameters"]["POINT"]["UNITS"]["value"] = ["mm"]
    places = np.stack(list(markers.values())).transpose(2, 0, 1) * 1e3
    places[:, 1, 150:153] = np.nan
    made["data"]["points"] = np.concatenate([places, np.ones_like(places[:1])])
    made.write(str(path))
    return path


@pytest.mark.parametrize(
    ("write", "name", "reader"),
    [
        (write_table, "take.csv", TABLE),
        (write_motive, "take.csv", "motive"),
        (write_c3d, "take.c3d", {"kind": "c3d", "up": "y"}),
    ],
)
def test_every_format_gives_the_same_record(tmp_path, write, name, reader):
    path = write(tmp_path / name)
    record = perform(BEAM, EXPERIMENT, lab_model(document(reader=reader)), path)
    assert record.origin == "lab"
    assert record.completed
    assert record["time"] == pytest.approx(np.arange(101) / RATE)
    expected = np.repeat(swing(record["time"])[:, None], 3, axis=1)
    assert record["markers"].shape == expected.shape
    assert record["markers"] == pytest.approx(expected, abs=1e-5)  # the spline over three hidden samples
    assert record.channels["markers"].dims == ("time", "marker", "axis")
    assert record.how["files"] == {name: hashlib.sha256(path.read_bytes()).hexdigest()}
    assert record.how["release_in_file_s"] == pytest.approx(RELEASED)
    assert record.how["release_uncertainty_s"] == pytest.approx(1 / RATE)
    assert record.how["up"] == pytest.approx([0, 1, 0])
    told = record.how["steps"]
    assert [line.split(maxsplit=1)[0] for line in told] == ["read", "axes:", "filled", "release", "rest:", "cropped"]
    hidden = "there were none" if reader is TABLE else "marker 'Tip-2': 3 samples in 1 gaps"
    assert told[2].endswith(hidden)
    assert {"release_y", "frequency"} <= set(EXPERIMENT.reduce(record))


def test_steps_are_carried_out_in_their_order_and_no_other(tmp_path):
    path = write_table(tmp_path / "take.csv")
    steps = [STEPS[0], STEPS[2], {"do": "low-pass", "cutoff": "60 Hz"}, STEPS[3], {"do": "resample"}]
    finer = RingDown(**EXPERIMENT.model_dump() | {"rate": 360.0})
    record = perform(BEAM, finer, lab_model(document(steps=steps)), path)
    words = [line.split(maxsplit=1)[0] for line in record.how["steps"]]
    assert words == ["read", "axes:", "release", "low-passed", "rest:", "resampled"]
    assert len(record["time"]) == 181
    away = record["time"] > 0.03  # a low-pass smears the release itself
    expected = np.repeat(swing(record["time"])[:, None], 3, axis=1)
    assert record["markers"][away] == pytest.approx(expected[away], abs=2e-5)


def test_alignment_to_the_clamp_finds_our_axes(tmp_path):
    """Instead of axes by letters: three markers on the clamp with known places, in a rig turned by 20 deg."""
    path = write_table(tmp_path / "take.csv")
    places = {
        name: [f"{1e3 * value} mm" for value in place] for name, place in PLACES.items() if name.startswith("Base")
    }
    steps = [
        {"do": "turn", "about": "y", "angle": "20 deg"},
        {"do": "align", "places": places, "tolerance": "0.1 mm"},
        *STEPS[2:],
    ]
    record = perform(BEAM, EXPERIMENT, lab_model(document(steps=steps)), path)
    expected = np.repeat(swing(record["time"])[:, None], 3, axis=1)
    assert record["markers"] == pytest.approx(expected, abs=5e-6)
    assert record.how["rest_places_m"]["Tip-3"] == pytest.approx(PLACES["Tip-3"], abs=1e-5)


def test_a_computed_file_is_not_passed_for_a_measured_one(tmp_path):
    path = write_table(tmp_path / "take.csv")
    assert perform(BEAM, EXPERIMENT, lab_model(document(origin="virtual-lab")), path).origin == "virtual-lab"


def test_a_resolved_model_does_the_same(tmp_path):
    path = write_table(tmp_path / "take.csv")
    model = lab_model(document(files={"a": "take.csv"}))
    again = LabModel.model_validate_json(model.model_dump_json())
    assert again == model
    assert np.array_equal(
        perform(BEAM, EXPERIMENT, again, path)["markers"], perform(BEAM, EXPERIMENT, model, path)["markers"]
    )


# ---- refusals


def without(*names):
    return [step for step in STEPS if step["do"] not in names]


def hide(first, last):
    def change(cells):
        for row in cells[first : last + 1]:
            row[1:4] = ["", "", ""]
        return cells

    return change


EMPTY = TABLE | {"missing": [""]}


@pytest.mark.parametrize(
    ("model", "experiment", "change", "message"),
    [
        (
            document(steps=STEPS[:4]), RingDown(rate=360.0), None,
            "take.csv: sampled at 200 Hz, the experiment at 360 Hz; add a step {do: resample, method: spline}, or give "
            "the experiment the record's rate",
        ),
        (
            document(steps=STEPS[:4]), EXPERIMENT, None,
            "take.csv: 601 samples from -0.4 to 2.6 s, the experiment has 101 from 0 to 0.5 s; add a step {do: crop, "
            "start: 0 s, end: 0.5 s}",
        ),
        (
            document(steps=STEPS[:4]), RingDown(rate=RATE, duration=5.0), None,
            "take.csv: the record ends 2.6 s after the release, the experiment lasts 5 s; shorten its duration",
        ),
        (
            document(steps=[*STEPS[:4], {"do": "resample"}]), RingDown(rate=360.0, duration=5.0), None,
            "take.csv: 0 to 5 s is asked for, but the record runs from -0.4 to 2.6 s",
        ),
        (
            document(steps=[AXES, {"do": "release", "at": "0.4 s"}, STEPS[3], {"do": "resample", "rate": "200 Hz"},
                            {"do": "crop", "start": "0.1 s", "end": "0.6 s"}]),
            EXPERIMENT, None,
            "take.csv: 101 samples from 0.1 to 0.6 s, the experiment has 101 from 0 to 0.5 s; add a step {do: crop, "
            "start: 0 s, end: 0.5 s}",
        ),
        (
            document(steps=without("release")), EXPERIMENT, None,
            "take.csv: when the part was released is not known; add a step 'release'",
        ),
        (
            document(steps=without("rest")), EXPERIMENT, None,
            "take.csv: displacements are from rest; add a step 'rest', as {do: rest, last: 0.5 s}",
        ),
        (
            document(reader=EMPTY, steps=without("fill-gaps")), EXPERIMENT, hide(120, 122),
            "take.csv, rows 122 to 124, marker 'Tip-1': 3 samples are missing, and the record needs all; crop them off "
            "or put a step 'fill-gaps' before",
        ),
        (
            document(reader=EMPTY), EXPERIMENT, hide(120, 124),
            "take.csv, rows 122 to 126, marker 'Tip-1': a gap of 5 samples; at most 4 may be filled",
        ),
        (
            document(markers=["Tip-1", "Tip-2"]), EXPERIMENT, None,
            "take.csv: 2 markers are named (Tip-1, Tip-2), but the experiment has 3; name one for each in 'markers'",
        ),
        (
            document(markers=["Tip-1", "Tip-2", "Tip-4"]), EXPERIMENT, None,
            "take.csv: marker 'Tip-4' is missing; the file has Tip-1, Tip-2, Tip-3, Base-1, Base-2, Base-3",
        ),
        (
            document(specimen="beam-90"), EXPERIMENT, None,
            "take.csv: a recording of a specimen that it does not name, not of 'beam-90' (key 'specimen' of its "
            "sidecar)",
        ),
        (
            document(reader=TABLE | {"specimen": "beam-45"}, specimen="beam-90"), EXPERIMENT, None,
            "take.csv: a recording of 'beam-45', not of 'beam-90' (key 'specimen' of its sidecar)",
        ),
        (
            document(reader=TABLE | {"declared": {"twist": "45 deg"}}), EXPERIMENT, None,
            "take.csv: a recording of another specimen: twist 45 deg, the study's has 90 deg",
        ),
        (
            document(reader=TABLE | {"declared": {"colour": "1 m"}}), EXPERIMENT, None,
            "take.csv: declared colour: TwistedBeam has no number 'colour'",
        ),
        (
            document(), BaseShake(), None,
            "take.csv: recordings of BaseShake cannot be read; RingDown and StaticStiffness can",
        ),
        (
            document(steps=[*STEPS, {"do": "legs"}]), EXPERIMENT, None, "legs: RingDown has none",
        ),
        (
            document(), StaticStiffness(), None, "take.csv: the file has no forces and moments",
        ),
    ],
)  # fmt: skip
def test_refusals(tmp_path, model, experiment, change, message):
    path = write_table(tmp_path / "take.csv", change)
    if isinstance(experiment, StaticStiffness):
        message, model = message.replace("the file has no", "a static stiffness test needs the"), document(steps=[])
    with pytest.raises(ValueError) as refused:  # noqa: PT011
        perform(BEAM, experiment, lab_model(model), path)
    assert str(refused.value) == message


def test_a_record_that_stands_on_its_head_is_noticed(tmp_path):
    path = write_table(tmp_path / "take.csv")
    model = lab_model(document())
    down = EXPERIMENT.model_dump() | {"own_weight": np.pi}  # along -y, where the axes of these steps have it
    assert perform(BEAM, RingDown(**down), model, path).completed
    with pytest.raises(ValueError, match=r"^take.csv: after all steps down is \(-?0, -1, -?0\), 90 deg from the exper"):
        perform(BEAM, RingDown(**down | {"own_weight": np.pi / 2}), model, path)


def test_markers_that_are_not_as_far_apart_as_the_experiments(tmp_path):
    path = write_table(tmp_path / "take.csv")
    model = lab_model(document(marker_tolerance="0.1 mm"))
    assert perform(BEAM, EXPERIMENT, model, path).completed
    other = RingDown(**EXPERIMENT.model_dump() | {"markers": ((0, 0.01, 0), (0, -0.01, 0), (0, 0, 0.012))})
    with pytest.raises(
        ValueError, match=r"^take.csv: markers 'Tip-[12]' and 'Tip-3' are 14.14 mm apart at rest, the exper"
    ):
        perform(BEAM, other, model, path)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"reader": "vicon"}, "Input tag 'vicon' found using 'kind' does not match any of the expected tags"),
        ({"steps": [{"do": "smooth"}]}, "steps.0: Input tag 'smooth' found using 'do' does not match"),
        ({"steps": [{"do": "low-pass", "cutoff": 60}]}, "60 has no unit; write it like '60 Hz'"),
        ({"steps": [{"do": "low-pass", "cutoff": "60 mm"}]}, "'60 mm' has the unit millimeter; expected one like Hz"),
        ({"steps": [{"do": "fill-gaps"}]}, "limit: Field required"),
        ({"steps": [AXES | {"x": "y"}]}, "x, y and z must each be used once"),
        ({"markers": ["A", "A"]}, "markers: 'A' stands twice"),
        ({"reader": "force-torque"}, "markers: a force-torque file has none"),
        ({"filter": "60 Hz"}, "filter: Extra inputs are not permitted"),
    ],
)
def test_a_model_that_is_wrong(changes, message):
    with pytest.raises(ValueError) as refused:  # noqa: PT011
        lab_model(document(**changes))
    assert message in str(refused.value)
    assert "\n" not in str(refused.value)


# ---- static stiffness

STATIC = StaticStiffness(increments=4)
STIFFNESS = np.diag([9e4, 5e3, 400.0, 0.2, 30.0, 300.0])
STIFFNESS[1, 2] = STIFFNESS[2, 1] = 60.0
FORCES = {
    "kind": "force-torque", "force": ["Fx", "Fy", "Fz"], "force_unit": "N", "moment": ["Tx", "Ty", "Tz"],
    "moment_unit": "N*m", "time": "t", "limits": {"Fy": "145 N", "Tx": "5 N*m"},
    "pose": {"position": ["X", "Y", "Z"], "unit": "mm", "rotation": ["A", "B", "C"]},
}  # fmt: skip
STATIC_STEPS = [
    {"do": "rest", "first": "0.2 s"},
    {"do": "tare", "first": "0.2 s"},
    {"do": "reverse-wrench"},
    {"do": "moments", "to": ["30 mm", "0 mm", "0 mm"]},
    {"do": "legs"},
]


def write_log(path, change=None):
    """A robot that goes out and back along every leg; the sensor feels the reaction 30 mm before the tip's centre."""
    share = np.concatenate([np.zeros(30), np.linspace(0, 1, 161), np.linspace(1, 0, 161)])
    motion = np.vstack([np.outer(share, end * np.eye(6)[dof]) for dof, end in STATIC.legs()])
    wrench = motion @ STIFFNESS
    felt = -wrench
    felt[:, 3:] += np.cross([0.03, 0, 0], felt[:, :3])
    felt += [0.4, -1.2, 9.0, 0.01, 0.02, 0.03]  # what the sensor shows without load
    felt[:, 2] += 1e-4 * np.sin(np.arange(len(felt)))
    rows = np.column_stack([np.arange(len(felt)) / 100, felt, motion[:, :3] * 1e3 + [400, 0, 200], motion[:, 3:]])
    if change:
        change(rows)
    titles = ["t", "Fx", "Fy", "Fz", "Tx", "Ty", "Tz", "X", "Y", "Z", "A", "B", "C"]
    np.savetxt(path, rows, fmt="%.9f", delimiter=",", header=",".join(titles), comments="")
    return path


def test_a_log_of_robot_and_sensor_becomes_a_stiffness(tmp_path):
    path = write_log(tmp_path / "static.csv")
    (tmp_path / "static.csv.yaml").write_text("specimen: beam-90\n")
    model = lab_model({"reader": FORCES, "steps": STATIC_STEPS, "specimen": "beam-90"})
    record = perform(BEAM, STATIC, model, path)
    assert record["leg"].tolist() == [leg for leg in range(6) for _ in range(4)]
    assert record["motion"].shape == record["wrench"].shape == (24, 6)
    found = STATIC.reduce(record)
    assert found["k_yy"].value == pytest.approx(5e3, rel=1e-3)
    assert found["k_zz"].value == pytest.approx(400, rel=1e-3)
    assert found["k_yz"].value == pytest.approx(60, rel=1e-2)
    assert found["n_xx"].value == pytest.approx(0.2, rel=1e-3)
    assert set(record.how["files"]) == {"static.csv", "static.csv.yaml"}
    assert [file.name for file in inputs(model, path)] == ["static.csv", "static.csv.yaml"]
    assert record.how["steps"][-1].startswith("legs found from the motion")


def saturate(rows):
    rows[:, 2] = np.clip(rows[:, 2], -20, 100)


@pytest.mark.parametrize(
    ("reader", "steps", "change", "message"),
    [
        (FORCES, STATIC_STEPS, saturate, "static.csv, rows 153 to 232, column 'Fy': -20 is saturated, flat at its"),
        (FORCES | {"limits": {"Fy": "20 N"}}, STATIC_STEPS, None, "static.csv, rows 153 to 232, column 'Fy': -20.1062"),
        (
            FORCES,
            STATIC_STEPS[:-1],
            None,
            "static.csv: the log is not yet in legs and increments; add a step {do: legs}",
        ),
        (FORCES | {"pose": None}, STATIC_STEPS[1:4], None, "static.csv: a static stiffness test needs the pose"),
        (
            FORCES,
            STATIC_STEPS[1:],
            None,
            "static.csv: legs: the pose is not yet the motion from rest; put a step 'rest'",
        ),
    ],
)
def test_refusals_of_a_log(tmp_path, reader, steps, change, message):
    path = write_log(tmp_path / "static.csv", change)
    with pytest.raises(ValueError) as refused:  # noqa: PT011
        perform(BEAM, STATIC, lab_model({"reader": reader, "steps": steps}), path)
    assert str(refused.value).startswith(message)


def test_a_ring_down_needs_markers(tmp_path):
    path = write_log(tmp_path / "static.csv")
    with pytest.raises(ValueError, match=r"static.csv: 0 markers are named \(none\), but the experiment has 3"):
        perform(BEAM, EXPERIMENT, lab_model({"reader": FORCES, "steps": []}), path)


# ---- real recordings

SILICONE = Path(
    os.environ.get("SCRAM_SILICONE_BEAM")
    or Path(__file__).resolve().parents[3] / "shared" / "reference" / "ringdown_silicone_beam"
)
SILICONE_BEAM = TwistedBeam(length=0.1, width=0.03, thickness=0.03, twist=0.0)


@pytest.mark.skipif(
    not SILICONE.is_dir(), reason="the silicone beam's recordings are not here (SCRAM_SILICONE_BEAM names their folder)"
)
@pytest.mark.parametrize(
    ("name", "frequency", "drop"), [("beam_gravity_V2_a.csv", 7.79, 6.5e-3), ("beam_load101_V2_a.csv", 3.38, 25.5e-3)]
)
def test_real_recordings_are_read(name, frequency, drop):
    """Frequencies and drops as those who converted the files saw them."""
    reader = TABLE | {"columns": "{marker}_{axis}_m", "unit": "m", "rate": "100 Hz", "up": "x"}
    steps = [
        {"do": "axes", "x": "z", "y": "y", "z": "-x"},
        {"do": "release", "threshold": "1 mm", "first": "0.2 s"},
        {"do": "rest", "last": "0.5 s"},
        {"do": "crop", "start": "0 s", "end": "2 s"},
    ]
    model = lab_model({"reader": reader, "markers": ["Tip-1", "Tip-2", "Tip-3"], "steps": steps})
    own = {"own_weight": np.pi / 2} if "own_weight" in RingDown.model_fields else {}
    record = perform(SILICONE_BEAM, RingDown(rate=100.0, duration=2.0, **own), model, SILICONE / name)
    found, damping = dominant_mode(record["time"], record["markers"].mean(axis=1)[:, 1:])
    assert found == pytest.approx(frequency, rel=0.02)
    assert 0.04 < damping < 0.09
    assert abs(record["markers"][0].mean(axis=0)[2]) == pytest.approx(drop, rel=0.1)
    assert tracking_error(record["markers"], record["markers"]) == 0.0
