"""Tables of markers, and of forces, with their sidecars."""

import numpy as np
import pytest

from lab.readers import ForceTorqueOptions, MarkerTableOptions, read, sidecar_of

RATE = 100.0
MARKERS = MarkerTableOptions(columns="{marker}_{axis}_mm", unit="mm", time="time_ms", time_unit="ms", up="z")
FORCES = ForceTorqueOptions(
    force=("Fx", "Fy", "Fz"), force_unit="N", moment=("Tx", "Ty", "Tz"), moment_unit="N*mm", time="t"
)


def write(path, titles, values, change=None, lead="# made up\n"):
    cells = [[f"{value:.9g}" for value in row] for row in values]
    cells = change(cells) if change else cells
    path.write_text(lead + "\n".join(",".join(row) for row in [titles, *cells]) + "\n", encoding="utf-8")
    return path


def marker_rows(count=20):
    time = np.arange(count) / RATE
    places = np.array([0.01, 0.02, 0.03, 0.04, 0.05, 0.06]) + 0.001 * np.sin(9 * time)[:, None]
    return np.column_stack([time * 1e3, places * 1e3]), places


TITLES = ["time_ms", "A_x_mm", "A_y_mm", "A_z_mm", "B_1_X_mm", "B_1_Y_mm", "B_1_Z_mm"]


def test_a_table_of_markers(tmp_path):
    rows, places = marker_rows()
    found = read(write(tmp_path / "a.csv", TITLES, rows), MARKERS)
    assert list(found.markers) == ["A", "B_1"]
    assert found.markers["B_1"] == pytest.approx(places[:, 3:], abs=1e-9)
    assert found.rate == pytest.approx(RATE)
    assert found.up == pytest.approx([0, 0, 1])
    assert found.rows[0] == 3  # a comment and the titles stand above


def test_a_rate_in_the_place_of_a_time_column(tmp_path):
    rows, _ = marker_rows()
    options = MarkerTableOptions(columns="{marker}_{axis}_mm", unit="mm", rate=50.0)
    assert read(write(tmp_path / "a.csv", TITLES, rows), options).time[-1] == pytest.approx(19 / 50)


def test_rounded_time_stamps_follow_the_stated_rate(tmp_path):
    """At 360 Hz, stamps in whole milliseconds lie 2 and 3 ms apart."""
    rows, _ = marker_rows(400)
    rows[:, 0] = np.round(np.arange(400) / 0.36)
    found = read(write(tmp_path / "a.csv", TITLES, rows), MARKERS.model_copy(update={"rate": 360.0}))
    assert found.time == pytest.approx(np.arange(400) / 360)
    assert "within 0.444 ms" in found.history[0]


def test_cells_that_stand_for_no_value(tmp_path):
    rows, _ = marker_rows()

    def hide(cells):
        cells[4][1:4] = ["NaN", "NaN", "NaN"]
        return cells

    path = write(tmp_path / "a.csv", TITLES, rows, hide)
    with pytest.raises(ValueError, match=r"^a.csv, row 7, column 'A x': 'NaN' is not a number$"):
        read(path, MARKERS)
    found = read(path, MARKERS.model_copy(update={"missing": ("NaN",)}))
    assert np.isnan(found.markers["A"][4]).all()
    assert "occluded samples: A 1" in found.history[0]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"columns": "{marker}.{axis}"}, "a.csv: no column fits the pattern '{marker}.{axis}'; it has time_ms, A_x_mm"),
        (
            {"columns": "{marker}_x"},
            "a.csv: the pattern '{marker}_x' of the columns needs {marker} and {axis} once each",
        ),
        ({"columns": "{marker}_{axis}_m{axis}"}, "a.csv: the pattern"),
        ({"unit": "ell"}, "a.csv: unknown unit 'ell'; expected one like m"),
        ({"unit": "kg"}, "a.csv: unknown unit 'kg'; expected one like m"),
        ({"unit": None}, "a.csv: 'unit' is given neither in the study nor in a sidecar a.csv.yaml"),
        ({"time": "clock"}, "a.csv: column 'clock' is missing; the file has time_ms, A_x_mm"),
        ({"time": None}, "a.csv: neither a rate nor a time column is given; one of them is needed"),
        ({"rate": 120.0}, "a.csv: stated rate 120 Hz, but the time column runs at 100 Hz"),
        ({"limits": {"A_x_mm": "10.2 mm"}}, "a.csv, rows 6 to 22, column 'A_x_mm': 10.2667 is saturated, at its limit"),
        ({"limits": {"A_x_mm": "1 N"}}, "a.csv: limit of column 'A_x_mm': '1 N' has the unit newton"),
    ],
)
def test_refusals_of_markers(tmp_path, options, message):
    rows, _ = marker_rows()
    path = write(tmp_path / "a.csv", TITLES, rows)
    with pytest.raises(ValueError) as refused:  # noqa: PT011
        read(path, MARKERS.model_copy(update=options))
    assert str(refused.value).startswith(message)


def test_markers_without_all_axes_and_titles_that_stand_twice(tmp_path):
    rows, _ = marker_rows()
    with pytest.raises(ValueError, match=r"^a.csv: marker 'B_1' has no column for z$"):
        read(write(tmp_path / "a.csv", TITLES[:6], rows[:, :6]), MARKERS)
    with pytest.raises(ValueError, match=r"^a.csv: two columns are 'A_x_mm' by the pattern"):
        read(write(tmp_path / "a.csv", [*TITLES[:2], "A_x_mm", *TITLES[3:]], rows), MARKERS)


# ---- sidecars


def test_study_and_sidecar_complete_each_other(tmp_path):
    rows, places = marker_rows()
    path = write(tmp_path / "a.csv", TITLES, rows)
    beside = tmp_path / "a.csv.yaml"
    beside.write_text("unit: mm\nspecimen: beam-90\nrate: 100 Hz\ndeclared: {twist: 90 deg}\n")
    assert sidecar_of(path) == beside
    found = read(path, MarkerTableOptions(columns="{marker}_{axis}_mm", time="time_ms", time_unit="ms"))
    assert found.markers["A"] == pytest.approx(places[:, :3], abs=1e-9)
    assert found.specimen == "beam-90"
    assert found.declared == {"twist": "90 deg"}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("unit: m", "a.csv.yaml: unit is 'm', but the study says 'mm'"),
        ("unti: mm", "a.csv.yaml: unti: Extra inputs are not permitted"),
        ("rate: 100", "a.csv.yaml: rate: 100 has no unit; write it like '100 Hz'"),
        ("kind: motive", "a.csv.yaml: kind: Input should be 'markers'"),
        ("- unit", "a.csv.yaml: a sidecar holds 'key: value' lines"),
        ("{", "a.csv.yaml: not readable as YAML"),
    ],
)
def test_a_sidecar_that_is_wrong(tmp_path, text, message):
    rows, _ = marker_rows()
    path = write(tmp_path / "a.csv", TITLES, rows)
    (tmp_path / "a.csv.yaml").write_text(text)
    with pytest.raises(ValueError) as refused:  # noqa: PT011
        read(path, MARKERS)
    assert str(refused.value).startswith(message)


def test_a_resolved_study_does_not_contradict_a_sidecar(tmp_path):
    """It names every field, defaults too."""
    rows, _ = marker_rows()
    path = write(tmp_path / "a.csv", TITLES, rows)
    (tmp_path / "a.csv.yaml").write_text("specimen: beam-90")
    resolved = MarkerTableOptions.model_validate_json(MARKERS.model_dump_json())
    assert read(path, resolved).specimen == "beam-90"


# ---- forces


def force_rows(count=60):
    time = np.arange(count) / RATE
    wrench = np.array([1.0, 2.0, 3.0, 40.0, 50.0, 60.0]) * np.sin(7 * time + 0.2)[:, None]
    return np.column_stack([time, wrench]), wrench * [1, 1, 1, 1e-3, 1e-3, 1e-3]


F_TITLES = ["t", "Fx", "Fy", "Fz", "Tx", "Ty", "Tz"]


def test_forces_and_moments(tmp_path):
    rows, wrench = force_rows()
    found = read(write(tmp_path / "f.csv", F_TITLES, rows), FORCES)
    assert found.wrench == pytest.approx(wrench, abs=1e-8)
    assert found.pose is None
    assert "saturation looked for at 0 stated limits and in 5 equal extreme samples" in found.history[0]


def test_a_turned_sensor(tmp_path):
    rows, wrench = force_rows()
    turned = FORCES.model_copy(update={"axes": {"x": "z", "y": "-y", "z": "x"}})
    found = read(write(tmp_path / "f.csv", F_TITLES, rows), turned)
    assert found.wrench == pytest.approx(wrench[:, [2, 1, 0, 5, 4, 3]] * [1, -1, 1, 1, -1, 1], abs=1e-8)
    for axes, message in (
        ({"x": "y", "y": "x", "z": "z"}, "would mirror the record"),
        ({"x": "y", "y": "y", "z": "z"}, "x, y and z must each be used once"),
        ({"x": "y", "y": "-x"}, "x, y and z must each be given"),
    ):
        with pytest.raises(ValueError, match=message):
            read(tmp_path / "f.csv", FORCES.model_copy(update={"axes": axes}))


def test_a_channel_at_its_limit_is_refused(tmp_path):
    rows, _ = force_rows()
    path = write(tmp_path / "f.csv", F_TITLES, np.clip(rows, -100, 2.9))
    limited = FORCES.model_copy(update={"limits": {"Fz": "2900 mN"}})
    with pytest.raises(
        ValueError, match=r"^f.csv, rows 19 to 26, column 'Fz': 2.9 is saturated, at its limit of 2900 mN$"
    ):
        read(path, limited)
    read(path, limited.model_copy(update={"limits": {"Fz": "3 N"}, "flat_samples": 0}))


def test_a_channel_flat_at_its_extreme_is_refused(tmp_path):
    rows, _ = force_rows()
    path = write(tmp_path / "f.csv", F_TITLES, np.column_stack([rows[:, :6], np.clip(rows[:, 6], -100, 58)]))
    with pytest.raises(ValueError, match=r"^f.csv, rows 19 to 26, column 'Tz': 58 is saturated, flat at its extreme"):
        read(path, FORCES)
    read(path, FORCES.model_copy(update={"flat_samples": 9}))


def test_a_channel_that_never_moves_is_not_saturated(tmp_path):
    rows, _ = force_rows()
    rows[:, 5] = 0.0
    read(write(tmp_path / "f.csv", F_TITLES, rows), FORCES)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"force_unit": "furlong"}, "f.csv: unknown unit 'furlong'; expected one like N"),
        ({"moment": None}, "f.csv: 'moment' is given neither in the study nor in a sidecar f.csv.yaml"),
        ({"force": ("Fx", "Fy", "Fw")}, "f.csv: column 'Fw' is missing"),
        ({"leg": "Fx"}, "f.csv, row 3, column 'Fx': no whole number"),
    ],
)
def test_refusals_of_forces(tmp_path, options, message):
    rows, _ = force_rows()
    path = write(tmp_path / "f.csv", F_TITLES, rows)
    with pytest.raises(ValueError) as refused:  # noqa: PT011
        read(path, FORCES.model_copy(update=options))
    assert str(refused.value).startswith(message)


def pose_options(**changes):
    given = {"position": ("x", "y", "z"), "unit": "mm", "rotation": ("a", "b", "c")} | changes
    return ForceTorqueOptions.model_validate(FORCES.model_dump() | {"pose": given})


@pytest.mark.parametrize("kind", ["vector", "quaternion", "euler"])
def test_poses_as_robots_write_them(tmp_path, kind):
    """Half a turn at the start (a tool that points down) is no jump."""
    from scipy.spatial.transform import Rotation

    rows, _ = force_rows()
    angle = np.linspace(0, 0.2, len(rows))
    turned = Rotation.from_rotvec(angle[:, None] * [0.0, 0.0, 1.0]) * Rotation.from_rotvec([np.pi, 0, 0])
    written = {
        "vector": turned.as_rotvec(), "quaternion": turned.as_quat(), "euler": turned.as_euler("xyz", degrees=True),
    }[kind]  # fmt: skip
    titles = ["x", "y", "z", "a", "b", "c", "d"][: 3 + written.shape[1]]
    path = write(tmp_path / "f.csv", F_TITLES + titles, np.column_stack([rows, 10 * angle, 0 * angle, angle, written]))
    changes = {
        "rotation": tuple(titles[3:]),
        "rotation_kind": kind,
        "rotation_unit": "deg" if kind == "euler" else "rad",
    }
    found = read(path, pose_options(**changes))
    expected = np.column_stack([0.01 * angle, 0 * angle, 1e-3 * angle, 0 * angle, 0 * angle, angle])
    assert found.pose == pytest.approx(expected, abs=1e-7)


def test_a_robot_with_a_file_and_a_clock_of_its_own(tmp_path):
    rows, _ = force_rows()
    path = write(tmp_path / "f.csv", F_TITLES, rows)
    clock = np.arange(30) / 50 + 100.0
    robot = np.column_stack([clock, 20 * (clock - 100), 0 * clock, 0 * clock, 0 * clock, 0 * clock, 0 * clock])
    write(tmp_path / "robot.csv", ["s", "x", "y", "z", "a", "b", "c"], robot)
    found = read(path, pose_options(file="robot.csv", time="s", clock_offset=100.1))
    at = rows[:, 0] + 0.1
    inside = at <= 29 / 50 + 1e-9
    assert found.pose[inside, 0] == pytest.approx(0.02 * at[inside], abs=1e-9)
    assert np.isnan(found.pose[~inside]).all()
    assert f"{inside.sum()} of 60 samples covered" in found.history[0]
    with pytest.raises(ValueError, match=r"the pose of robot.csv needs the title of its time column"):
        read(path, pose_options(file="robot.csv"))
