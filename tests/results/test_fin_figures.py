"""Figures and scenes of tubes with fins, from records whose shapes and numbers are known."""

import csv
import math
from dataclasses import replace

import numpy as np
import pytest

from lab.records import Channel, Fields
from lab.specimens import FinnedTube
from pipeline.stages.fin_pictures import figures_of_fins, joint_fin_figures, scenes_of_fins
from results import scenes
from results.figures.fin_designs import designs_over
from results.figures.fin_pressure import pressure_curves
from results.figures.fin_pushes import limit_loads, push_curves
from results.figures.fin_travel import travel_curves
from results.figures.pinched import Look
from results.figures.strokes import has_links, links, stroke_shapes
from results.figures.thrust import thrust_over_time
from results.figures.thrust_maps import mean_thrust, thrust_map
from results.fin_scene import fin_share
from results.fin_states import fin_states
from results.fin_tables import angle_series
from results.paddle_tables import FREQUENCY, LENGTH
from results.store import write_record
from results.swept_series import swept_series


def written(path):
    assert path.read_bytes()[:4] == b"\x89PNG"
    with open(path.with_suffix(".csv"), encoding="utf-8", newline="") as handle:
        return list(csv.DictReader(handle))


def test_travel_is_drawn_as_far_as_it_went(propagation, tmp_path):
    found = [
        propagation(20e-3, 6e-3), propagation(24e-3, -2e-3, theta=75),
        propagation(10e-3, theta=35, reached=0.02, states=6, status="diverged"),
    ]  # fmt: skip
    rows = written(travel_curves(found, "travel", tmp_path / "travel.png"))
    assert len(rows) == 11 + 11 + 6
    last = rows[10]
    assert (float(last["s_mm"]), float(last["y_mm"]), float(last["pinch_mm"])) == pytest.approx((20.0, 6.0, 33.0))
    assert (float(last["x_mm"]), float(last["z_mm"])) == pytest.approx((-16.0, 12.0))
    assert float(rows[21]["y_mm"]) == pytest.approx(-2.0)
    assert float(rows[-1]["pinch_mm"]) == pytest.approx(20.0)
    assert rows[-1]["status"] == "diverged"


def test_performers_of_one_sample_have_colours_of_their_own(propagation):
    names = ["fea", "fea-coarse", "fea-fine", "fea-shells"]
    alone = [propagation(performer=name, slug="single") for name in names]
    look = Look.of(alone)
    assert len({look.colour(entry) for entry in alone}) == 4
    assert [handle.get_label() for handle in look.handles()] == [f"{name} (fea)" for name in names]
    # With several samples colours are theirs.
    both = [*alone[:2], propagation(performer="fea", arc=45.0)]
    look = Look.of(both)
    assert look.colour(both[0]) == look.colour(both[1]) != look.colour(both[2])


def test_designs_have_a_column_for_each_angle(propagation, tmp_path):
    arcs = [propagation(20e-3 + i * 1e-4, arc=35 + 10 * i, theta=t) for i in range(6) for t in (75, 60)]
    thetas = [propagation((10 + 0.5 * (t - 35)) * 1e-3, arc=75, theta=t) for t in (35, 43, 51, 67)]
    series = angle_series([*arcs, *thetas])
    rows = written(designs_over(series, "designs", tmp_path / "designs.png"))
    assert {(row["over"], row["held"]) for row in rows} == {
        ("alpha", "theta 75 deg"), ("alpha", "theta 60 deg"), ("theta", "alpha 75 deg"),
    }  # fmt: skip
    over = [row for row in rows if row["held"] == "alpha 75 deg"]
    assert [float(row["angle_deg"]) for row in over] == pytest.approx([35, 43, 51, 60, 67, 75])
    assert float(over[0]["s_mm"]) == pytest.approx(10.0)


def pushes(fin_push, performer="fea"):
    return [
        fin_push(sense, travel, limit, performer=performer)
        for travel, most, least in ((0.0, 2.0, 1.0), (8.25e-3, 2.6, 0.8), (16.5e-3, 3.4, 0.6), (24.75e-3, 4.2, 0.45),
                                    (33e-3, 5.1, 0.35))
        for sense, limit in (("opposite", most), ("equal", least))
    ]  # fmt: skip


def test_pushes_start_at_first_touch(fin_push, tmp_path):
    (found,) = fin_states(pushes(fin_push))
    assert found.states[0].travel == 0.0
    rows = written(push_curves([found], "pushes", tmp_path / "pushes.png"))
    assert len(rows) == 5 * 2 * 22
    mine = [row for row in rows if row["sense"] == "equal" and row["pinch_mm"] == "33"]
    assert float(mine[0]["push_mm"]) == 0.0
    forces = [float(row["force_N"]) for row in mine]
    assert max(forces) == pytest.approx(0.35)
    assert forces[-1] == pytest.approx(0.175)


def test_variants_share_a_figure(fin_push, tmp_path):
    designs = [
        fin_push(
            "equal", 0.033, most, slug=f"fin_arc={arc:g}deg_sense=equal", device=FinnedTube(fin_arc=math.radians(arc))
        )
        for arc, most in ((90.0, 0.4), (130.0, 0.2))
    ]
    found = fin_states(designs)
    assert [one.is_variant for one in found] == [True, True]
    rows = written(push_curves(found, "designs", tmp_path / "designs.png"))
    assert {row["device"] for row in rows} == {"prototype, fin arc 90deg", "prototype, fin arc 130deg"}
    assert max(float(row["force_N"]) for row in rows) == pytest.approx(0.4)
    assert not fin_states([fin_push("equal", 0.033, 0.4)])[0].is_variant


def test_limit_loads_and_the_law_through_them(fin_push, tmp_path):
    found = fin_states([*pushes(fin_push), *pushes(fin_push, "fea-coarse")])
    rows = written(limit_loads(found, "limits", tmp_path / "limits.png"))
    assert len(rows) == 2 * 2 * 5
    ours = [row for row in rows if (row["performer"], row["sense"]) == ("fea", "opposite")]
    assert [float(row["force_max_N"]) for row in ours] == pytest.approx([2.0, 2.6, 3.4, 4.2, 5.1])
    assert [float(row["flat"]) for row in ours] == pytest.approx([0.0, 0.25, 0.5, 0.75, 1.0])
    for row in ours:
        assert float(row["K_law_Nm_per_rad"]) == pytest.approx(float(row["K_Nm_per_rad"]), rel=0.03)


def test_flattening_over_pressure(propagation, tmp_path):
    found = [propagation(drive="pressure", slug="single")]
    rows = written(pressure_curves(found, "pressure", tmp_path / "pressure.png"))
    assert float(rows[-1]["pressure_psi"]) == pytest.approx(40.0)
    assert float(rows[-1]["flat"]) == pytest.approx(1.0)
    assert float(rows[5]["approach_mm"]) == pytest.approx(33 * math.sqrt(0.5), rel=1e-4)


def test_thrust_is_that_of_the_last_cycles(paddling, tmp_path):
    found = [
        paddling(), paddling(1.0, -0.5, performer="other"), paddling(2.6, -0.47, load_fin=True),
        paddling(2.2, -0.3, load_fin=True, performer="other"),
    ]  # fmt: skip
    rows = written(thrust_over_time(found, "thrust", tmp_path / "thrust.png"))
    assert {(row["performer"], row["load_fin"]) for row in rows} == {
        ("paddler", "False"), ("other", "False"), ("paddler", "True"), ("other", "True"),
    }  # fmt: skip
    mine = [row for row in rows if row["performer"] == "paddler" and row["load_fin"] == "True"]
    assert float(mine[0]["time_s"]) == pytest.approx(2.0)
    assert float(mine[-1]["time_s"]) == pytest.approx(4.0)
    assert max(float(row["thrust_N"]) for row in mine) == pytest.approx(2.6, rel=1e-3)
    assert min(float(row["buckling_deg"]) for row in mine) == pytest.approx(-math.degrees(0.4), rel=1e-3)


def test_links_turn_at_root_and_hinge(paddling, tmp_path):
    parameters = {"hinge_share": {"unit": "1", "value": 0.25}, "load_reach": {"unit": "1", "value": 2.0}}
    found = [paddling(parameters=parameters), paddling(load_fin=True, parameters=parameters)]
    assert has_links(found[0])
    assert not has_links(paddling())
    device, record = found[1].tested(), found[1].record
    root, hinge, end = links(found[1], np.array([50]))[0]
    # A quarter of the first cycle: everything is at its largest there or on its way.
    assert root == pytest.approx([device.mid_radius + record["x1"][50], device.place])
    assert np.linalg.norm(hinge - root) == pytest.approx(0.25 * device.fin_length)
    assert np.linalg.norm(end - hinge) == pytest.approx(0.75 * device.fin_length + 2 * device.load_fin.length)
    assert math.atan2(*(hinge - root)) == pytest.approx(record["fin_angle"][50])
    assert math.atan2(*(end - hinge)) == pytest.approx(record["fin_angle"][50] + record["buckling"][50])
    rows = written(stroke_shapes(found, "strokes", tmp_path / "strokes.png"))
    assert len(rows) == 2 * 2 * 9 * 3
    assert all(float(row["x_mm"]) < 0 for row in rows if row["stroke"] == "recovery")
    times = [float(row["time_s"]) for row in rows if row["stroke"] == "power"]
    assert (min(times), max(times)) == pytest.approx((3.0, 3.5))


def test_mean_thrust_over_what_is_swept(paddling, tmp_path):
    runs = [paddling(1.0, -0.5 * f, frequency=f) for f in (0.5, 1.0, 2.0, 3.0)]
    runs += [paddling(1.0, -0.4 * f, frequency=f, load_fin=True) for f in (0.5, 1.0, 2.0, 3.0)]
    runs += [paddling(0.5 + 20 * size, -1.0, load_fin=True, size=size) for size in (0.01, 0.02, 0.05)]
    series = [one for path in (FREQUENCY, LENGTH) for one in swept_series(runs, path)]
    rows = written(mean_thrust(series, "mean thrust", tmp_path / "mean.png"))
    over = [row for row in rows if row["over"] == "frequency" and row["held"] == "prototype"]
    assert [float(row["mean_N"]) for row in over] == pytest.approx(
        [(1 - 0.5 * f) / math.pi for f in (0.5, 1.0, 2.0, 3.0)], abs=1e-3
    )
    assert over[0]["unit"] == "Hz"
    assert {row["unit"] for row in rows if row["over"] == "load fin length"} == {"mm"}


def test_a_map_of_two_fields(paddling, tmp_path):
    sizes, frequencies = (0.01, 0.02, 0.03, 0.04), (0.5, 1.0, 2.0)
    runs = [paddling(1.0 + 20 * size - 0.5 * f, -1.0, load_fin=True, frequency=f, size=size)
            for size in sizes for f in frequencies]  # fmt: skip
    series = swept_series(runs, FREQUENCY)
    rows = written(thrust_map(series, LENGTH, "map", tmp_path / "map.png"))
    assert len(rows) == 12
    found = {(float(row["first"]), float(row["second"])): float(row["mean_N"]) for row in rows}
    assert found[2.0, 10.0] == pytest.approx(-0.8 / math.pi, abs=1e-3)
    assert found[0.5, 40.0] == pytest.approx(0.55 / math.pi, abs=1e-3)
    assert np.isfinite(list(found.values())).all()


# ------------------------------------------------------------------------------------------- what a campaign gets


def names(pictures):
    return [picture.file.name for picture in pictures]


def test_every_experiment_with_fins_gets_its_figures(propagation, fin_push, paddling, tmp_path, monkeypatch):
    # Which ones, not how they look: most of the time goes into pixels.
    monkeypatch.setattr("matplotlib.figure.Figure.savefig", lambda figure, path, **_: path.write_bytes(b""))
    shapes = [propagation(arc=arc, theta=75, campaign="alpha") for arc in (35, 55, 75)]
    assert names(figures_of_fins("alpha", shapes, tmp_path)) == ["alpha_travel.png"]
    blown = [propagation(drive="pressure", campaign="inflate", slug="single")]
    assert names(figures_of_fins("inflate", blown, tmp_path)) == ["inflate_pressure.png"]
    assert names(figures_of_fins("push", pushes(fin_push), tmp_path)) == [
        "push_prototype-by-fea_pushes.png", "push_limits.png",
    ]  # fmt: skip
    sizes, frequencies = (0.01, 0.02, 0.03, 0.04, 0.05), (0.5, 1.0)
    paddled = [paddling(campaign="held"), paddling(load_fin=True, campaign="held-loaded")]
    paddled += [paddling(frequency=f, campaign="frequency") for f in (0.5, 2.0)]
    paddled += [paddling(load_fin=True, frequency=f, size=s, campaign="map") for s in sizes for f in frequencies]
    assert names(figures_of_fins("held", paddled[:1], tmp_path)) == []
    drawn = names(joint_fin_figures([*shapes, *blown, *paddled], tmp_path))
    assert drawn == ["alpha_designs.png", "held_thrust.png", "map_paddler_map.png", "frequency_mean_thrust.png"]


def test_what_failed_is_drawn_nowhere(propagation, paddling, tmp_path):
    lost = propagation(status="failed", slug="single")
    lost = replace(lost, record=replace(lost.record, channels={}))
    assert list(figures_of_fins("c", [lost], tmp_path)) == []
    gone = paddling(status="diverged")
    assert list(joint_fin_figures([lost, gone], tmp_path)) == []


def quarter():
    """One layer of hexahedra of the tube and of the fin where x and y are positive; at last flattened and swept."""
    device = FinnedTube()
    turn, heights = np.linspace(0.0, np.pi / 2, 9), np.linspace(0.0, device.length, 7)
    psi, along = np.linspace(0.0, device.fin_arc / 2, 5), np.linspace(0.0, 1.0, 7)
    r = [device.inner_radius, device.radius]
    tube = np.array([[[[q * np.cos(t), q * np.sin(t), z] for t in turn] for z in heights] for q in r])
    fin = []
    for depth in (0.0, 1.0):
        radius = device.face_radius(depth)
        root = device.root_along(psi, radius)
        fin.append([device.fin_places(psi, root + (device.tip_along - root) * share, radius) for share in along])
    points, cells = [], []
    for block in (tube, np.array(fin)):
        number = sum(map(len, points)) + np.arange(block[..., 0].size).reshape(block.shape[:3])
        corners = (number[:, :-1, :-1], number[:, :-1, 1:], number[:, 1:, 1:], number[:, 1:, :-1])
        cells.append(np.stack([c[0].ravel() for c in corners] + [c[1].ravel() for c in corners], axis=1))
        points.append(block.reshape(-1, 3))
    places = np.concatenate(points)
    moved = np.zeros((2, *places.shape))
    moved[1, :, 1] = -0.5 * places[:, 1]
    moved[1, :, 2] = 0.4 * fin_share(device, places) * (places[:, 0] - device.radius)
    displacement = Channel("displacement", "m", moved, ("state", "point", "axis"))
    return Fields(places, np.concatenate(cells), 12, np.array([0.0, 10.0]), {"displacement": displacement})


def test_fins_are_what_lies_outside_the_tube():
    device = FinnedTube()
    on_fin = device.fin_places(np.zeros(2), np.array([device.crown_along + 0.01, device.tip_along]))
    assert fin_share(device, on_fin) == pytest.approx([1.0, 1.0])
    on_tube = np.array([[device.radius, 0.0, 0.0], [0.0, device.inner_radius, 0.01]])
    assert fin_share(device, on_tube) == pytest.approx([0.0, 0.0])


def test_scenes_show_the_whole_device_from_a_quarter(propagation, tmp_path):
    """Blue tube, orange fins to both sides, and P in red."""
    from matplotlib.image import imread

    one = propagation(slug="single", campaign="propagation", fields=quarter())
    (tmp_path / "fea").mkdir()
    write_record(tmp_path / one.path, one.record, {})
    wanted = list(scenes_of_fins("propagation", [one], tmp_path, tmp_path))
    (scene, picture) = wanted[0]
    assert picture.file.name == "propagation_fins.png"
    assert [(panel["state"], panel["cut"]) for panel in scene["panels"]] == [(0, False), (1, False), (1, True)]
    assert scene["panels"][1]["caption"].endswith("pinched by 33 mm")
    files, reason = scenes.Drawing([scene for scene, _ in wanted]).wait()
    if "SIG" in reason:
        pytest.skip(reason)
    assert files == [picture.file], reason
    pixels = imread(files[0])[..., :3]
    warm = pixels[..., 0] - pixels[..., 2]
    assert (warm < -0.1).sum() > 1000  # tube
    first = warm[: len(warm) // 3] > 0.2
    columns = np.flatnonzero(first.any(axis=0))
    middle = pixels.shape[1] / 2
    assert columns.min() < 0.8 * middle  # a fin to either side
    assert columns.max() > 1.2 * middle
    red = (pixels[..., 0] > 0.5) & (pixels[..., 1] < 0.25) & (pixels[..., 2] < 0.25)
    assert red.sum() > 20


def test_pushes_are_seen_under_their_largest_force(fin_push, tmp_path):
    one = fin_push(fields=replace(quarter(), values=np.array([7.0, 23.0])))
    (tmp_path / "fea").mkdir()
    write_record(tmp_path / one.path, one.record, {})
    ((scene, _),) = scenes_of_fins("push", [one], tmp_path, tmp_path)
    # 4 N at 4 mm of the way, 2.5 N at its end.
    assert [panel["state"] for panel in scene["panels"]] == [0, 0]
    assert scene["panels"][0]["caption"].endswith("pinched by 33 mm, 4 N")
