import math
from dataclasses import replace

from results.accuracy import Row, published_ring_down
from results.summary import summary

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
    model, origin, inside, outside, unfitted, seconds, speed_up = line
    assert (model, origin, unfitted) == ("chain", "prb", "")
    assert inside == "3 %, 1 mm (1)"
    held_out = 100 * math.sqrt((0.03**2 + 0.04**2) / 2)
    assert outside == f"{held_out:.3g} % (2; 1 without a result)"
    assert (seconds, speed_up) == ("0.2", "150")


def test_a_model_without_any_result_is_not_left_out():
    failed = [replace(ROW, value=math.nan, use="not fitted")]
    assert summary("t", [failed]).rows[0][4] == "- (1 without a result)"


def test_the_published_models_stand_in_it_with_their_times():
    fea, prb = summary("t", [published_ring_down()]).rows
    assert (fea[4], fea[5]) == ("34.8 % (1)", "82.5")
    assert (prb[2], prb[5]) == ("9.38 % (1)", "1.2")


def test_the_reference_of_each_group_stays_its_own():
    other = [replace(row, model="five") for row in rows()]
    assert [line[0] for line in summary("t", [list(rows()), other]).rows] == ["chain", "five"]
