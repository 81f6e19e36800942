import numpy as np
import pytest

from lab.readers import C3dOptions, read

RATE = 200.0


def write(path, markers, unit="mm", scale=1e3, y_screen=None, first_frame=0):
    """C3D by the library; NaN becomes an occluded point."""
    import ezc3d

    document = ezc3d.c3d()
    point = document["parameters"]["POINT"]
    point["RATE"]["value"] = [RATE]
    point["LABELS"]["value"] = list(markers)
    if unit is not None:
        point["UNITS"]["value"] = [unit]
    if y_screen:
        document.add_parameter("POINT", "Y_SCREEN", [y_screen])
    places = np.stack(list(markers.values())).transpose(2, 0, 1) * scale
    document["data"]["points"] = np.concatenate([places, np.ones_like(places[:1])])
    document["header"]["points"]["first_frame"] = first_frame
    document.write(str(path))
    return path


def truth(count=30):
    time = np.arange(count) / RATE
    sway = 0.01 * np.sin(2 * np.pi * 10 * time)[:, None] * [0.0, 1.0, 0.3]
    return {"Tip-1": np.array([0.1, 0.2, 0.8]) + sway, "Tip-2": np.array([0.1, 0.25, 0.8]) + sway}


@pytest.mark.parametrize(("unit", "scale"), [("mm", 1e3), ("m", 1.0)])
def test_places_rate_and_occlusions(tmp_path, unit, scale):
    markers = truth()
    markers["Tip-2"][11:14] = np.nan
    found = read(write(tmp_path / "take.c3d", markers, unit, scale), C3dOptions(), ["Tip-2", "Tip-1"])
    assert list(found.markers) == ["Tip-2", "Tip-1"]
    # Single precision, as the format has it.
    assert found.markers["Tip-1"] == pytest.approx(markers["Tip-1"], abs=1e-7)
    assert np.isnan(found.markers["Tip-2"][11:14]).all()
    assert np.isfinite(found.markers["Tip-2"][14:]).all()
    assert found.rate == RATE
    assert found.time == pytest.approx(np.arange(30) / RATE)
    assert "occluded samples: Tip-2 3" in found.history[0]
    assert found.at(0) == "take.c3d, frame 1"


def test_names_beyond_the_255th_are_found(tmp_path):
    places = {f"M{number}": np.full((3, 3), 0.001 * (number + 1)) for number in range(300)}
    found = read(write(tmp_path / "take.c3d", places), C3dOptions(), ["M299"])
    assert found.markers["M299"] == pytest.approx(np.full((3, 3), 0.3), abs=1e-6)


def test_a_point_at_the_origin_was_not_seen(tmp_path):
    markers = truth()
    markers["Tip-1"][5] = 0.0
    found = read(write(tmp_path / "take.c3d", markers), C3dOptions())
    assert np.isnan(found.markers["Tip-1"][5]).all()
    assert "occluded samples: Tip-1 1" in found.history[0]


@pytest.mark.parametrize(("screen", "up"), [("+Z", [0, 0, 1]), ("-Y", [0, -1, 0]), (None, None)])
def test_up_as_the_file_has_it(tmp_path, screen, up):
    found = read(write(tmp_path / "take.c3d", truth(), y_screen=screen), C3dOptions())
    assert found.up is None if up is None else found.up == pytest.approx(up)
    assert read(tmp_path / "take.c3d", C3dOptions(up="x")).up == pytest.approx([1, 0, 0])


def test_refusals(tmp_path):
    path = write(tmp_path / "take.c3d", truth())
    with pytest.raises(ValueError, match=r"^take.c3d: marker 'Tip-3' is missing; the file has Tip-1, Tip-2$"):
        read(path, C3dOptions(), ["Tip-3"])
    with pytest.raises(ValueError, match=r"^take.c3d: unknown unit 'cubits'; expected one like m$"):
        read(write(path, truth(), unit="cubits"), C3dOptions())
    path.write_bytes(b"")
    with pytest.raises(ValueError, match=r"^take.c3d: the file is empty$"):
        read(path, C3dOptions())
    path.write_text("frame,time\n")
    with pytest.raises(ValueError, match=r"^take.c3d: not readable as C3D: "):
        read(path, C3dOptions())
    with pytest.raises(ValueError, match=r"^gone.c3d: no such file"):
        read(tmp_path / "gone.c3d", C3dOptions())


def test_the_library_is_imported_when_a_file_is_read():
    import subprocess
    import sys

    code = "import sys, lab.recordings; sys.exit('ezc3d' in sys.modules or 'scipy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
