"""Records that a fit may follow, and those that it may not."""

import dataclasses

import numpy as np
import pytest

from calibrate.spec import DataSpec
from calibrate.targets import target
from lab.experiments import NaturalModes, RingDown, StaticStiffness
from lab.records import Channel, Record, channels
from lab.specimens import TwistedBeam

BEAM, RING = TwistedBeam(), RingDown(duration=0.1)


def data(**more) -> DataSpec:
    return DataSpec(campaign="c", reference="lab", used=["a"], **more)


def with_markers(record, values, time=None):
    markers, clock = record.channels["markers"], record.channels["time"]
    changed = {
        "markers": dataclasses.replace(markers, values=values),
        "time": dataclasses.replace(clock, values=clock.values if time is None else time),
    }
    return dataclasses.replace(record, channels={**record.channels, **changed})


def test_defaults_follow_the_experiment(bench):
    assert bench.target("a", RING).quantities == ("markers",)
    assert bench.target("a", StaticStiffness()).quantities == ("k_yy", "k_yz", "k_zy", "k_zz", "n_xx")


def modes(*frequencies):
    tip = Channel("tip", "m, rad", np.ones((len(frequencies), 6)), ("mode", "dof"))
    found = channels(Channel("frequency", "Hz", np.array(frequencies), ("mode",)), tip)
    return Record("fea", "shell", BEAM.model_dump(mode="json"), {"kind": "NaturalModes"}, found)


def test_natural_modes_are_followed_by_their_frequencies():
    found = target("a", BEAM, NaturalModes(count=6), modes(30.0, 90.0, 200.0), data())
    assert {name: scalar.value for name, scalar in found.scalars().items()} == {"f_1": 30.0, "f_2": 90.0, "f_3": 200.0}
    assert not found.channels
    first = target("a", BEAM, NaturalModes(), modes(30.0, 90.0), data(quantities=["f_1"]))
    assert list(first.scalars()) == ["f_1"]


@pytest.mark.parametrize("channel", ["frequency", "tip"])
def test_channels_of_natural_modes_are_not_followed(channel):
    message = rf"record a \(fea, shell\): of natural modes the numbers f_1, f_2, ... are followed, not {channel}$"
    with pytest.raises(ValueError, match=message):
        target("a", BEAM, NaturalModes(), modes(30.0, 90.0), data(quantities=["f_1", channel]))


def test_numbers_are_reduced_or_taken_from_the_record(bench):
    found = bench.target("a", StaticStiffness()).scalars()
    assert found["k_yy"].value == pytest.approx(150.0)
    assert found["n_xx"].value == pytest.approx(0.012)


def test_a_failed_record_is_refused(bench):
    broken = dataclasses.replace(bench.record(RING), status="diverged", reason="it fell off")
    with pytest.raises(ValueError, match=r"^record a \(virtual-lab, oscillator\): it is diverged: it fell off$"):
        target("a", BEAM, RING, broken, data())


def test_another_experiment_is_refused(bench):
    with pytest.raises(ValueError, match="it is a RingDown, not a StaticStiffness"):
        target("a", BEAM, StaticStiffness(), bench.record(RING), data())


def test_holes_and_shapes_are_named(bench):
    record = bench.record(RING)
    holed = record["markers"].copy()
    holed[7:9, 1, 2] = np.nan
    with pytest.raises(ValueError, match=r"markers has no value in sample 7 \(and 1 more\)"):
        target("a", BEAM, RING, with_markers(record, holed), data())
    with pytest.raises(ValueError, match=r"markers have the shape \(37, 2, 3\); the experiment says \(samples, 3, 3\)"):
        target("a", BEAM, RING, with_markers(record, record["markers"][:, :2]), data())
    backwards = record["time"].copy()
    backwards[5] = 0.0
    with pytest.raises(ValueError, match="time must rise over the 37 samples of markers"):
        target("a", BEAM, RING, with_markers(record, record["markers"], backwards), data())


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"quantities": ["strain"]}, "no quantity 'strain'; it has time, markers, release_y"),
        ({"quantities": ["frequency"], "nuisances": {"offset": None}}, "nuisance offset needs a channel"),
        ({"window": (0.2, 0.3)}, "window 0.2 s to 0.3 s holds 0 samples; the record runs from 0 s to 0.1 s"),
    ],
)
def test_what_a_record_cannot_give_is_refused(bench, changes, message):
    with pytest.raises(ValueError, match=message):
        target("a", BEAM, RING, bench.record(RING), data(**changes))


def test_a_static_record_has_no_window(bench):
    with pytest.raises(ValueError, match="a window needs the channel time"):
        target("a", BEAM, StaticStiffness(), bench.record(StaticStiffness()), data(window=(0.0, 1.0)))
