"""Tables of tubes with fins, on records with numbers that are known."""

import math

import numpy as np
import pytest

from lab.published import figures
from lab.specimens import FinnedTube
from lab.specimens.finned_tube import LoadFin
from results.effects import effect, sign_changes
from results.fin_accuracy import accuracy_table, run_time_table
from results.fin_states import fin_states
from results.fin_tables import ANGLE, ARC, effect_table, fin_tables, pressure_table
from results.fins import TABLE, is_prototype, published_device
from results.paddle_tables import FREQUENCY, paddle_tables, plate_table, sign_table
from results.paddling import PlateLaw
from results.swept_series import swept_series
from results.two_terms import two_term_fit


def titled(tables, start):
    (found,) = [table for table in tables if table.title.startswith(start)]
    return found


def column(table, name):
    return [row[table.header.index(name)] for row in table.rows]


# ------------------------------------------------------------------------------------------- numbers


def test_an_effect_by_hand():
    found = effect(np.array([1.0, 2.0, 3.0, 4.0]), np.array([10.0, 11.0, np.nan, 13.0]))
    assert (found.designs, found.low, found.high) == (3, 10.0, 13.0)
    assert found.spread == pytest.approx(3.0 / (34.0 / 3.0))
    assert found.slope == pytest.approx(1.0)
    assert found.correlation == pytest.approx(1.0)
    assert math.isnan(effect(np.array([1.0, 2.0]), np.array([np.nan, 3.0])).spread)
    assert math.isnan(effect(np.array([1.0, 2.0]), np.array([3.0, 3.0])).correlation)
    assert effect(np.array([1.0, 2.0]), np.array([-2.0, -4.0])).spread == pytest.approx(2.0 / 3.0)


def test_signs_change_between_neighbours_and_at_nought():
    assert sign_changes(np.array([1.0, 2.0, 3.0, 4.0]), np.array([-1.0, 3.0, 0.0, -1.0])) == pytest.approx([1.25, 3.0])
    assert sign_changes(np.array([1.0, 2.0, 3.0]), np.array([-1.0, np.nan, 1.0])) == pytest.approx([2.0])
    assert sign_changes(np.array([1.0, 2.0]), np.array([0.1, 0.2])) == []


def test_two_terms_are_found_again():
    s = np.linspace(0.0, 1.0, 6)
    law = two_term_fit(s, 2.0 * np.exp(-1.5 * s) + 0.3 * np.exp(2.5 * s))
    assert (law.a, law.b, law.c, law.d) == pytest.approx((2.0, -1.5, 0.3, 2.5), rel=1e-4)
    assert (law.spare, law.misfit < 1e-8) == (2, True)
    assert law(s)[0] == pytest.approx(2.3)
    assert two_term_fit(s, np.array([1.0, 2.0, 3.0, np.nan, np.nan, np.nan])) is None
    noisy = two_term_fit(s, np.array([1.0, 3.0, 1.0, 3.0, 1.0, 3.0]))
    assert noisy.misfit > 0.2


def test_what_is_the_texts_device():
    prototype = FinnedTube()
    assert published_device(prototype.model_dump(mode="json")) == TABLE
    assert is_prototype(prototype.model_dump(mode="json"))
    turned = FinnedTube(attachment_angle=math.radians(75.0), load_fin=LoadFin())
    assert published_device(turned.model_dump(mode="json")) == TABLE
    assert not is_prototype(turned.model_dump(mode="json"))
    assert published_device(FinnedTube(wall=2e-3).model_dump(mode="json")) == ""
    assert published_device({"kind": "PinchedTube"}) == ""


def test_the_plate_law_needs_what_the_formula_of_the_text_says():
    """2.6 N over two plates of 83.7 x 50 mm: 0.56 m/s."""
    law = PlateLaw(0.0837 * 0.05, 0.0837)
    assert law.speed(2.6) == pytest.approx(0.557, abs=1e-3)
    assert law.force(law.speed(2.6)) == pytest.approx(2.6)
    assert law.reynolds(0.02976) == pytest.approx(2491, abs=1)
    device = FinnedTube(load_fin=LoadFin())
    own = PlateLaw.of(device)
    assert own.chord == pytest.approx(0.0837)
    breadth = 2 * 0.02425 * math.sin(math.radians(32.5))
    assert own.area == pytest.approx(breadth * 0.0528 + 0.045 * 0.0309)


# ------------------------------------------------------------------------------------------- both angles


def sweeps(propagation):
    """alpha does nothing to s at 75 deg and 2 % a step at 60; theta makes s from 10 to 30 mm, and y jump about."""
    arcs = [propagation(20e-3, 6e-3, arc=arc, theta=75, campaign="alpha") for arc in (35, 45, 55, 65, 75, 85)]
    arcs += [
        propagation(20e-3 * (1 + 0.02 * i), 6e-3 * (1 + 0.3 * (i % 2)), arc=35 + 10 * i, theta=60) for i in range(6)
    ]
    thetas = [propagation((10 + 0.5 * (theta - 35)) * 1e-3, 5e-3, arc=75, theta=theta, campaign="theta")
              for theta in (35, 43, 51, 59, 67)]  # fmt: skip
    return arcs, thetas


def test_series_hold_one_angle_and_go_across_campaigns(propagation):
    arcs, thetas = sweeps(propagation)
    series = swept_series([*arcs, *thetas], ARC)
    assert [(one.label, len(one.points)) for one in series] == [("theta 75 deg", 6), ("theta 60 deg", 6)]
    over_theta = swept_series([*arcs, *thetas], ANGLE)
    at_75 = next(one for one in over_theta if one.label == "alpha 75 deg")
    assert np.rad2deg(at_75.values) == pytest.approx([35, 43, 51, 59, 60, 67, 75])
    assert at_75.title == "over theta at alpha 75 deg by fea"


def test_is_alpha_negligible_and_theta_strong(propagation):
    arcs, thetas = sweeps(propagation)
    ours = [*swept_series(arcs, ARC), *swept_series([*thetas], ANGLE)]
    table = effect_table(ours)
    assert column(table, "designs") == ["6 of 6", "6 of 6", "5 of 5"]
    assert column(table, "s spread") == ["0.0%", "9.5%", "88.9%"]
    assert column(table, "s r") == ["-", "+1.000", "+1.000"]
    assert column(table, "effect") == [
        "s: negligible (text: negligible); y: negligible (text: negligible)",
        "s: negligible (text: negligible); y: neither steady nor negligible (text: negligible)",
        "s: strong (text: high correlation); y: negligible (text: not significant)",
    ]
    assert float(column(table, "s [mm/deg]")[2]) == pytest.approx(0.5)
    assert float(column(table, "s [mm/deg]")[1]) == pytest.approx(0.04)


def test_a_motion_that_nobody_sees_is_negligible(propagation):
    arcs = [propagation(20e-3, y, arc=a, theta=75) for a, y in ((35, 1e-6), (45, -1e-6), (55, 5e-5))]
    (row,) = effect_table(swept_series(arcs, ARC)).rows
    assert row[-1].startswith("s: negligible (text: negligible); y: negligible")


def test_a_design_that_is_lost_shows_as_a_hole(propagation):
    arcs = [propagation(arc=35), propagation(arc=45, status="diverged"), propagation(arc=55)]
    tables = list(fin_tables(arcs))
    table = titled(tables, "fins over alpha")
    assert column(table, "s [mm]") == ["20", "-", "20"]
    assert column(table, "because") == ["", "diverged: the tube folds", ""]
    assert column(titled(tables, "is alpha"), "designs") == ["2 of 3"]


def test_pinches_outside_sweeps_have_a_table(propagation):
    tables = list(fin_tables([propagation(campaign="mesh", slug="single")]))
    table = titled(tables, "other pinches")
    assert table.rows[0][:7] == ("mesh", "fea", "20", "6", "-", "-16", "12")
    assert column(table, "stroke [deg]") == ["30"]
    assert column(table, "curvature") == ["2"]


# ------------------------------------------------------------------------------------------- pushes, pressure


def test_limit_loads_stand_beside_the_labs(fin_push):
    pairs = [(0.0, 2.0, 1.0), (0.033, 5.0, 0.4), (0.0165, 3.0, 0.7)]
    pushes = [fin_push(*one) for t, most, least in pairs for one in (("opposite", t, most), ("equal", t, least))]
    table = titled(fin_tables(pushes), "limit loads of the fin, prototype by fea")
    assert table.rows[0][0] == "lab"
    assert column(table, "opposite: largest [N]") == ["5.02", "2", "3", "5"]
    assert column(table, "equal: largest [N]") == ["0.32", "1", "0.7", "0.4"]
    assert column(table, "opposite over equal") == ["15.69", "2", "4.286", "12.5"]
    assert column(table, "pinched [mm]")[1:] == ["0", "16.5", "33"]
    assert column(table, "opposite: at [mm]")[1:] == ["5"] * 3
    # 1 N at 5 mm, 0.85 of 52.8 mm from the crease.
    lever = 0.85 * 0.0528
    assert float(column(table, "equal: K [N m/rad]")[1]) == pytest.approx(200 * lever**2, rel=1e-3)
    assert column(table, "fin angle [deg]")[1:] == ["40"] * 3


def test_other_designs_share_a_table(fin_push):
    """One state each: a line per design instead of a table."""
    arcs = [
        fin_push(
            sense, 0.033, force, slug=f"fin_arc={arc}deg_sense={sense}", device=FinnedTube(fin_arc=np.deg2rad(arc))
        )
        for arc, forces in ((90, (0.6, 0.4)), (130, (1.7, 0.2)))
        for sense, force in zip(("opposite", "equal"), forces, strict=True)
    ]
    tables = list(fin_tables([*arcs, fin_push("equal", 0.033, 0.3)]))
    table = titled(tables, "limit loads of fins of other designs")
    assert column(table, "device") == ["lab: prototype", "prototype, fin arc 90deg", "prototype, fin arc 130deg"]
    assert column(table, "opposite: largest [N]") == ["5.02", "0.6", "1.7"]
    assert column(table, "opposite over equal") == ["15.69", "1.5", "8.5"]
    assert column(table, "pinched [mm]")[1:] == ["33", "33"]
    assert sum(one.title.startswith("limit loads") for one in tables) == 2
    assert not [one for one in fin_tables([fin_push("equal", 0.033, 0.3)]) if "other designs" in one.title]


def test_a_fin_that_only_stiffens_has_no_limit(fin_push):
    (states,) = fin_states([fin_push("opposite", 0.01, 2.0, snaps=False), fin_push("equal", 0.01, 0.5)])
    assert states.largest("opposite") == pytest.approx(4.0)
    assert math.isnan(states.states[0].number("opposite", "limit_load"))
    table = titled(fin_tables([fin_push("opposite", 0.01, 2.0, snaps=False)]), "limit loads")
    assert column(table, "opposite: limit [N]")[1:] == ["-"]
    assert column(table, "equal: largest [N]")[1:] == ["-"]


def test_stiffness_over_flattening_is_two_exponentials(fin_push):
    travels = np.linspace(0.0, 0.033, 6)
    pushes = [fin_push("opposite", t, 1.0 + 0.25 * math.exp(2.0 * t / 0.033)) for t in travels]
    (states,) = fin_states(pushes)
    law = states.laws["opposite", "force_max"]
    assert law.misfit < 1e-6
    assert law(np.array([0.5]))[0] == pytest.approx(1.0 + 0.25 * math.e, rel=1e-4)
    table = titled(fin_tables(pushes), "two-term")
    assert column(table, "sense") == ["opposite"] * 3
    assert column(table, "spare") == ["2"] * 3
    assert column(table, "of")[0] == "initial stiffness [N m/rad]"


def test_pressure_flattens_by_what_the_record_says(propagation):
    (row,) = pressure_table([propagation(drive="pressure", slug="single", campaign="inflate")]).rows
    # Travel grows as the root of the pressure, known at eleven states: 0, 10 ... 40 psi lie on or between them.
    assert float(row[2]) == pytest.approx(0.0, abs=0.01)
    assert float(row[4]) == pytest.approx(33 * math.sqrt(0.5), rel=1e-3)
    assert float(row[6]) == pytest.approx(33.0, rel=1e-4)
    assert row[7] == "1 at 40 psi"
    (row,) = pressure_table([propagation(drive="pressure", psi=25.0, reached=0.02, slug="single")]).rows
    assert row[5:7] == ("-", "-")
    assert row[7] == "0.606 at 25 psi"


# ------------------------------------------------------------------------------------------- paddling


def test_runs_stand_below_the_lab_and_the_dissertations_model(paddling):
    runs = [
        paddling(),
        paddling(2.6, -0.47, load_fin=True),
        paddling(2.0, -0.4, load_fin=True, body="free", seen=frozenset()),
    ]
    table = titled(paddle_tables(runs), "thrust and swimming")
    assert column(table, "by") == [
        "lab",
        "dissertation's model",
        "paddler",
        "lab",
        "dissertation's model",
        "paddler",
        "paddler",
    ]
    assert column(table, "thrust: max [N]") == ["1.2", "1.2", "1.2", "2.6", "2.58", "2.6", "2"]
    # Half sines of both strokes: their difference over pi.
    assert float(column(table, "mean [N]")[2]) == pytest.approx((1.2 - 0.98) / math.pi, rel=1e-3)
    assert column(table, "origin")[-2:] == ["prb", "prb, fitted"]
    assert column(table, "swims [mm/s]")[3] == "53"
    assert float(column(table, "swims [mm/s]")[-1]) == pytest.approx(53.0)
    assert float(column(table, "recovery [deg]")[2]) == pytest.approx(-math.degrees(0.4), rel=1e-3)


def test_another_water_stands_beside_the_plate_law_and_for_nothing_published(paddling):
    runs = [paddling(), paddling(0.5, -1.7, performer="elliptic", water="ellipsoid")]
    tables = list(paddle_tables(runs))
    table = titled(tables, "thrust and swimming")
    assert column(table, "water")[:4] == ["-", "plate", "plate", "ellipsoid"]
    assert column(table, "thrust: max [N]")[2:4] == ["1.2", "0.5"]
    assert not any("elliptic" in row[2] for row in titled(tables, "tip speeds").rows)
    assert accuracy_table(runs).header[3:] == ("paddler (prb)",)
    lost = paddling(performer="elliptic", water="ellipsoid", status="diverged")
    told = titled(paddle_tables([lost]), "thrust and swimming").rows[2]
    assert (told[1], told[3], told[-1]) == ("elliptic", "ellipsoid", "diverged: the tube folds")


def test_the_mean_thrust_changes_sign_where_the_record_says(paddling):
    """least falls from -0.5 to -2 N while most stays at 1 N: nothing is left at 1 N."""
    runs = [paddling(1.0, -least, frequency=f) for f, least in ((0.5, 0.5), (1.0, 0.8), (2.0, 1.2), (3.0, 2.0))]
    (series,) = swept_series(runs, FREQUENCY)
    (row,) = sign_table([series]).rows
    assert row[:4] == ("frequency", "-", "paddler", "0.5 Hz to 3 Hz")
    assert row[6] == "1.5 Hz"
    assert row[7].endswith("at 0.5 Hz")


def test_a_map_has_a_column_for_every_size(paddling):
    sizes = (0.01, 0.02, 0.03, 0.04, 0.05)
    runs = [
        paddling(1.0 + 20 * size, -1.0, load_fin=True, frequency=f, size=size) for f in (1.0, 2.0) for size in sizes
    ]
    tables = list(paddle_tables(runs))
    table = titled(tables, "mean thrust [N] over frequency")
    assert table.header == ("frequency", "10 mm", "20 mm", "30 mm", "40 mm", "50 mm")
    assert float(table.rows[1][5]) == pytest.approx(1.0 / math.pi, rel=1e-3)
    signs = [table for table in tables if table.title.startswith("where the mean thrust")]
    assert [table.detail for table in signs] == [False, True]
    assert {row[0] for table in signs for row in table.rows} == {"frequency", "load fin length"}


def test_reported_speeds_give_milli_newtons(paddling):
    runs = [paddling(), paddling(2.6, -0.47, load_fin=True, tip=(0.5, 0.25))]
    table = plate_table(runs)
    lab = [row for row in table.rows if row[2] == "lab"]
    assert len(lab) == 4
    most = next(row for row in lab if row[:2] == ("with load fin", "power"))
    law = PlateLaw.of(FinnedTube(load_fin=LoadFin()))
    assert float(most[6]) == pytest.approx(law.force(0.02976), rel=1e-3)
    assert float(most[6]) < 0.01
    assert float(most[9]) == pytest.approx(1e3 * law.speed(2.6), rel=1e-3)
    ours = next(row for row in table.rows if row[:3] == ("with load fin", "power", "paddler (prb)"))
    assert (ours[3], ours[4]) == ("500", "500")


# ------------------------------------------------------------------------------------------- accuracy, cost


def test_all_origins_side_by_side(propagation, fin_push, paddling):
    found = [
        propagation(campaign="propagation", slug="single"), propagation(25e-3, arc=35),
        fin_push("opposite", 0.033, 6.0), fin_push("equal", 0.0165, 0.4),
        paddling(1.3, -0.8), paddling(2.4, -0.5, load_fin=True),
        paddling(9.9, -9.9, load_fin=True, size=0.05), paddling(load_fin=True, body="free"),
    ]  # fmt: skip
    table = accuracy_table(found)
    assert table.header == ("quantity", "lab (measured)", "dissertation's model (prb)", "fea (fea)", "paddler (prb)")
    rows = {row[0]: row[1:] for row in table.rows}
    assert rows["s at full pinch [mm]"] == ("-", "-", "20", "-")
    assert rows["limit load, opposite sense [N]"] == ("5.02", "-", "6 (+20%)", "-")
    assert rows["limit load, equal sense [N]"] == ("0.32", "-", "0.4 (+25%)", "-")
    assert rows["peak thrust, without load fin [N]"] == ("1.2", "1.2 (+0%)", "-", "1.3 (+8%)")
    assert rows["smallest thrust, without load fin [N]"] == ("-0.98", "-0.72 (+27%)", "-", "-0.8 (+18%)")
    assert rows["peak thrust, with load fin [N]"][3] == "2.4 (-8%)"
    assert rows["swimming speed, with load fin [mm/s]"][3].startswith("53")
    assert len(rows) == 11


def test_what_a_fit_has_searched_for_is_marked(paddling):
    to_thrust = frozenset({("published", "lab", "thrust"), ("push", "fea", "single")})
    to_fea = frozenset({("push", "fea", "single")})
    found = [
        paddling(1.2, performer="searched", seen=to_thrust), paddling(0.6, performer="learned", seen=to_fea),
        paddling(load_fin=True, body="free", performer="searched", seen=to_thrust),
    ]  # fmt: skip
    table = accuracy_table(found)
    assert table.header[3:] == ("searched (prb, fitted)", "learned (prb, fitted)")
    rows = {row[0]: row[3:] for row in table.rows}
    assert rows["peak thrust, without load fin [N]"] == ("1.2 (+0%) *", "0.6 (-50%)")
    assert not rows["swimming speed, with load fin [mm/s]"][0].endswith("*")
    assert len(table.notes) == 2


def test_without_a_result_there_is_no_accuracy_table(propagation):
    assert accuracy_table([propagation(status="failed", slug="single")]).rows == ()
    assert accuracy_table([]).rows == ()


def test_run_time_beside_the_dissertations(propagation, paddling):
    whole = [propagation(wall_time_s=75.0, states=201), propagation(wall_time_s=85.0, arc=45, states=201)]
    table = run_time_table([*whole, propagation(wall_time_s=8.0), paddling()])
    assert table.rows[0][:5] == ("ShapePropagation", "dissertation's FEA", "fea", "1", "1500")
    fea = table.rows[1]
    assert fea[3:5] == ("2", "80")
    assert fea[5:7] == ("200", "400")
    assert fea[8] == f"{1500 / 80:.3g}"
    # Fewer increments are not the same work.
    assert table.rows[2][3:6] == ("1", "8", "10")
    assert table.rows[2][8] == "-"
    prb = table.rows[3]
    assert prb[5:7] == ("-", "-")
    assert float(prb[7]) == pytest.approx(1.0)
    assert figures()["c4-fea-runtime"]["value"] == 25


def test_nothing_without_fins(orbit):
    assert list(fin_tables([orbit()])) == []
