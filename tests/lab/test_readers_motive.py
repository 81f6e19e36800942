"""Motive exports, written here as the program writes them (header rows after public files of 1.21, 1.23 and 1.25)."""

import numpy as np
import pytest

from lab.readers import MotiveOptions, read

RATE = 360.0
#: Version to what differs in it.
VERSIONS = {
    "1.21": {"titles": False, "time": "Time", "error": "Error Per Marker", "parent": False, "timecode": False},
    "1.22": {"titles": True, "time": "Time (Seconds)", "error": "Error Per Marker", "parent": False, "timecode": False},
    "1.23": {
        "titles": True,
        "time": "Time (Seconds)",
        "error": "Mean Marker Error",
        "parent": False,
        "timecode": False,
    },
    "1.24": {"titles": True, "time": "Time (Seconds)", "error": "Mean Marker Error", "parent": False, "timecode": True},
    "1.25": {"titles": True, "time": "Time (Seconds)", "error": "Mean Marker Error", "parent": True, "timecode": False},
}


def truth(count=40):
    """Markers A, B, C of a rigid body, an unlabelled one, and the body's pivot; m, y up."""
    time = np.arange(count) / RATE
    sway = 0.01 * np.sin(2 * np.pi * 20 * time)[:, None] * [1.0, 0.0, 0.5]
    places = {"Beam:A": [0.05, 0.81, 0.02], "Beam:B": [0.06, 0.80, 0.0], "Beam:C": [0.04, 0.80, 0.01]}
    markers = {name: np.array(place) + sway for name, place in places.items()}
    return markers | {
        "Unlabeled 1189": np.array([0.3, 0.2, 0.1]) + 0 * sway,
        "Beam": np.array([0.05, 0.8, 0.01]) + sway,
    }


def write(path, markers, version="1.23", unit="Meters", hidden=(), first_frame=0, facts=None, change=None):
    """Write a take: body (rotation, position, error), its solved markers with quality, seen markers.

    ``hidden``: (marker, first, last) samples without a value.  ``change(rows)`` may damage the rows of samples.
    """
    says, scale = VERSIONS[version], {"Meters": 1.0, "Millimeters": 1e3, "Centimeters": 1e2}.get(unit, 1.0)
    seen = [name for name in markers if name != "Beam"]
    columns = [("Rigid Body", "Beam", "Rotation", axis) for axis in "XYZW"]
    columns += [("Rigid Body", "Beam", "Position", axis) for axis in "XYZ"] + [
        ("Rigid Body", "Beam", says["error"], "")
    ]
    for name in (name for name in seen if name.startswith("Beam:")):
        columns += [("Rigid Body Marker", name, "Position", axis) for axis in "XYZ"]
        columns += [("Rigid Body Marker", name, "Marker Quality", "")]
    columns += [("Marker", name, "Position", axis) for name in seen for axis in "XYZ"]
    stated = {
        "Format Version": version, "Take Name": "beam 90, with a comma", "Take Notes": "",
        "Capture Frame Rate": RATE / 2, "Export Frame Rate": RATE,
        "Capture Start Time": "2024-09-18 04.30.02.695 PM", "Rotation Type": "Quaternion",
        "Length Units": unit, "Coordinate Space": "Global",
    } | (facts or {})  # fmt: skip
    lead = ["", "", ""] if says["timecode"] else ["", ""]
    rows = [[str(cell) for pair in stated.items() if pair[1] is not None for cell in pair], []]
    for title, texts in (
        ("Type", [column[0] for column in columns]), ("Name", [column[1] for column in columns]),
        ("ID", ['"9E207518D8A3"'] * len(columns)), ("Parent", ["Root"] * len(columns)),
    ):  # fmt: skip
        if title != "Parent" or says["parent"]:
            rows.append([lead[0], title if says["titles"] else "", *lead[2:], *texts])
    rows.append([*lead, *(column[2] for column in columns)])
    rows.append(
        ["Frame", says["time"], *(["TimeCode"] if says["timecode"] else []), *(column[3] for column in columns)]
    )
    samples = []
    for number in range(len(markers["Beam"])):
        row = [str(first_frame + number), f"{(first_frame + number) / RATE:.6f}"]
        row += ["15:26:46:12.02"] if says["timecode"] else []
        for kind, name, part, axis in columns:
            absent = kind == "Marker" and any(name == who and a <= number <= b for who, a, b in hidden)
            if absent:
                row.append("")
            elif part == "Position":
                # The solved marker lies off the seen one, so that taking the wrong one shows.
                off = 0.002 if kind == "Rigid Body Marker" else 0.0
                row.append(f"{scale * (markers[name][number]['XYZ'.index(axis)] + off):.7f}")
            else:
                row.append("0.5" if part == "Rotation" else "0.000123")
        samples.append(row)
    rows += change(samples) if change else samples
    # The byte-order mark and the line ends are those of a Windows program.
    path.write_bytes(("\ufeff" + "\r\n".join(",".join(row) for row in rows) + "\r\n").encode())
    return path


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("unit", ["Meters", "Millimeters"])
def test_every_version_and_unit_gives_the_places(tmp_path, version, unit):
    markers = truth()
    path = write(tmp_path / "take.csv", markers, version, unit, hidden=[("Beam:B", 7, 9)])
    found = read(path, MotiveOptions(), ["Beam:B", "Beam:A"])
    assert list(found.markers) == ["Beam:B", "Beam:A"]
    assert found.markers["Beam:A"] == pytest.approx(markers["Beam:A"], abs=1e-7)
    assert np.isnan(found.markers["Beam:B"][7:10]).all()
    assert np.isfinite(np.delete(found.markers["Beam:B"], range(7, 10), axis=0)).all()
    assert found.rate == RATE  # of the export, not of the capture
    assert found.time == pytest.approx(np.arange(40) / RATE, abs=1e-9)
    assert found.up == pytest.approx([0, 1, 0])
    history = found.history[0]
    assert f"Motive CSV {version}" in history
    assert "occluded samples: Beam:B 3" in history
    assert unit.lower() in history


def test_all_seen_markers_unless_asked(tmp_path):
    found = read(write(tmp_path / "take.csv", truth()), MotiveOptions())
    assert list(found.markers) == ["Beam:A", "Beam:B", "Beam:C", "Unlabeled 1189"]


def test_solved_markers_and_pivots_on_request(tmp_path):
    markers = truth()
    path = write(tmp_path / "take.csv", markers, hidden=[("Beam:B", 7, 9)])
    solved = read(path, MotiveOptions(columns="rigid-body-marker"))
    assert solved.markers["Beam:B"] == pytest.approx(markers["Beam:B"] + 0.002, abs=1e-7)
    pivot = read(path, MotiveOptions(columns="rigid-body"))
    assert pivot.markers["Beam"] == pytest.approx(markers["Beam"], abs=1e-7)


def test_a_part_of_a_take_keeps_its_clock_and_rows(tmp_path):
    found = read(write(tmp_path / "take.csv", truth(), first_frame=72210), MotiveOptions())
    assert found.time[0] == pytest.approx(72210 / RATE, abs=1e-6)
    # Rows of the file: first one of facts, an empty one, four of titles, one of axes.
    assert found.rows[0] == 8
    assert found.at(2, 4) == "take.csv, rows 10 to 12"


def spoil(row, column, text):
    def change(samples):
        samples[row][column] = text
        return samples

    return change


A_X = 2 + 8 + 12  # column of Beam:A X among the seen markers


@pytest.mark.parametrize(
    ("kwargs", "message"),
    [
        ({"unit": "Furlong parsecs"}, "take.csv, row 1: unknown unit 'furlong parsecs'; expected one like m"),
        ({"facts": {"Length Units": None}}, "take.csv, row 1: no 'Length Units'"),
        ({"facts": {"Format Version": "1.1"}}, "take.csv, row 1: format version 1.1; read are 1.20 to 1.25"),
        ({"facts": {"Coordinate Space": "Local"}}, "take.csv, row 1: coordinate space 'Local'; export it as Global"),
        ({"facts": {"Export Frame Rate": "fast"}}, "take.csv, row 1: Export Frame Rate 'fast' is not a number"),
        (
            {"facts": {"Export Frame Rate": 240.0}},
            "take.csv: stated rate 240 Hz, but the time column runs at 360 Hz",
        ),
        ({"change": spoil(5, A_X, "O.81")}, "take.csv, row 13, column 'Beam:A x': 'O.81' is not a number"),
        ({"change": spoil(5, A_X, "nan")}, "take.csv, row 13, column 'Beam:A x': 'nan' is not a number"),
        (
            {"change": spoil(5, A_X, "")},
            "take.csv, row 13, column 'Beam:A x': empty, though the marker's other coordinates are there",
        ),
        (
            {"change": spoil(5, 1, "0.008333")},
            "take.csv, row 13, time column: runs backwards, 0.008333 s after 0.011111 s",
        ),
        (
            {"change": spoil(5, 1, "0.011111")},
            "take.csv, row 13, time column: repeats, 0.011111 s after 0.011111 s",
        ),
        ({"change": lambda rows: [*rows[:-1], rows[-1][:9]]}, "take.csv, row 47: 9 cells, but 34 columns"),
        ({"change": lambda rows: []}, "take.csv: no samples below the header"),
        ({"change": lambda rows: rows[:1]}, "take.csv: 1 sample; at least 2 are needed"),
    ],
)  # fmt: skip
def test_refusals_name_file_row_and_column(tmp_path, kwargs, message):
    path = write(tmp_path / "take.csv", truth(), **kwargs)
    with pytest.raises(ValueError) as refused:  # noqa: PT011
        read(path, MotiveOptions(), ["Beam:A", "Beam:B"])
    assert str(refused.value) == message


def test_a_missing_marker_is_named_with_those_there(tmp_path):
    path = write(tmp_path / "take.csv", truth())
    with pytest.raises(ValueError, match=r"take.csv: marker 'Beam:D' is missing; the file has Beam:A, Beam:B, Beam:C"):
        read(path, MotiveOptions(), ["Beam:D"])


def test_files_that_are_no_exports(tmp_path):
    path = tmp_path / "take.csv"
    for content, message in (
        ("", "the file is empty"),
        ("\n\n", "the file is empty"),
        ("frame,time\n0,0\n", "row 1: no Motive export with its header"),
        ("Format Version,1.23,Length Units,Meters\n\n0,0,1\n", "no row 'Frame,Time"),
    ):
        path.write_text(content)
        with pytest.raises(ValueError, match=message):
            read(path, MotiveOptions())
    path.write_bytes(b"\xff\xfe\x00\x81")
    with pytest.raises(ValueError, match=r"take.csv: not UTF-8 text"):
        read(path, MotiveOptions())
    with pytest.raises(ValueError, match=r"gone.csv: no such file"):
        read(tmp_path / "gone.csv", MotiveOptions())


def test_a_take_of_nothing_but_markers_has_no_bodies(tmp_path):
    markers = truth()
    path = write(tmp_path / "take.csv", {name: markers[name] for name in ("Unlabeled 1189", "Beam")})
    with pytest.raises(
        ValueError, match=r"no positions of the type 'rigid-body-marker'; the file has Marker, Rigid Body"
    ):
        read(path, MotiveOptions(columns="rigid-body-marker"))
