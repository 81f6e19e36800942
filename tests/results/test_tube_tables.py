"""Tables, sensitivities and ledger of pinched tubes, on records with numbers that are known."""

import math

import numpy as np
import pytest

from lab.elastic_limits import elastic_limit, elastic_limits
from lab.experiments import Pinch, PinchedBending, ShapeRecovery
from lab.experiments.pinch_drive import STAGES
from lab.materials import material
from lab.pinching import first_order
from lab.records import Channel, Record, channels
from lab.specimens import PinchedTube
from lab.tube_theory import open_stiffness
from results.accuracy import Entry, against_record
from results.pinch_series import pinch_series
from results.pinch_tables import nearby, pinch_tables
from results.push_tests import pairs, push_tests
from results.sensitivity import CLOSED, OPEN, RATIO, sensitivities
from results.sensitivity_tables import sensitivity_tables
from results.tables import layout
from results.tube_tables import tube_comparison, tube_tables
from results.tubes import free_way, published_size, sized, way

TUBE = sized("printed-tpu")


def entry(
    experiment, found, *, tube=TUBE, campaign="c", performer="fea", slug="single", specimen="tpu", seen=None, **how
):
    status = how.pop("status", "completed")
    origin = "fea" if performer.startswith("fea") else "prb"
    record = Record(
        origin, performer, tube.model_dump(mode="json"), experiment.model_dump(mode="json"), channels(*found), how=how,
        status=status, reason="" if status == "completed" else "step too small",
    )  # fmt: skip
    return Entry(campaign, performer, slug, specimen, experiment, record, "x", seen)


def ellipse(axis, flat, radius=0.0245):
    """Section of two half axes along ``axis`` and across it, its width reduced by the share ``flat``."""
    turn = np.linspace(0, 2 * np.pi, 120, endpoint=False)
    flattened = radius * (np.cos(turn) + 1j * (1 - flat) * np.sin(turn)) * np.exp(1j * axis)
    return np.stack([flattened.real, flattened.imag], axis=1)


def pinch(degrees=0.0, *, axis=None, force=8.0, soft=0.1, ratio=4.0, touch=True, strain=0.1, slug=None, **changes):
    """A pinch that closes at ``force`` with a section and a hinge along ``axis`` (deg; ideal by itself)."""
    kept = {
        k: changes.pop(k)
        for k in ("tube", "campaign", "performer", "specimen", "status", "notes", "seen")
        if k in changes
    }
    experiment = Pinch(pinch_angle=math.radians(degrees), **changes)
    along = math.radians(degrees / 2 if axis is None else axis)
    flexibility = np.eye(6)
    line = np.array([math.cos(along), math.sin(along)])
    flexibility[3:5, 3:5] = np.outer(line, line) / soft + (np.eye(2) - np.outer(line, line)) / (soft * ratio)
    states = 4
    found = [
        Channel("increment", "1", np.arange(states), ("increment",)),
        Channel("stage", "1", np.array([0, 2, 2, 2]), ("increment",)),
        Channel("travel", "m", np.array([0, 0.02, 0.03, 0.04]), ("increment",)),
        Channel("force", "N", force * np.array([0.0, 0.6, 0.9, 1.0]), ("increment",)),
        Channel("gap", "m", np.array([0.04, 0.02, 0.01, 0.0]), ("increment",)),
        Channel("contact_force", "N", np.array([0.0, 0, 0, 1.0 if touch else 0.0]), ("increment",)),
        Channel(
            "section", "m", np.array([ellipse(along, f) for f in (0, 0.3, 0.6, 0.9)]), ("increment", "place", "axis")
        ),
        Channel("flexibility", "1", np.array([flexibility] * states), ("increment", "dof", "dof_loaded")),
        Channel("strain", "1", np.array([0, 0.5, 0.8, 1.0]) * strain, ("increment",)),
    ]
    return entry(experiment, found, slug=slug or f"pinch_angle={degrees:g}deg", **kept)


def bend(k=100.0, *, way_deg=0.0, push="2 mm", loss=None, slug="single", **changes):
    """A block that moves ``way_deg`` from the direction of a load or push with the stiffness ``k``."""
    names = ("tube", "campaign", "performer", "specimen", "status", "notes", "seen")
    kept = {name: changes.pop(name) for name in names if name in changes}
    load = changes.pop("load", None)
    given = {"load": load} if load is not None else {"push": push}
    experiment = PinchedBending(returns=loss is not None, **given, **changes)
    pushed = np.array([0, 0, 1e-3, 2e-3]) if load is None else np.array([0, 0, load / k / 2, load / k])
    force, stage = k * pushed, np.array([0, 2, 3, 3])
    if loss is not None:
        # Back on a lower line, with as much less work as the loss asks for.
        pushed, stage = np.append(pushed, [1e-3, 0.0]), np.append(stage, [4, 4])
        force = np.append(force, [k * 1e-3 * (1 - 2 * loss), 0.0])
    direction = np.exp(1j * (experiment.direction + math.radians(way_deg)))
    pose = np.zeros((len(pushed), 6))
    pose[:, 0], pose[:, 1] = pushed * direction.real, pushed * direction.imag
    pose[:, 3] = pushed / 0.05
    found = [
        Channel("increment", "1", np.arange(len(pushed)), ("increment",)),
        Channel("stage", "1", stage, ("increment",)),
        Channel("load", "N", force, ("increment",)),
        Channel("pushed", "m", pushed, ("increment",)),
        Channel("pose", "m", pose, ("increment", "dof")),
    ]
    return entry(experiment, found, slug=slug, **kept)


def recovery(load, flat, helped, slug="single"):
    """A tube that is flat by these shares after it was let go, and after help."""
    stages = ("rest", "load", "pinch", "release", "recover", "let go")
    found = [
        Channel("increment", "1", np.arange(6), ("increment",)),
        Channel("stage", "1", np.array([STAGES.index(name) for name in stages]), ("increment",)),
        Channel("section", "m", np.array([ellipse(0, f) for f in (0, 0, 0.9, 0.9 * flat, 0.1, 0.9 * helped)]),
                ("increment", "place", "axis")),
        Channel("pushed", "m", np.linspace(0, 5e-3, 6), ("increment",)),
    ]  # fmt: skip
    return entry(ShapeRecovery(load=load), found, slug=slug)


def titled(tables, start):
    (found,) = [table for table in tables if table.title.startswith(start)]
    return found


def column(table, name):
    return [row[table.header.index(name)] for row in table.rows]


# ------------------------------------------------------------------------------------------- series


def test_five_pinches_are_twenty_four_designs():
    (series,) = pinch_series([pinch(a) for a in (60, 0, 15, 45, 30)])
    assert [round(math.degrees(p.pinch_angle)) for p in series.points] == [0, 15, 30, 45, 60]
    angles = [round(math.degrees(design.pinch_angle)) for design in series.designs]
    assert angles == list(range(0, 360, 15))
    # The images of axes at alpha / 2 are at alpha / 2 again.
    for design in series.designs:
        off = (design.axis("hinge_axis") - design.pinch_angle / 2 + 0.5) % math.pi - 0.5
        assert off == pytest.approx(0, abs=1e-5)
    assert sum(design.computed for design in series.designs) == 5


def test_an_axis_that_lags_leads_in_the_mirror():
    (series,) = pinch_series([pinch(0), pinch(15, axis=5.0)])
    axes = {round(math.degrees(d.pinch_angle)): math.degrees(d.axis("deformation_axis")) for d in series.designs}
    assert axes[105] == pytest.approx(55, abs=1e-3)
    assert axes[135] == pytest.approx(65, abs=1e-3)
    assert axes[345] == pytest.approx(175, abs=1e-3)


def test_a_computed_pinch_stands_for_itself_and_beside_its_image():
    entries = [pinch(0), pinch(15, axis=5.0), pinch(105, axis=58.0, force=8.4)]
    (series,) = pinch_series(entries)
    (design,) = [d for d in series.designs if round(math.degrees(d.pinch_angle)) == 105]
    assert design.computed
    assert math.degrees(design.axis("hinge_axis")) == pytest.approx(58)
    table = titled(pinch_tables([series]), "equivalent pinches")
    assert table.rows == ((series.title, "105", "15", "+5.00%", "+0.00%", "+3.00", "+3.00"),)


def test_series_go_across_campaigns_and_not_across_tubes_laws_performers_and_settings():
    fea = sized("fea-tube")
    entries = [
        pinch(0), pinch(30, campaign="more"), pinch(0, tube=fea, specimen="fea-tube"), pinch(30, law="even"),
        pinch(30, performer="hinge"), pinch(30, slug="pinch_angle=30deg_along=24"),
    ]  # fmt: skip
    found = pinch_series(entries)
    assert [len(one.points) for one in found] == [2, 1, 2, 1, 1]
    assert [one.label for one in found] == ["tpu", "fea-tube", "tpu, law even", "tpu", "tpu, along 24"]
    # Laws agree where one pair pulls alone.
    assert found[2].first is found[0].first


def test_forces_of_ones_own_have_no_images_and_no_ideal():
    (series,) = pinch_series([pinch(pair_forces=(1, 1, 1))])
    assert series.designs == ()
    assert math.isnan(series.points[0].ideal)
    table = titled(pinch_tables([series]), "other pinches")
    assert column(table, "first order") == ["cancels"]
    assert column(table, "ideal axis") == ["-"]


def test_an_axis_off_the_mirror_line_is_told():
    (series,) = pinch_series([pinch(0), pinch(30), pinch(60, axis=39.0)])
    assert math.degrees(series.points[2].mirror_error("hinge_axis")) == pytest.approx(9)
    assert series.points[0].mirror_error("hinge_axis") == pytest.approx(0, abs=1e-9)
    (across,) = pinch_series([pinch(60, axis=120.0)])
    assert across.points[0].mirror_error("hinge_axis") == pytest.approx(0, abs=1e-9)
    tables = list(pinch_tables([series]))
    assert "hinge axis 9 deg off its mirror line" in tables[0].rows[2][-1]
    assert column(titled(tables, "how steadily"), "off its mirror line") == ["9 at 60", "9 at 60"]


# ------------------------------------------------------------------------------------------- tables of pinches


def test_the_table_sets_forces_beside_first_order_theory():
    (series,) = pinch_series([pinch(0, force=8.0), pinch(60, force=11.0, soft=0.2)])
    table = next(pinch_tables([series]))
    assert column(table, "forces over F_p") == ["1, 0, 0", "0.707, 0.707, 0"]
    assert column(table, "closing force [N]") == ["8", "11"]
    assert column(table, "over alpha 0") == ["1", "1.375"]
    assert column(table, "first order") == ["1", "1.414"]
    assert column(table, "hinge axis") == ["0.0 (+0.0)", "30.0 (+0.0)"]
    assert column(table, "anisotropy") == ["4", "4"]
    assert column(table, "flattening [%]") == ["90", "90"]


def test_a_tube_that_never_closes_and_one_without_a_result_say_so():
    (series,) = pinch_series([pinch(0, touch=False), pinch(30, status="diverged"), pinch(60, notes=["ended at 9 N"])])
    table = next(pinch_tables([series]))
    assert column(table, "closing force [N]") == ["-", "-", "8"]
    assert column(table, "because") == ["the walls never touched", "diverged: step too small", "ended at 9 N"]


def test_an_unstable_closed_tube_says_so():
    (series,) = pinch_series([pinch(0), pinch(60, soft=-0.1)])
    assert column(next(pinch_tables([series])), "because")[1].startswith("the closed tube is unstable")


def test_steps_of_an_axis_beside_theory():
    def lagging(a):
        return math.degrees(first_order(Pinch(pinch_angle=math.radians(a)).shares(3)).axis)

    (series,) = pinch_series([pinch(a, axis=lagging(a)) for a in (0, 15, 30, 45, 60)])
    table = titled(pinch_tables([series]), "how steadily")
    assert column(table, "steady [deg]") == ["7.5", "7.5"]
    assert column(table, "largest step [deg]") == column(table, "first order [deg]")
    assert float(column(table, "largest step [deg]")[0]) > 9
    assert column(table, "off its mirror line") == ["nowhere", "nowhere"]


@pytest.mark.parametrize(("axis", "ideal", "text"), [(178, 0, "-2.0"), (2, 0, "2.0"), (50, math.nan, "50.0")])
def test_lines_are_shown_near_the_ideal_one(axis, ideal, text):
    assert nearby(math.radians(axis), math.radians(ideal)) == text


# ------------------------------------------------------------------------------------------- other tables


def test_materials_are_compared_where_they_differ():
    pet = pinch(tube=sized("pet"), specimen="pet", force=400.0, strain=0.048)
    table = titled(tube_tables([pinch(strain=0.11), pet]), "choice of material")
    assert column(table, "material") == ["tpu-95a", "pet"]
    assert column(table, "3: strain over that") == ["0.2", "2"]
    assert column(table, "D x L x t [mm]") == ["50 x 100 x 1", "72 x 180 x 1"]
    assert not [t for t in tube_tables([pinch(), pinch(60)]) if t.title == "choice of material"]


def test_elastic_limits_know_their_materials_whatever_their_modulus():
    for limit in elastic_limits():
        assert elastic_limit(material(limit.name)) == limit
        assert limit.assumed.startswith("not published")
    assert elastic_limit(material("nylon")) is None
    assert 0 < elastic_limit(material("pet")).strain < elastic_limit(material("tpu-95a")).strain < 3.1


def test_pushes_stand_beside_the_lab_and_theory():
    entries = [
        bend(1500.0, pinched=False), bend(120.0), bend(125.0, firmness=0.2, slug="firmness=0.2"),
        bend(130.0, place="10 mm", slug="place=10mm"),
    ]  # fmt: skip
    tables = [table for table in tube_tables(entries) if table.title.startswith("push tests")]
    table, swept = tables
    assert table.rows[0] == ("printed tube", "lab", "-", "1812", "-", "148.6", "12.19", "")
    assert column(table, "open over pinched") == ["12.19", "12.5"]
    assert column(swept, "tube") == ["printed tube", "tpu, firmness 0.2", "tpu, place 10mm"]
    assert column(swept, "open over pinched") == ["12.19", "12", "-"]
    assert swept.detail
    assert float(column(table, "theory, open")[1]) == pytest.approx(open_stiffness(TUBE), rel=1e-3)
    assert pairs(push_tests(entries))[2][0] is None


def test_theory_of_the_open_tube_by_hand():
    # Long and thin: three E I over L cubed, I = pi R^3 t.
    long = PinchedTube(length=2.0)
    assert open_stiffness(long) == pytest.approx(3 * 26e6 * math.pi * 0.0245**3 * 1e-3 / 8, rel=2e-3)
    # A force ahead of the tip bends as on a longer tube, but for the block's rigid part.
    inertia = math.pi * 0.0245**3 * 1e-3
    bent = (2.0**3 / 3 + 2.0**2 * 0.5 + 2.0 * 0.25) / (26e6 * inertia)
    assert open_stiffness(long, 0.5) == pytest.approx(1 / bent, rel=2e-3)


def test_dead_loads_go_across_the_hinge():
    for alpha, free in ((0, 0), (120, 60), (240, -60)):
        assert math.degrees(free_way(math.radians(alpha / 2), -math.pi / 2)) == pytest.approx(free, abs=1e-9)
    assert math.isnan(free_way(0.0, 0.0))
    assert math.degrees(way(1.0, 0.0, -math.pi / 2)) == pytest.approx(90)
    loaded = bend(load=4.905, way_deg=40.0, pinch_angle=math.radians(120), slug="pinch_angle=120deg")
    model = bend(load=4.905, performer="hinge")
    tables = [t for t in tube_tables([loaded, bend(load=4.905, pinched=False), model]) if t.title.startswith("dead")]
    assert [(table.title, table.detail) for table in tables] == [
        ("dead loads", False),
        ("dead loads by PRB models", True),
    ]
    table = tables[0]
    assert column(table, "way (free hinge)") == ["40 (60)", "0"]
    assert column(table, "ideal axis") == ["60", "-"]
    assert column(table, "order") == ["pinch first", "open"]
    assert float(column(table, "x [mm]")[0]) == pytest.approx(1e3 * 4.905 / 100 * math.sin(math.radians(40)), rel=1e-3)


def test_recovery_in_words_and_losses():
    tables = list(tube_tables([recovery(4.905, 0.02, 0.0), recovery(9.81, 0.6, 0.05), bend(loss=0.25)]))
    table = titled(tables, "recovery")
    assert column(table, "by itself") == ["round again", "stays flat"]
    assert column(table, "with help") == ["round again", "round again"]
    assert [float(cell) for cell in column(table, "let go [%]")[:2]] == pytest.approx([2, 60], rel=1e-3)
    lost = titled(tables, "hysteresis")
    assert column(lost, "loss [%]") == ["25"]
    assert column(lost, "bent by") == ["2 mm"]


def test_nothing_about_tubes_gives_no_table(orbit):
    assert list(tube_tables([orbit()])) == []


# ------------------------------------------------------------------------------------------- sensitivities


def wall(mm, k, pinched=True):
    tube = PinchedTube.model_validate({"size": "printed-tpu", "wall": mm * 1e-3})
    return bend(k, tube=tube, pinched=pinched, slug=f"wall={mm}mm", campaign="walls")


def test_a_power_is_found_and_the_labs_value_between_samples():
    entries = [bend(100.0), wall(0.8, 100 * 0.8**2.5), wall(1.25, 100 * 1.25**2.5)]
    (one,) = sensitivities(entries)
    assert (one.result, one.path) == (CLOSED, "specimen.wall")
    assert one.values[one.nominal] == 1e-3
    assert one.slope == pytest.approx(2.5)
    assert one.target == 148.6
    value, between = one.matching()
    assert between
    assert value == pytest.approx(1e-3 * 1.486**0.4)


def test_outside_the_samples_a_match_is_marked_and_a_far_one_refused():
    near = [bend(100.0), wall(0.8, 80.0)]
    (table,) = sensitivity_tables(near)
    assert column(table, "power or change") == ["+1.00"]
    assert column(table, "to match the lab") == ["1.49 mm (extrapolated)"]
    weak = [bend(100.0), wall(0.8, 100 * 0.8**0.3)]
    (table,) = sensitivity_tables(weak)
    assert column(table, "to match the lab") == ["none"]


def test_fields_that_may_be_zero_have_a_change_per_unit():
    entries = [
        bend(1812 * math.exp(-0.01 * mm), pinched=False, place=mm * 1e-3, slug=f"place={mm}mm") for mm in (0, 10)
    ]
    (one,) = sensitivities(entries)
    assert one.result == OPEN
    (table,) = sensitivity_tables(entries)
    assert column(table, "power or change") == ["-1 % per mm"]
    assert column(table, "to match the lab") == ["0 mm"]


def test_ratios_follow_both_tests_and_several_fields_share_the_nominal_case():
    entries = [
        bend(1800.0, pinched=False), bend(150.0), wall(0.8, 1440.0, pinched=False), wall(0.8, 90.0),
        bend(160.0, firmness=0.2, slug="firmness=0.2"),
    ]  # fmt: skip
    found = {(one.result, one.path): one for one in sensitivities(entries)}
    assert set(found) == {
        (CLOSED, "specimen.wall"), (RATIO, "specimen.wall"), (OPEN, "specimen.wall"), (CLOSED, "experiment.firmness"),
        (RATIO, "experiment.firmness"),
    }  # fmt: skip
    np.testing.assert_allclose(found[RATIO, "specimen.wall"].results, [16, 12])
    np.testing.assert_allclose(found[RATIO, "experiment.firmness"].results, [12, 11.25])
    assert {one.entry.slug for one in found.values()} == {"single"}


def test_what_would_have_to_give_behind_the_pusher():
    entries = [bend(2000.0, pinched=False), bend(150.0)]
    assert sensitivities(entries) == []
    (table,) = sensitivity_tables(entries)
    matches = dict(zip(column(table, "result"), column(table, "to match the lab"), strict=True))
    # 1 / 1812 = 1 / 2000 + 1 / 19277, and a rig that leaves the ratio of the lab.
    assert matches[OPEN] == "19.3 N/mm"
    compliance = 1 / float(matches[RATIO].split()[0]) / 1e3
    assert (1 / 150 + compliance) / (1 / 2000 + compliance) == pytest.approx(1812 / 148.6, rel=2e-3)
    assert matches[CLOSED] == "15.9 N/mm"
    stiffer = list(sensitivity_tables([bend(1700.0, pinched=False), bend(150.0)]))
    assert column(stiffer[0], "to match the lab")[0] == "none"


def test_pinches_have_sensitivities_without_a_lab():
    entries = [pinch(0, force=f, firmness=p, slug=f"firmness={p}") for p, f in ((0.1, 8.0), (0.2, 8.0))]
    (table,) = sensitivity_tables(entries)
    assert column(table, "result") == ["closing force [N]", "anisotropy"]
    assert column(table, "power or change") == ["+0.00", "+0.00"]
    assert column(table, "to match the lab") == ["-", "-"]


def test_alpha_is_no_sensitivity_and_other_angles_have_no_lab():
    assert sensitivities([pinch(0), pinch(15)]) == []
    at = {"pinch_angle": math.radians(60)}
    ones = sensitivities([bend(100.0, **at), bend(110.0, firmness=0.2, slug="firmness=0.2", **at)])
    assert [math.isnan(one.target) for one in ones] == [True]


def test_settings_of_a_performer_show_convergence_and_match_no_lab():
    entries = [bend(k, slug=f"across={n}") for n, k in ((6, 110.0), (8, 103.0), (12, 101.0))]
    (one,) = sensitivities(entries)
    assert one.path == "performer.across"
    np.testing.assert_allclose(one.values, [6, 8, 12])
    assert math.isnan(one.target)


def test_samples_without_a_result_are_left_out():
    assert sensitivities([bend(100.0), bend(110.0, firmness=0.2, status="diverged")]) == []


# ------------------------------------------------------------------------------------------- accuracy


def test_axes_differ_by_angles_and_models_in_and_out_of_sample():
    seen = frozenset({("c", "fea", "pinch_angle=0deg")})
    rows = [
        row
        for a, off in ((0, -2.0), (30, 3.0))
        for row in against_record(pinch(a, axis=a / 2 + off, soft=0.11, performer="hinge", seen=seen), pinch(a))
    ]
    errors, whole = tube_comparison("c against fea", rows)
    assert column(errors, "use") == ["in sample", "held out"]
    assert column(errors, "hinge axis [deg]") == ["2", "3"]
    assert column(errors, "k soft") == ["10", "10"]
    assert "touch force" not in errors.header
    assert whole.detail
    assert not errors.detail
    assert all(math.isnan(row.relative_error) for row in rows if row.quantity.endswith("axis"))
    assert layout("c against fea", rows).rows == whole.rows


def test_motions_that_vanish_are_compared_with_the_largest():
    cases = ((0, 0.0), (120, 40.0))
    rows = [
        row
        for a, way_deg in cases
        for row in against_record(
            bend(98.0, load=1.0, way_deg=way_deg + 1, performer="hinge", slug=f"pinch_angle={a}deg"),
            bend(load=1.0, way_deg=way_deg, slug=f"pinch_angle={a}deg"),
        )
    ]
    errors, _ = tube_comparison("c against fea", rows)
    # 1 deg of 10 mm, over 10 mm sin 40.
    assert "at 0deg" in column(errors, "move x")[0] or "at 120deg" in column(errors, "move x")[0]
    assert float(column(errors, "move x")[0].split()[0]) < 5
    assert "of the largest reference value" in errors.notes[0]


def test_published_sizes_are_told_by_what_is_published():
    assert published_size(TUBE.model_dump()) == "printed-tpu"
    pads = PinchedTube.model_validate({"size": "fea-tube", "pad_height": 2e-3})
    assert published_size(pads.model_dump()) == "fea-tube"
    for changes in ({"wall": 0.9e-3}, {"pairs": 2}, {"material": {"youngs_modulus": 20e6}}):
        assert published_size(PinchedTube.model_validate({"size": "printed-tpu", **changes}).model_dump()) == ""
    assert published_size({"kind": "TwistedBeam"}) == ""
