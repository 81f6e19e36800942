import csv
import math

import numpy as np
import pytest

from lab.beam_theory import natural_modes
from lab.experiments import KPRIME_ENTRIES, NaturalModes, StaticStiffness
from lab.records import Channel, Record, Scalar, channels
from lab.specimens import TwistedBeam
from results.accuracy import Entry
from results.figures.modes import modes_over_twist
from results.figures.stiffness import Measured, stiffness_over_twist


def written(path):
    assert path.read_bytes()[:4] == b"\x89PNG"
    with open(path.with_suffix(".csv"), encoding="utf-8", newline="") as handle:
        return list(csv.DictReader(handle))


def entry(performer, specimen, experiment, found, status="completed"):
    origin = "fea" if performer == "fea" else "prb"
    record = Record(
        origin, performer, specimen.model_dump(mode="json"), experiment.model_dump(mode="json"), channels(*found),
        status=status,
    )  # fmt: skip
    slug = f"twist={math.degrees(specimen.twist):g}deg"
    return Entry("campaign", performer, slug, "beam", experiment, record, "x")


def modes(performer, degrees, frequencies):
    """First mode is bending, the second turns the tip, the third stretches."""
    tip = np.zeros((len(frequencies), 6))
    for mode, dof in zip(range(len(frequencies)), (1, 3, 0), strict=False):
        tip[mode, dof] = 1.0 if dof != 3 else 1e3
    found = (
        Channel("mode", "1", np.arange(1, len(frequencies) + 1), ("mode",)),
        Channel("frequency", "Hz", np.array(frequencies), ("mode",)),
        Channel("tip", "m, rad", tip, ("mode", "dof")),
    )
    return entry(performer, TwistedBeam(twist=math.radians(degrees)), NaturalModes(count=3), found)


def test_modes_stand_beside_beam_theory_of_their_own_beam(tmp_path):
    entries = [modes("fea", degrees, (28.0, 120.0, 600.0)) for degrees in (0, 45, 90)]
    entries.append(modes("five-hinge", 90, (40.0, 85.0)))
    rows = written(modes_over_twist(entries, "modes", tmp_path / "modes.png"))
    assert [row["kind"] for row in rows[:3]] == ["bending", "torsion", "stretch"]
    assert [row["mode"] for row in rows if row["performer"] == "five-hinge"] == ["1", "2"]
    for row in rows:
        beam = TwistedBeam(twist=math.radians(float(row["twist_deg"])))
        own = natural_modes(beam, int(row["mode"]))[-1].frequency
        assert float(row["theory_hz"]) == pytest.approx(own, rel=1e-5)


def stiffness(performer, degrees, k, root_angle=0.0, status="completed"):
    """Reactions ``k`` (3, 3) times the motion along y, z and about x."""
    experiment = StaticStiffness(increments=2)
    leg, motion = [], []
    for number, (dof, end) in enumerate(experiment.legs()):
        for share in (0.5, 1.0):
            leg.append(number)
            motion.append(np.eye(6)[dof] * end * share)
    motion = np.array(motion)
    wrench = np.zeros_like(motion)
    wrench[:, 1:4] = motion[:, 1:4] @ np.array(k).T
    found = (
        Channel("increment", "1", np.arange(len(leg)), ("increment",)),
        Channel("leg", "1", np.array(leg), ("increment",)),
        Channel("motion", "m, rad", motion, ("increment", "dof")),
        Channel("wrench", "N, N*m", wrench, ("increment", "dof")),
    )
    beam = TwistedBeam(twist=math.radians(degrees), root_angle=root_angle)
    return entry(performer, beam, experiment, found if status == "completed" else (), status)


K = [[1000.0, 300.0, 0.0], [400.0, 200.0, 0.0], [0.0, 0.0, 0.1]]


def test_stiffness_lies_over_the_twist_with_the_measured_rows(tmp_path):
    entries = [stiffness("fea", degrees, K) for degrees in (90, -90, 0, 45)]
    entries += [stiffness("fea", 45, np.multiply(K, 2.0), root_angle=math.pi / 2)]
    entries += [stiffness("five-hinge", 0, K, status="unsupported")]
    values = {name: Scalar(5.0 * number, unit) for number, (name, unit) in enumerate(KPRIME_ENTRIES)}
    rows = written(
        stiffness_over_twist(
            entries, [Measured("table-5-1", -45.0, math.pi / 4, math.pi / 2, values)], "K'", tmp_path / "k.png"
        )
    )
    of = {name: [row for row in rows if row["entry"] == name] for name in ("k_yy", "k_zy", "n_xx")}
    straight = [row for row in of["k_zy"] if row["origin"] == "fea" and row["root_angle_deg"] == "0"]
    assert [float(row["twist_deg"]) for row in straight] == [-90, 0, 45, 90]
    assert {float(row["value"]) for row in straight} == {400.0}
    (turned,) = [row for row in of["k_yy"] if row["origin"] == "fea" and row["root_angle_deg"] == "90"]
    assert float(turned["value"]) == pytest.approx(2000.0)
    (measured,) = [row for row in of["n_xx"] if row["origin"] == "lab"]
    assert (measured["twist_deg"], measured["root_angle_deg"], measured["value"]) == ("45", "90", "40")
    assert measured["note"] == "published phi -45"
    assert "five-hinge" not in {row["source"] for row in rows}
