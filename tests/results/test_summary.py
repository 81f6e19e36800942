import math
from dataclasses import replace

from results.accuracy import Row, published_ring_down
from results.summary import errors_by_quantity, summary, told_once

ROW = Row(
    "ring-down", "beam", "direction=0deg", "RingDown", "tracking_error", "1", "prb", "chain", 0.03, "fea", "fea", 0.0,
    0.03, "in sample", 0.01,
)  # fmt: skip


def rows():
    """One sample seen, two held out (3 % and 4 % by 4-3-5), one without a result."""
    yield ROW
    yield replace(ROW, quantity="tracking_rms", unit="m", value=1e-3)
    for sample, value in (("direction=45deg", 0.03), ("direction=90deg", 0.04), ("direction=60deg", math.nan)):
        yield replace(ROW, sample=sample, value=value, use="held out")
    yield replace(ROW, quantity="seconds_per_10_s", value=0.2)
    yield replace(ROW, quantity="speed_up", value=150.0)


def test_errors_are_put_together_by_what_the_fit_has_seen():
    (line,) = summary("t", [list(rows())]).rows
    model, origin, inside, outside, unfitted, _, largest, seconds, speed_up = line
    assert (model, origin, unfitted) == ("chain", "prb", "")
    assert inside == "3 %, 1 mm (1)"
    held_out = 100 * math.sqrt((0.03**2 + 0.04**2) / 2)
    assert outside == f"{held_out:.3g} % (2; 1 without a result)"
    assert largest == "4 % at 90deg"
    assert (seconds, speed_up) == ("0.2", "150")


def test_a_model_without_any_result_is_not_left_out():
    failed = [replace(ROW, value=math.nan, use="not fitted")]
    assert summary("t", [failed]).rows[0][4] == "- (1 without a result)"


def test_the_published_models_stand_in_it_with_their_times():
    fea, prb = summary("t", [published_ring_down()]).rows
    assert (fea[4], fea[6], fea[7]) == ("34.8 % (1)", "", "82.5")
    assert (prb[2], prb[6], prb[7]) == ("9.38 % (1)", "", "1.2")


def test_the_reference_of_each_group_stays_its_own():
    other = [replace(row, model="five") for row in rows()]
    assert [line[0] for line in summary("t", [list(rows()), other]).rows] == ["chain", "five"]


def test_only_a_shaken_clamp_needs_a_word_about_the_frame():
    shaken = [replace(row, experiment="BaseShake") for row in rows()]
    assert "relative to its clamp" in summary("t", [shaken]).notes[-1]
    assert len(summary("t", [list(rows())]).notes) == 1


def test_what_several_tables_would_say_is_said_once():
    shaken = [replace(row, experiment="BaseShake") for row in rows()]
    first, second, third = (
        summary(title, [group]) for title, group in (("a", list(rows())), ("b", shaken), ("c", shaken))
    )
    told = told_once([first, second, third])
    assert [table.notes for table in told] == [first.notes, second.notes[1:], ()]
    assert [table.rows for table in told] == [first.rows, second.rows, third.rows]


def test_errors_of_quantities_that_vanish_are_shares_of_the_largest():
    values = {"twist=0deg": (0.5, 0.0), "twist=45deg": (10.0, 8.0), "twist=90deg": (-19.0, -20.0)}
    stiffness = [
        replace(ROW, quantity="k_yz", sample=sample, value=ours, reference_value=theirs)
        for sample, (ours, theirs) in values.items()
    ]
    (own,) = errors_by_quantity("t", stiffness).rows
    rms = math.sqrt((25.0**2 + 5.0**2) / 2)  # the vanishing one has no share
    assert own == ("chain", "prb", f"{rms:.2g} (+25 at 45deg)")
    (shared,) = errors_by_quantity("t", stiffness, of_largest=True).rows
    rms = math.sqrt((2.5**2 + 10.0**2 + 5.0**2) / 3)
    assert shared == ("chain", "prb", f"{rms:.2g} (+10 at 45deg)")


def test_all_samples_as_one_motion():
    """Differences of 1 and 2 mm in motions of 10 and 100 mm."""
    found = [
        replace(ROW, sample=sample, quantity=quantity, unit=unit, value=value)
        for sample, share, distance in (("a", 0.1, 1e-3), ("b", 0.02, 2e-3))
        for quantity, unit, value in (("tracking_error", "1", share), ("tracking_rms", "m", distance))
    ]
    assert summary("t", [found]).rows[0][5] == f"{100 * math.sqrt((1**2 + 2**2) / (10**2 + 100**2)):.3g} %"
    assert summary("t", [found[:2]]).rows[0][5] == ""
