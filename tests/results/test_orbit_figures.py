import csv
import math

import numpy as np
import pytest
from matplotlib.patches import Polygon

from lab.orbits import ellipse
from lab.specimens import TwistedBeam
from lab.specimens.load_frame import LoadFrame
from results.figures import axes, choice, grid, paths, reversals, senses
from results.figures.canvas import Style, pyplot
from results.orbit_series import orbit_series

BLACK = Style("#000000", False, "fea (fea)")


def written(path):
    """Rows of the CSV beside a figure, which must be a PNG with something in it."""
    assert path.read_bytes()[:4] == b"\x89PNG"
    with open(path.with_suffix(".csv"), encoding="utf-8", newline="") as handle:
        return list(csv.DictReader(handle))


@pytest.fixture
def sweep(orbit):
    """Series over frequency; ``ratios`` by performer."""

    def make(frequencies, **ratios):
        (series,) = orbit_series(
            [
                orbit(performer, frequency=f, ratio=ratio, major=4e-3)
                for performer, all_ratios in ratios.items()
                for f, ratio in zip(frequencies, all_ratios, strict=True)
            ]
        )
        return series

    return make


@pytest.mark.parametrize(("ratio", "glyph"), [(0.5, "\u21ba"), (-0.5, "\u21bb"), (0.0, "\u2013")])
def test_right_handed_travel_is_drawn_counter_clockwise(orbit, ratio, glyph):
    (series,) = orbit_series([orbit(ratio=ratio, tilt=0.2)])
    drawn = paths.Orbit.at(series.tracks[0], series.values[0], BLACK)
    figure, axis = pyplot().subplots()
    paths.Tiles(axis, 1, 1).draw(0, 0, "15 Hz", [drawn])
    line = axis.lines[0].get_xydata()
    found = ellipse(line)
    assert found.ratio == pytest.approx(ratio, abs=1e-9)
    # y is up and z to the left: the long axis at 0.2 from +y lies at a quarter turn more on the page.
    assert math.remainder(found.tilt - (0.2 + math.pi / 2), math.pi) == pytest.approx(0.0, abs=1e-9)
    assert glyph in [text.get_text() for text in axis.texts]
    heads = [patch.get_xy() for patch in axis.patches if isinstance(patch, Polygon)]
    assert len(heads) == (2 if ratio else 0)
    for tip, _, notch, *_ in heads:
        at = int(np.argmin(np.linalg.norm(line[:-1] - notch, axis=1)))
        way = line[at + 1] - line[at - 1]
        assert (tip - notch) @ way > 0.95 * np.linalg.norm(tip - notch) * np.linalg.norm(way)
    pyplot().close(figure)


def test_a_tile_says_where_there_is_no_result():
    figure, axis = pyplot().subplots()
    paths.Tiles(axis, 1, 1).draw(0, 0, "15 Hz", [paths.Orbit(None, math.nan, BLACK)])
    assert "no result" in [text.get_text() for text in axis.texts]
    pyplot().close(figure)


def test_the_scale_bar_is_true():
    figure, axis = pyplot().subplots()
    turn = np.linspace(0.0, 2 * np.pi, 33)
    circle = paths.Orbit(10.0 * np.stack([np.cos(turn), np.sin(turn)], axis=1), 1.0, BLACK)
    paths.Tiles(axis, 1, 1).draw(0, 0, "", [circle])
    drawn, bar = axis.lines[0].get_xydata(), axis.lines[-1].get_xdata()
    (length,) = (float(text.get_text().split()[0]) for text in axis.texts if text.get_text().endswith("mm"))
    assert np.ptp(bar) * 20.0 / np.ptp(drawn[:, 0]) == pytest.approx(length)
    pyplot().close(figure)


def test_the_grid_writes_the_reference_and_the_nearest_and_the_farthest_model(sweep, tmp_path):
    frequencies = (1.0, 2.0, 3.0)
    series = sweep(frequencies, fea=(0.5, 0.5, 0.05), bad=(-0.5,) * 3, good=(0.5, 0.49, 0.1), fair=(0.3,) * 3)
    rows = written(grid.orbit_grid(series, "fea", tmp_path / "grid.png"))
    assert list(dict.fromkeys(row["performer"] for row in rows)) == ["fea", "good", "bad"]
    mine = [row for row in rows if (row["performer"], row["value"]) == ("fea", "2")]
    points = np.array([[float(row["y_mm"]), float(row["z_mm"])] for row in mine])
    assert ellipse(points).major == pytest.approx(4.0, rel=1e-4)
    assert ellipse(points).ratio == pytest.approx(0.5, rel=1e-3)
    assert mine[0]["unit"] == "Hz"


def test_holes_are_no_rows(orbit, tmp_path):
    entries = [orbit(frequency=f, status="completed" if f < 3 else "diverged") for f in (1.0, 2.0, 3.0)]
    (series,) = orbit_series(entries)
    rows = written(grid.orbit_grid(series, "fea", tmp_path / "grid.png"))
    assert {row["value"] for row in rows} == {"1", "2"}
    numbers = written(axes.orbit_axes(series, "fea", tmp_path / "axes.png"))
    assert [row["major_mm"] for row in numbers] == ["4", "4", "nan"]


def test_the_reference_is_the_wanted_one_else_the_first_that_is_no_prb(sweep):
    series = sweep((1.0, 2.0), chain=(0.5, 0.5), fea=(0.5, 0.5))
    assert choice.reference_of(series, "chain").performer == "chain"
    assert choice.reference_of(series, None).performer == "fea"
    assert choice.reference_of(series, "not of this campaign").performer == "fea"


def test_misfit_is_over_common_samples(orbit):
    """A path of half the size is 50 % off, one that is equal 0 %."""
    entries = [orbit(frequency=f) for f in (1.0, 2.0)]
    entries += [orbit("chain", frequency=f, major=2e-3 if f == 2.0 else 4e-3) for f in (1.0, 2.0, 3.0)]
    (series,) = orbit_series(entries)
    assert choice.misfit(series.track("chain"), series.track("fea")) == pytest.approx(0.5 / math.sqrt(2.0))


def test_orbits_that_stand_out_are_apart():
    values = np.arange(1.0, 10.0)
    assert choice.spread([4, 5, 3, 0, 8], values, 3) == [3, 4, 5]
    assert choice.spread([4, 5, 3, 0, 8], np.array([1, 2, 3, 4, 4.1, 4.2, 7, 8, 9.0]), 3) == [0, 4, 8]


def test_the_family_holds_every_thirty_degrees(orbit, tmp_path):
    twists = (-60, -45, -30, 0, 15, 30, 60)
    (series,) = orbit_series([orbit(specimen=TwistedBeam(twist=math.radians(t)), frequency=15.0) for t in twists])
    rows = written(grid.twist_family(series, "fea", tmp_path / "family.png"))
    assert {float(row["value"]) for row in rows} == {-60.0, -30.0, 0.0, 30.0, 60.0}


def test_a_family_needs_a_twist(sweep, tmp_path):
    assert not grid.family_of(sweep((1.0, 2.0), fea=(0.1, 0.2)))
    with pytest.raises(ValueError, match="sweeps frequency"):
        grid.twist_family(sweep((1.0, 2.0), fea=(0.1, 0.2)), "fea", tmp_path / "family.png")


def test_single_orbits_share_a_gallery(orbit, tmp_path):
    series = orbit_series(
        [
            orbit(specimen=TwistedBeam(twist=0.0), frequency=1.0),
            orbit(specimen=TwistedBeam(twist=1.0), frequency=2.0, amplitude=1e-3),
        ]
    )
    rows = written(grid.orbit_gallery(series, tmp_path / "gallery.png"))
    assert len({row["series"] for row in rows}) == 2


def test_cells_reach_halfway_to_their_neighbours():
    np.testing.assert_allclose(senses.edges(np.array([1.0, 2.0, 4.0])), [0.5, 1.5, 3.0, 5.0])
    np.testing.assert_allclose(senses.edges(np.array([3.0])), [2.5, 3.5])


def test_a_sense_map_shows_the_signed_ratio_and_the_reversals(sweep):
    series = sweep((1.0, 2.0, 3.0), fea=(-0.2, -0.1, 0.3), chain=(0.2, 0.2, 0.2))
    figure, axis = pyplot().subplots()
    image = senses.sense_map(axis, series, [(track.performer, track) for track in series.tracks])
    np.testing.assert_allclose(image.get_array().reshape(2, 3), [[-0.2, -0.1, 0.3], [0.2, 0.2, 0.2]])
    ticks = [segment for marks in axis.collections[1:] for segment in marks.get_segments()]
    np.testing.assert_allclose(ticks, [[[2.25, -0.5], [2.25, 0.5]]])
    pyplot().close(figure)


def test_maps_of_different_sweeps_are_refused(sweep, orbit, tmp_path):
    other = orbit_series([orbit(specimen=TwistedBeam(twist=t)) for t in (0.0, 1.0)])
    with pytest.raises(ValueError, match="frequency, twist"):
        senses.sense_maps([sweep((1.0, 2.0), fea=(0.1, 0.2)), *other], tmp_path / "map.png")


def test_reversals_move_with_the_load(orbit, tmp_path):
    entries = [
        orbit(
            specimen=TwistedBeam(load_frame=LoadFrame(load=load)), frequency=f, ratio=0.1 * (f - at),
            slug=f"load={load}_frequency={f}",
        )
        for load, at in ((0.0, 2.5), (0.01, 2.0), (0.02, 1.2))
        for f in (1.0, 3.0)
    ]  # fmt: skip
    series = orbit_series(entries)
    families = reversals.loads_of(series)
    assert [list(family) for family in families.values()] == [[0.0, 0.01, 0.02]]
    rows = written(reversals.reversals_over_load("shake", families, tmp_path / "reversals.png"))
    assert [(row["load_g"], row["reversal"], row["sense_after"]) for row in rows] == [
        ("0", "2.5", "1"), ("10", "2", "1"), ("20", "1.2", "1"),
    ]  # fmt: skip
    assert not reversals.loads_of(series[:2])
