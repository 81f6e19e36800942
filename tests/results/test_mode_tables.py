import math

import numpy as np
import pytest

from lab.beam_theory import natural_modes
from lab.experiments import NaturalModes
from lab.records import Channel, Record, channels
from lab.specimens import TwistedBeam
from results.accuracy import Entry, against_record
from results.mode_tables import THEORY, mode_tables, theory_rows

BENDING, TORSION = (0, 0, 1.0, 0, 0, 0), (0, 0, 0, 1e3, 0, 0)


def modes(performer, frequencies, tip, *, specimen=None, status="completed", count=3):
    specimen = specimen or TwistedBeam()
    found = channels(
        Channel("mode", "1", np.arange(1, len(frequencies) + 1), ("mode",)),
        Channel("frequency", "Hz", np.array(frequencies, float), ("mode",)),
        Channel("tip", "m, rad", np.array(tip, float), ("mode", "dof")),
    )
    origin = "fea" if performer == "fea" else "prb"
    experiment = NaturalModes(count=count)
    about = specimen.model_dump(mode="json"), experiment.model_dump(mode="json")
    record = Record(origin, performer, *about, found if status == "completed" else {}, status=status, reason="loose")
    slug = f"twist={np.degrees(specimen.twist):g}deg"
    return Entry("modes", performer, slug, "beam", experiment, record, "x")


def test_frequencies_against_a_performer():
    fea = modes("fea", [20.0, 100.0, 200.0], [BENDING, TORSION, BENDING])
    chain = modes("chain", [21.0, 90.0], [BENDING, BENDING])
    rows = list(against_record(chain, fea))
    assert [row.quantity for row in rows] == ["f_1", "f_2", "f_3"]  # no tracking, no time for 10 s
    assert [row.relative_error for row in rows[:2]] == pytest.approx([0.05, -0.1])
    assert math.isnan(rows[2].value)
    assert rows[2].reference_value == 200.0
    short, long = mode_tables("modes against fea", rows, [fea, chain])
    assert short.rows == (("chain", "prb", "5", "10", "-"),)
    assert long.rows == (
        ("twist=90deg", "fea", "20 b", "100 t", "200 b"),
        ("twist=90deg", "chain", "21 b (+5.0)", "90 b (-10.0)", "-"),
    )
    assert long.detail


def test_errors_over_a_sweep_and_where_they_are_largest():
    pairs = [
        (modes("fea", [20.0], [BENDING], specimen=beam), modes("chain", [20.0 * factor], [BENDING], specimen=beam))
        for beam, factor in ((TwistedBeam(twist=0.0), 1.03), (TwistedBeam(), 0.96))
    ]
    rows = [row for fea, chain in pairs for row in against_record(chain, fea)]
    short, _ = mode_tables("t", rows, [entry for pair in pairs for entry in pair])
    rms = math.sqrt((3.0**2 + 4.0**2) / 2)
    assert short.rows == (("chain", "prb", f"{rms:.2g} (-4 at 90deg)"),)


def test_frequencies_against_beam_theory_for_the_beam_that_was_tested():
    stiff = TwistedBeam(material=TwistedBeam().material.model_copy(update={"youngs_modulus": 4 * 26e6}))
    known = [mode.frequency for mode in natural_modes(TwistedBeam(), 2)]
    entries = [
        modes("fea", np.multiply(known, 1.02), [BENDING, BENDING], count=2),
        # Four times the modulus: twice the frequency, of the theory as well.
        modes("fitted", np.multiply(known, 2.0), [BENDING, BENDING], specimen=stiff, count=2),
    ]
    rows = list(theory_rows(entries))
    assert {(row.reference, row.reference_origin) for row in rows} == {(THEORY, "theory")}
    assert [row.relative_error for row in rows] == pytest.approx([0.02, 0.02, 0.0, 0.0], abs=1e-6)
    _, long = mode_tables("t", rows, entries)
    assert [line[1] for line in long.rows] == ["beam-theory for fea", "beam-theory for fitted", "fea", "fitted"]
    assert long.rows[0][2] == f"{known[0]:.4g} b"


def test_a_mechanism_without_modes_is_not_left_out():
    fea = modes("fea", [20.0], [BENDING])
    loose = modes("loose", [], np.empty((0, 6)), status="unsupported")
    short, long = mode_tables("t", list(against_record(loose, fea)), [fea, loose])
    assert short.rows == (("loose", "prb", "-"),)
    assert long.rows[1] == ("twist=90deg", "loose", "-")
