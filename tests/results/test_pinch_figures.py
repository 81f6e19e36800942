"""Figures and scenes of pinched tubes, from records whose shapes and numbers are known."""

import csv
import math
from dataclasses import replace

import numpy as np
import pytest

from lab.experiments import Pinch, PinchedBending, ShapeRecovery
from lab.experiments.pinch_drive import STAGES
from lab.pinching import first_order, ideal_axis, pair_shares
from lab.records import Channel, Fields, Record, channels
from lab.specimens import PinchedTube
from pipeline.stages.tube_pictures import figures_of_tubes, joint_figures, scenes_of_tubes
from results import scenes
from results.accuracy import Entry
from results.figures.closing import closing_curves
from results.figures.drops import block_paths
from results.figures.hinge_axes import axes_over_turn
from results.figures.hinge_stiffness import stiffness_over_travel
from results.figures.pinched import sample_name
from results.figures.pushes import bending_curves
from results.figures.recovery import recovery_story
from results.figures.sections import pinch_sections
from results.pinch_series import pinch_series
from results.store import write_record
from results.tube_scene import pad_share, rotation

TUBE = PinchedTube()
#: Angle of the ellipses from the ideal axis, rad.
OFF = math.radians(5.0)


def written(path):
    assert path.read_bytes()[:4] == b"\x89PNG"
    with open(path.with_suffix(".csv"), encoding="utf-8", newline="") as handle:
        return list(csv.DictReader(handle))


def ellipse(share, axis):
    """Section of a tube that is flattened by ``share`` along a line at ``axis`` (48, 2)."""
    turn = np.linspace(0.0, 2 * np.pi, 49)[:-1]
    flat = TUBE.mid_radius * np.exp(1j * turn)
    flat = (1 + 0.3 * share) * flat.real + 1j * (1 - share) * flat.imag
    flat = np.exp(1j * axis) * flat
    return np.stack([flat.real, flat.imag], axis=1)


def entry(experiment, stages, shares, *, performer="fea", status="completed", slug="sample", **given):
    """Record of stages by name and the share of flattening at every increment; other channels as given."""
    n, angle = len(shares), ideal_axis(experiment.pinch_angle)
    axis = angle + OFF
    sides = np.array([[np.cos(axis), -np.sin(axis)], [np.sin(axis), np.cos(axis)]])
    flexibility = np.tile(np.eye(6), (n, 1, 1))
    for place, share in enumerate(shares):
        flexibility[place, 3:5, 3:5] = sides @ np.diag([1.0 + 9.0 * share, 1.0]) @ sides.T
    force = (
        10.0 * np.sin(np.pi * np.array(shares) * 0.6) * first_order(pair_shares(experiment.pinch_angle)).force_factor
    )
    values = {
        "stage": (np.array([STAGES.index(name) for name in stages]), ()),
        "travel": (0.04 * np.array(shares), ()),
        "force": (force, ()),
        "shortening": (0.04 * np.outer(shares, experiment.shares(3)), ("pair",)),
        "gap": (0.04 * (0.98 - np.array(shares)), ()),
        "contact_force": (np.where(np.array(shares) >= 0.98, 1.0, 0.0), ()),
        "pose": (np.zeros((n, 6)), ("dof",)),
        "section": (np.array([ellipse(share, axis) for share in shares]), ("place", "side")),
        "flexibility": (flexibility, ("dof", "wrench")),
        "strain": (0.1 * np.array(shares), ()),
    }
    values |= {name: (np.array(array), values.get(name, ((), ()))[1]) for name, array in given.items()}
    found = channels(*(Channel(name, "1", a, ("increment", *dims)) for name, (a, dims) in values.items()))
    if performer != "fea":
        found = {name: channel for name, channel in found.items() if name != "shortening"}
    origin = "fea" if performer == "fea" else "prb"
    record = Record(
        origin, performer, TUBE.model_dump(mode="json"), experiment.model_dump(mode="json"), found, status=status
    )
    return Entry("tubes", performer, slug, "tube", experiment, record, f"{origin}/{slug}.vtkhdf")


def pinch(degrees, shares=(0.0, 0.3, 0.6, 0.9, 0.99), **more):
    stages = ["rest"] + ["pinch"] * (len(shares) - 1)
    more.setdefault("slug", f"pinch_angle={degrees}deg")
    return entry(Pinch(pinch_angle=math.radians(degrees)), stages, shares, **more)


def bending(degrees=0, *, pinched=True, performer="fea", slope=150.0, **given):
    experiment = PinchedBending(pinch_angle=math.radians(degrees), pinched=pinched, push=0.01, returns=True)
    stages = ["rest", "pinch", "bend", "bend", "return", "return"] if pinched else ["rest", "bend", "bend", "return"]
    pushed = np.array([0.0, 0.001, 0.006, 0.011, 0.006, 0.001] if pinched else [0.0, 0.005, 0.01, 0.0])
    load = slope * (pushed - pushed[1 if pinched else 0])
    load[0] = 0.0
    shares = [0.0, *[0.99] * 5] if pinched else [0.0] * 4
    pose = np.zeros((len(stages), 6))
    pose[:, 1], pose[:, 3] = -pushed, pushed / 0.05
    slug = f"pinched={pinched}_pinch_angle={degrees}deg"
    return entry(
        experiment, stages, shares, performer=performer, slug=slug, pushed=pushed, load=load, pose=pose, **given
    )


def recovery(load, left):
    stages = ["rest", "load", "pinch", "pinch", "release", "recover", "let go"]
    shares = [0.0, 0.0, 0.5, 0.9, left, left / 2, 0.0]
    given = {"pushed": np.linspace(0.0, 0.03, 7), "load": np.full(7, load)}
    return entry(ShapeRecovery(load=load), stages, shares, slug=f"load={load:g}N", **given)


def test_force_is_drawn_over_what_a_performer_knows(tmp_path):
    open_one = pinch(60, (0.0, 0.3, 0.6), status="diverged")
    entries = [pinch(0), open_one, pinch(0, performer="hinge")]
    rows = written(closing_curves(entries, "closing", tmp_path / "closing.png"))
    assert [row["performer"] for row in rows] == ["fea"] * 8 + ["hinge"] * 5
    assert {row["status"] for row in rows if row["sample"] == "pinch_angle=60deg"} == {"diverged"}
    ours = [row for row in rows if row["performer"] == "fea"][:5]
    assert [float(row["travel_mm"]) for row in ours] == pytest.approx([0.0, 12.0, 24.0, 36.0, 39.6])
    # One pair alone: each pad goes half of the way.
    assert float(ours[-1]["pad_motion_mm"]) == pytest.approx(19.8)
    assert float(ours[-1]["flattening"]) == pytest.approx(0.99, abs=0.01)
    assert rows[-1]["pad_motion_mm"] == "nan"
    assert rows[-1]["flattening"] == ours[-1]["flattening"]


def test_sections_run_from_rest_to_the_end(tmp_path):
    rows = written(pinch_sections([pinch(0), pinch(30)], "sections", tmp_path / "sections.png"))
    first = [row for row in rows if row["sample"] == "pinch_angle=30deg" and row["state"] == "rest"]
    last = [row for row in rows if row["sample"] == "pinch_angle=30deg" and row["state"] == "end"]
    assert len(first) == len(last) == 48
    radii = [math.hypot(float(row["x_mm"]), float(row["y_mm"])) for row in first]
    assert radii == pytest.approx([1e3 * TUBE.mid_radius] * 48, rel=1e-4)
    farthest = max(last, key=lambda row: math.hypot(float(row["x_mm"]), float(row["y_mm"])))
    angle = math.degrees(math.atan2(float(farthest["y_mm"]), float(farthest["x_mm"]))) % 180
    assert angle == pytest.approx(15.0 + 5.0, abs=1e-3)


def test_a_turn_holds_computed_designs_their_images_and_theory(tmp_path):
    series = pinch_series([pinch(0), pinch(30), pinch(60), pinch(150)])
    rows = written(axes_over_turn(series, "turn", tmp_path / "turn.png"))
    ours = {float(row["alpha_deg"]): row for row in rows if row["source"] == "fea"}
    assert sorted(ours) == pytest.approx([0, 30, 60, 90, 120, 150, 180, 210, 240, 270, 300, 330], abs=1e-3)
    assert [round(angle) for angle, row in ours.items() if abs(angle - float(row["computed_at_deg"])) < 1e-3] == [
        0, 30, 60, 150,
    ]  # fmt: skip
    by_angle = {round(angle): row for angle, row in ours.items()}
    assert float(by_angle[30]["hinge_axis_deg"]) == pytest.approx(20.0, abs=1e-3)
    # The mirror between the first two pairs turns 5 deg beyond the ideal axis into 5 deg before it.
    assert float(by_angle[90]["hinge_axis_deg"]) == pytest.approx(40.0, abs=1e-3)
    assert float(by_angle[60]["over_alpha_0"]) == pytest.approx(math.sqrt(2), rel=1e-3)
    theory = {round(float(row["alpha_deg"])): row for row in rows if row["origin"] == "theory"}
    assert float(theory[60]["over_alpha_0"]) == pytest.approx(math.sqrt(2), rel=1e-5)


def test_the_hinge_comes_up_along_the_pinch(tmp_path):
    rows = written(stiffness_over_travel([pinch(30), pinch(30, performer="hinge")], "k", tmp_path / "k.png"))
    assert [row["performer"] for row in rows] == ["fea"] * 5 + ["hinge"] * 5
    assert rows[0]["hinge_axis_deg"] == "nan"
    last = rows[4]
    assert float(last["k_soft_Nm_per_rad"]) == pytest.approx(1 / (1 + 9 * 0.99), rel=1e-4)
    assert float(last["k_stiff_Nm_per_rad"]) == pytest.approx(1.0)
    assert float(last["from_ideal_deg"]) == pytest.approx(5.0, abs=1e-3)


def test_bending_starts_from_the_pinched_state(tmp_path):
    entries = [bending(pinched=False, slope=1800.0), bending(), bending(performer="hinge", slope=140.0)]
    rows = written(bending_curves(entries, "push", tmp_path / "push.png"))
    pinched = [row for row in rows if row["performer"] == "fea" and row["state"] == "pinched tube"]
    assert [(row["stage"], float(row["motion_mm"])) for row in pinched] == [
        ("bend", 0.0), ("bend", 5.0), ("bend", 10.0), ("return", 10.0), ("return", 5.0), ("return", 0.0),
    ]  # fmt: skip
    assert float(pinched[2]["load_N"]) == pytest.approx(1.5)
    assert [row["state"] for row in rows if row["performer"] == "fea"][:5] == ["open tube"] * 5


def test_the_block_goes_where_the_record_says(tmp_path):
    rows = written(block_paths([bending(0), bending(120), bending(240)], "block", tmp_path / "block.png"))
    assert [float(row["alpha_deg"]) for row in rows] == pytest.approx([0, 120, 240])
    assert float(rows[0]["y_mm"]) == pytest.approx(-10.0)
    assert float(rows[0]["turn_deg"]) == pytest.approx(math.degrees(0.2), rel=1e-5)


def test_recovery_is_told_from_the_loaded_tube_on(tmp_path):
    rows = written(recovery_story([recovery(4.905, 0.1), recovery(9.81, 0.6)], "recovery", tmp_path / "recovery.png"))
    told = {(row["sample"], row["stage"]): float(row["flattening"]) for row in rows}
    assert told["load=4.905N", "load"] == pytest.approx(0.0)
    assert told["load=9.81N", "pinch"] == pytest.approx(1.0)
    assert told["load=9.81N", "release"] == pytest.approx(0.6 / 0.9, abs=0.02)
    assert told["load=4.905N", "let go"] == pytest.approx(0.0, abs=1e-9)


def test_samples_are_called_by_what_is_swept():
    assert sample_name("pinch_angle=30deg_law=even") == "\u03b1 30°, law even"
    assert sample_name("pinched=False_pinch_angle=0deg") == "not pinched, \u03b1 0\u00b0"
    assert sample_name("one_tube") == "one tube"


def test_every_experiment_with_a_tube_gets_its_figures(tmp_path):
    found = [pinch(0), pinch(60), pinch(0, performer="hinge")]
    drawn = [p.file.name for p in (*figures_of_tubes("tubes", found, tmp_path), *joint_figures(found[:2], tmp_path))]
    assert drawn == ["tubes_closing.png", "tubes_hinge.png", "tubes_fea_sections.png", "tubes_turn_tube.png"]
    drawn = [p.file.name for p in figures_of_tubes("bent", [bending(0), bending(120), bending(240)], tmp_path)]
    assert drawn == ["bent_bending.png", "bent_block.png"]
    assert [p.file.name for p in figures_of_tubes("load", [recovery(9.81, 0.6)], tmp_path)] == ["load_recovery.png"]


def test_single_push_tests_share_a_figure(tmp_path):
    alone = [replace(bending(pinched=False), campaign="open"), replace(bending(), campaign="closed")]
    assert [list(figures_of_tubes(entry.campaign, [entry], tmp_path)) for entry in alone] == [[], []]
    (picture,) = joint_figures(alone, tmp_path)
    assert picture.group == "open"
    assert {(row["sample"], row["state"]) for row in written(picture.file)} == {
        ("open", "open tube"), ("closed", "pinched tube"),
    }  # fmt: skip


def test_pads_are_where_the_specimen_has_them():
    directions = TUBE.pad_directions()
    middle = np.stack([np.cos(directions), np.sin(directions), 0 * directions], axis=1) * TUBE.mid_radius
    middle[:, 2] = TUBE.length / 2
    assert pad_share(TUBE, middle) == pytest.approx(1.0)
    away = middle + [0.0, 0.0, TUBE.pad_width / 2 + TUBE.pad_fillet]
    assert pad_share(TUBE, away) == pytest.approx(0.0)


def test_a_rotation_vector_turns_about_its_axis():
    assert rotation(np.array([0.0, 0.0, np.pi / 2])) @ [1.0, 0.0, 0.0] == pytest.approx([0.0, 1.0, 0.0])
    assert rotation(np.zeros(3)) == pytest.approx(np.eye(3))


def tube_fields():
    """One layer of hexahedra with pads' corners far too coarse to bend, whose last state is shifted sideways."""
    turn, heights = np.arange(24) * np.pi / 12, np.linspace(0.0, TUBE.length, 9)
    points = np.array([
        [r * np.cos(t), r * np.sin(t), z] for r in (TUBE.radius - TUBE.wall, TUBE.radius) for z in heights for t in turn
    ])  # fmt: skip
    number = np.arange(len(points)).reshape(2, 9, 24)
    ring = np.roll(number, -1, axis=2)
    corners = (number[0, :-1], ring[0, :-1], ring[1, :-1], number[1, :-1])
    above = (number[0, 1:], ring[0, 1:], ring[1, 1:], number[1, 1:])
    cells = np.stack([c.ravel() for c in (*corners, *above)], axis=1)
    moved = np.zeros((2, len(points), 3))
    moved[1, :, 0] = 0.1 * points[:, 2]
    displacement = Channel("displacement", "m", moved, ("state", "point", "axis"))
    return Fields(points, cells, 12, np.array([0.0, 4.0]), {"displacement": displacement})


def test_scenes_show_pads_and_blocks(tmp_path):
    """Orange pads on a blue wall between grey blocks; the cut shows the proximal half alone."""
    from matplotlib.image import imread

    one = pinch(0)
    one = replace(one, record=replace(one.record, fields=tube_fields()))
    (tmp_path / "fea").mkdir()
    write_record(tmp_path / one.path, one.record, {})
    wanted = list(scenes_of_tubes("tubes", [one], tmp_path, tmp_path))
    assert [picture.file.name for _, picture in wanted] == ["tubes_tubes.png", "tubes_way_pinch_angle-0deg.png"]
    assert [(panel["state"], panel["cut"]) for panel in wanted[1][0]["panels"]] == [
        (0, False), (1, False), (0, True), (1, True),
    ]  # fmt: skip
    files, reason = scenes.Drawing([scene for scene, _ in wanted]).wait()
    if "SIG" in reason:
        pytest.skip(reason)
    assert files == [picture.file for _, picture in wanted], reason
    pixels = imread(files[0])[..., :3].reshape(-1, 3)
    warm = pixels[:, 0] - pixels[:, 2]
    assert warm.max() > 0.4  # pads
    assert warm.min() < -0.1  # wall
    grey = (np.ptp(pixels, axis=1) < 0.05) & (pixels.max(axis=1) < 0.8) & (pixels.max(axis=1) > 0.2)
    assert grey.sum() > 500  # blocks


def test_every_assumption_stands_beside_the_lab(tmp_path):
    def with_wall(wall, slope):
        one = bending(pinched=False, slope=slope)
        specimen = {**one.record.specimen, "wall": wall}
        slug = "single" if wall == TUBE.wall else f"wall={1e3 * wall:g}mm"
        return replace(one, slug=slug, record=replace(one.record, specimen=specimen))

    found = [with_wall(0.8e-3, 1500.0), with_wall(1e-3, 2000.0), with_wall(1.2e-3, 2500.0)]
    (picture,) = (p for p in joint_figures(found, tmp_path) if "assumption" in p.file.name)
    rows = written(picture.file)
    assert [(row["field"], row["value"], float(row["result_value"])) for row in rows] == [
        ("wall", "0.8 mm", 1500.0), ("wall", "1 mm", 2000.0), ("wall", "1.2 mm", 2500.0),
    ]  # fmt: skip
    assert {float(row["lab"]) for row in rows} == {1812.0}
