import math

import numpy as np
import pytest

from lab.specimens import TwistedBeam
from results.orbit_agreement import agreement, line_like, turns
from results.orbit_series import orbit_series
from results.orbit_tables import orbit_tables


def sweep(orbit, **ratios):
    """Series over 1, 2, ... Hz of performers with the given signed ratios of axes; None: no result."""
    entries = [
        orbit(performer, frequency=float(f), ratio=ratio or 0.0, status="diverged" if ratio is None else "completed")
        for performer, values in ratios.items()
        for f, ratio in enumerate(values, 1)
    ]
    (series,) = orbit_series(entries)
    return series


def test_reversals_are_paired_to_the_same_sense_and_the_nearest_first(orbit):
    # Zeros by linear interpolation: fea to - at 2.5, to + at 5.5; chain to - at 2.25, to + at 3.5, to - at 6.5.
    series = sweep(
        orbit, fea=[0.4, 0.2, -0.2, -0.4, -0.2, 0.2, 0.4, 0.4], chain=[0.4, 0.1, -0.3, 0.3, 0.4, 0.2, -0.2, -0.4]
    )
    chain, fea = series.track("chain"), series.track("fea")
    assert [(round(r.at, 9), r.after) for r in turns(fea)] == [(2.5, -1), (5.5, 1)]
    found = agreement(chain, fea)
    pairs = [(round(a.at, 9), round(b.at, 9)) for a, b in found.pairs]
    assert pairs == [(2.25, 2.5), (3.5, 5.5)]
    assert found.farthest == pytest.approx(2.0)
    assert not found.missing
    assert [round(r.at, 9) for r in found.surplus] == [6.5]
    back = agreement(fea, chain)
    assert [round(r.at, 9) for r in back.missing] == [6.5]
    assert not back.surplus


def test_samples_of_one_sense(orbit):
    series = sweep(orbit, fea=[0.5, 0.05, -0.3, -0.3, 0.0, None, 0.2], chain=[0.1, -0.2, -0.2, 0.2, 0.0, 0.2, 0.1])
    found = agreement(series.track("chain"), series.track("fea"))
    assert (found.compared, found.same) == (6, 4)
    # Where the reference is no line: 1, 3, 4 and 7 Hz.
    assert (found.clear, found.clear_same) == (4, 3)
    # Neighbours among the compared samples: the one without a result parts nothing.
    assert found.where == ((1.0, 1.0), (3.0, 3.0), (5.0, 7.0))
    np.testing.assert_array_equal(line_like(series.track("fea")), [False, True, False, False, True, False, False])


def test_a_track_agrees_with_itself(orbit):
    series = sweep(orbit, fea=[0.4, -0.2, 0.2, -0.4])
    fea = series.track("fea")
    found = agreement(fea, fea)
    assert found.same == found.compared == 4
    assert found.farthest == 0.0
    assert found.where == ((1.0, 4.0),)
    assert math.isnan(agreement(*[sweep(orbit, fea=[0.4, 0.4]).track("fea")] * 2).farthest)


def test_table_of_reversals(orbit):
    series = sweep(
        orbit, chain=[0.4, 0.1, -0.3, None], five=[0.09, 0.2, 0.09, 0.2], fea=[0.4, 0.2, -0.2, -0.4], rod=[0.0] * 4
    )
    table = orbit_tables([series], "fea")[0]
    lines = {line[1]: line for line in table.rows}
    assert list(lines) == ["fea", "chain", "five", "rod"]  # the reference first
    assert lines["fea"][2:] == ("+ to 2.5, then -", "", "", "", "", "", "", "")
    assert lines["chain"][2:] == ("+ to 2.25, then -", "2", "0.25", "0", "0", "3 of 3", "3 of 3", "1 to 3")
    assert lines["five"][2:] == ("+ throughout", "1, 3", "", "1", "0", "2 of 4", "2 of 4", "1 to 2")
    assert lines["rod"][2] == "a line"
    assert not table.detail


def test_table_of_orbits(orbit):
    series = sweep(orbit, fea=[0.5, -0.5], chain=[0.5, None])
    (table,) = orbit_tables([series], "fea")  # two samples say nothing of where between them it reverses
    assert table.header == ("frequency [Hz]", "fea (fea)", "chain", "error [%]")
    assert table.rows == (
        ("1", "4 x 2, 17, +", "4 x 2, 17, +", "0"),
        ("2", "4 x 2, 17, -", "-", "-"),
    )
    assert not table.detail


def test_error_in_the_table_is_the_tracking_error(orbit):
    entries = [orbit(major=4e-3), orbit("chain", major=5e-3)]
    (table,) = orbit_tables(orbit_series(entries), "fea")
    assert table.rows == (("15", "4 x 2, 17, +", "5 x 2.5, 17, +", "25"),)


def test_twists_are_shown_in_degrees_and_long_series_are_details(orbit):
    entries = [
        orbit(performer, specimen=TwistedBeam(twist=math.radians(phi)), ratio=math.sin(math.radians(phi)) / 2)
        for performer in ("fea", "chain")
        for phi in range(-75, 76, 15)
    ]
    reversals, orbits = orbit_tables(orbit_series(entries), "fea")
    assert "over twist [deg]" in reversals.header[2]
    assert reversals.rows[1][2:] == ("- to 0, then +", "0", "0", "0", "0", "11 of 11", "10 of 10", "-75 to 75")
    assert orbits.detail
    assert orbits.rows[0][0] == "-75"


def test_reversals_are_told_to_a_thousandth_of_the_range(orbit):
    series = sweep(orbit, fea=[0.5, 0.3, -0.6, 0.00201], chain=[0.5, 0.3, -0.60003, 0.00201])
    chain = orbit_tables([series], "fea")[0].rows[1]
    assert chain[2] == "+ to 2.333, - to 3.997, then +"
    assert chain[4] == "0"


def test_a_series_without_the_reference_has_no_table(orbit):
    assert orbit_tables(orbit_series([orbit("chain"), orbit("five")]), "fea") == []
