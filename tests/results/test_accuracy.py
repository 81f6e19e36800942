import csv
import io
import math
from dataclasses import replace

import numpy as np
import pytest

from lab.experiments import KPRIME_ENTRIES, RingDown, StaticStiffness
from lab.records import Channel, Record, Scalar, channels
from results.accuracy import HEADER, Entry, against_record, against_scalars, published_ring_down, seconds_per_10_s
from results.tables import Table, from_json, layout, to_console, to_csv, to_json, to_markdown

LAB = {name: Scalar(10.0, unit) for name, unit in KPRIME_ENTRIES}


def swing(performer, scale, origin="fea", fit=None, wall=1.0):
    time = np.arange(60) / 360
    path = scale * np.exp(-5 * time) * np.cos(200 * time)
    markers = np.zeros((60, 3, 3))
    markers[:, :, 2] = path[:, None]
    found = channels(
        Channel("time", "s", time, ("time",)), Channel("markers", "m", markers, ("time", "marker", "axis"))
    )
    record = Record(origin, performer, {}, {}, found, how={"wall_time_s": wall})
    return Entry("ring-down", performer, "direction=0deg", "beam", RingDown(), record, "x", fit)


def test_a_model_without_the_experiment_has_rows_without_values():
    reason = "rank of the tip compliance is 4 of 6"
    record = Record("prb", "five", {}, {}, status="unsupported", reason=reason)
    entry = Entry("table", "five", "twist=0deg", "beam", StaticStiffness(), record, "x")
    rows = list(against_scalars(entry, KPRIME_ENTRIES, "table-5-1", "lab", LAB, "phi 0 deg"))
    assert len(rows) == 9
    assert all(math.isnan(row.value) and math.isnan(row.relative_error) and row.note == reason for row in rows)
    table = layout("t", rows)
    assert {line[3] for line in table.rows} == {"-"}
    assert table.notes == (f"five: {reason}",)


def test_tracking_rows():
    reference = swing("fea", 1e-3, wall=2.0)
    rows = {r.quantity: r for r in against_record(swing("chain", 1.1e-3, "prb", wall=0.01), reference)}
    assert rows["tracking_error"].value == pytest.approx(0.1)
    assert rows["release_z"].relative_error == pytest.approx(0.1)
    assert rows["frequency"].relative_error == pytest.approx(0.0, abs=1e-6)
    assert rows["speed_up"].value == pytest.approx(200)


@pytest.mark.parametrize(
    ("seen", "use"),
    [
        (None, "not fitted"),
        (frozenset({("ring-down", "fea", "direction=0deg")}), "in sample"),
        (frozenset({("ring-down", "fea", "direction=90deg")}), "held out"),
        (frozenset({("ring-down", "virtual-lab", "direction=0deg")}), "held out"),
        (frozenset({("other", "fea", "direction=0deg")}), "held out"),
    ],
)
def test_what_a_fit_has_seen_is_in_sample(seen, use):
    rows = list(against_record(swing("chain", 1e-3, "prb", seen), swing("fea", 1e-3)))
    assert {row.use for row in rows} == {use}
    assert ("*" in layout("t", rows).rows[0][-1]) == (use == "in sample")


def test_time_for_ten_seconds():
    measured = swing("chain", 1e-3, wall=0.59).record  # 59 intervals at 360 Hz
    assert seconds_per_10_s(measured) == pytest.approx(36.0)
    assert seconds_per_10_s(replace(measured, how={"seconds_per_10_s": 0.2, "wall_time_s": 1.0})) == 0.2
    assert math.isnan(seconds_per_10_s(replace(measured, how={})))


def test_csv_is_tidy():
    rows = list(against_record(swing("chain", 1e-3, "prb"), swing("fea", 1e-3)))
    read = list(csv.DictReader(io.StringIO(to_csv(rows))))
    assert len(read) == len(rows)
    assert tuple(read[0]) == HEADER
    assert read[1]["relative_error"] == ""  # eq. 5.13 in metres has no relative error


def test_tables_survive_json_and_stand_in_markdown():
    table = layout("title", published_ring_down())
    assert from_json(to_json([table])) == [table]
    text = to_markdown([table])
    assert "| 34.79 |" in text
    assert "9.38 *" in text


def test_details_survive_json_and_stay_out_of_the_console(capsys):
    small, large = layout("small", published_ring_down()), Table("large", ("a",), (("hidden",),), detail=True)
    assert [table.detail for table in from_json(to_json([small, large]))] == [False, True]
    assert "hidden" in to_markdown([small, large])
    to_console([small, large])
    printed = capsys.readouterr().out
    assert "hidden" not in printed
    assert "1 more tables of details" in printed
    to_console([small])
    assert "more tables" not in capsys.readouterr().out


def test_a_layout_of_many_lines_is_a_detail():
    (row, *_) = published_ring_down()
    assert layout("t", [replace(row, sample=f"{i}") for i in range(101)]).detail
    assert not layout("t", [replace(row, sample=f"{i}") for i in range(100)]).detail


def test_direction_and_sense_of_an_orbit_have_no_share(orbit):
    reference, ours = orbit("fea", tilt=0.2, ratio=0.5), orbit("chain", tilt=0.3, ratio=-0.4)
    rows = {row.quantity: row for row in against_record(ours, reference)}
    assert rows["minor_axis"].relative_error == pytest.approx(-0.2)
    assert math.isnan(rows["tilt"].relative_error)
    assert math.isnan(rows["sense"].relative_error)
    assert (rows["tilt"].value, rows["sense"].value) == (pytest.approx(0.3), -1.0)


def test_stiffness_may_be_compared_with_that_of_a_performer():
    record = Record("prb", "five", {}, {}, status="unsupported", reason="rank")
    entry = Entry("table", "five", "single", "beam", StaticStiffness(), record, "x")
    assert list(against_record(entry, replace(entry, performer="fea"))) == []
