import stat

import numpy as np
import pytest

from lab.records import Channel, Fields, Record
from results import scenes
from results.store import write_record


@pytest.fixture
def scene(tmp_path):
    points = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], float)
    displacement = Channel("displacement", "m", np.zeros((1, 8, 3)), ("state", "point", "axis"))
    fields = Fields(points, np.array([[0, 1, 3, 2, 4, 5, 7, 6]]), 12, np.zeros(1), {"displacement": displacement})
    write_record(tmp_path / "cube.vtkhdf", Record("fea", "cube", {}, {}, fields=fields), {})
    panel = {"file": str(tmp_path / "cube.vtkhdf"), "state": 0, "caption": "cube"}
    return {"output": str(tmp_path / "cube.png"), "colour": "", "panels": [panel], "columns": 1}


def test_a_mode_shape_is_coloured_by_its_displacement(tmp_path):
    """A bar of cubes, bent up at one end: from violet at rest to yellow where it moves most."""
    from matplotlib.image import imread

    points = np.array([[x, y, z] for x in range(5) for z in (0, 1) for y in (0, 1)], float)
    cells = np.array([[4 * i + j for j in (0, 1, 3, 2)] + [4 * i + 4 + j for j in (0, 1, 3, 2)] for i in range(4)])
    shape = np.zeros((1, len(points), 3))
    shape[0, :, 2] = 0.1 * points[:, 0] ** 2
    channel = Channel("displacement", "m", shape, ("state", "point", "axis"))
    fields = Fields(points, cells, 12, np.ones(1), {"displacement": channel})
    write_record(tmp_path / "bar.vtkhdf", Record("fea", "bar", {}, {}, fields=fields), {})
    panel = {"file": str(tmp_path / "bar.vtkhdf"), "state": 0, "caption": "mode 1"}
    output = tmp_path / "bar.png"
    wanted = {"output": str(output), "colour": scenes.DISPLACEMENT, "panels": [panel], "columns": 1}
    files, reason = scenes.Drawing([wanted]).wait()
    if "SIG" in reason:
        pytest.skip(reason)
    assert files == [output]
    pixels = imread(output)[..., :3].reshape(-1, 3)
    reds, blues = pixels[:, 0] - pixels[:, 2], pixels[:, 2] - pixels[:, 1]
    assert reds.max() > 0.3  # yellow
    assert blues.max() > 0.1  # violet


def test_a_renderer_that_dies_leaves_a_reason_and_no_picture(scene, tmp_path, monkeypatch):
    """As VTK does without EGL."""
    dying = tmp_path / "python"
    dying.write_text("#!/bin/sh\necho 'no EGL here' >&2\nkill -SEGV $$\n", encoding="utf-8")
    dying.chmod(dying.stat().st_mode | stat.S_IXUSR)
    (tmp_path / "cube.png").write_bytes(b"an older picture")
    monkeypatch.setattr(scenes.sys, "executable", str(dying))
    files, reason = scenes.Drawing([scene]).wait()
    assert files == []
    assert reason == "the renderer ended with SIGSEGV, as VTK does without EGL (Debian: libegl1); it said: no EGL here"


def test_a_renderer_that_fails_says_why(scene):
    scene["panels"][0]["file"] = "absent.vtkhdf"
    files, reason = scenes.Drawing([scene]).wait()
    assert files == []
    assert "ended with code 1" in reason
    assert "absent.vtkhdf" in reason


def test_a_renderer_that_hangs_is_ended(scene, tmp_path, monkeypatch):
    slow = tmp_path / "python"
    slow.write_text("#!/bin/sh\nexec sleep 60\n", encoding="utf-8")
    slow.chmod(slow.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setattr(scenes.sys, "executable", str(slow))
    assert scenes.Drawing([scene]).wait(timeout=0.2) == ([], "the renderer took longer than 0 s")
