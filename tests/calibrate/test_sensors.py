"""Clocks, offsets, and numbers of a test that a sensor got wrong."""

import numpy as np
import pytest

from calibrate.sensors import clock, experiment_with, nuisance_coordinates, without_offset
from calibrate.spec import DataSpec
from lab.experiments import BaseShake, RingDown, StaticStiffness

RING = RingDown(duration=0.1, rate=100.0)


def data(nuisances, **more) -> DataSpec:
    return DataSpec(campaign="c", reference="lab", used=["a"], nuisances=nuisances, **more)


def test_usual_bounds():
    found = nuisance_coordinates(
        "a", RING, data(dict.fromkeys(["release_time", "offset", "gain", "experiment.load_mass"]))
    )
    assert found["release_time"].name == "a: release_time"
    assert (found["release_time"].lower, found["release_time"].upper) == pytest.approx((-0.03, 0.03))
    assert (found["gain"].lower, found["gain"].upper) == (0.8, 1.25)
    assert (found["experiment.load_mass"].lower, found["experiment.load_mass"].upper) == pytest.approx((0.1, 0.4))
    place = nuisance_coordinates("a", RING, data({"experiment.markers.1.2": None}))["experiment.markers.1.2"]
    assert (place.lower, place.nominal, place.upper, place.unit) == pytest.approx((-0.005, 0.0, 0.005, "m"))


def test_shared_nuisances_have_one_name():
    spec = data({"experiment.load_mass": ("190 g", "210 g")}, shared=["experiment.load_mass"])
    names = {nuisance_coordinates(name, RING, spec)["experiment.load_mass"].name for name in "ab"}
    assert names == {"c/lab: experiment.load_mass"}


@pytest.mark.parametrize(
    ("experiment", "nuisances", "message"),
    [
        (StaticStiffness(), {"release_time": None}, "needs a record with a release, not StaticStiffness"),
        (BaseShake(), {"release_time": None}, "needs a record with a release, not BaseShake"),
        (RING, {"experiment.mass": None}, "RingDown has no number 'mass'"),
        (StaticStiffness(), {"experiment.rig_stiffness": None}, "is None, not a number"),
        (RING, {"gain": (1.1, 0.9)}, "bounds of nuisance gain: 1.1 1 is not below 0.9 1"),
        (RING, {"offset": ("1 s", "2 s")}, "bounds of nuisance offset: '1 s' has the unit second; expected one like m"),
    ],
)
def test_wrong_nuisances_are_refused(experiment, nuisances, message):
    with pytest.raises(ValueError, match=message.replace("'", ".")):
        nuisance_coordinates("a", experiment, data(nuisances))


def test_numbers_of_the_experiment_are_put_in():
    found = experiment_with(RING, {"gain": 1.1, "experiment.load_mass": 0.3, "experiment.markers.0.1": 0.011})
    assert found.load_mass == 0.3
    assert found.markers[0] == (0.0, 0.011, 0.0)
    assert experiment_with(RING, {"gain": 1.1}) is RING


def test_a_clock_on_the_samples_reads_them_as_they_are():
    times = np.array([-0.01, 0.0, 0.02, 0.05])
    reading = clock(RING, times)
    assert reading.experiment.samples == 6
    values = np.random.default_rng(0).random((6, 2))
    assert np.array_equal(reading.read(np.arange(6) / 100, values), values[[0, 0, 2, 5]])


def test_a_late_clock_is_read_between_the_samples():
    release = nuisance_coordinates("a", RING, data({"release_time": None}))["release_time"]
    times, late = np.arange(11) / 100, 0.0137
    reading = clock(RING, times, release)
    dense = np.arange(reading.experiment.samples) / reading.experiment.rate
    assert dense[-1] >= times[-1] - release.lower - 1e-12

    def swing(t):
        return np.where(
            t > 0, np.cos(2 * np.pi * 15 * t) * np.exp(-5 * t) + 5 / 94 * np.sin(94 * t) * np.exp(-5 * t), 1.0
        )

    found = reading.read(dense, swing(dense)[:, None], late)
    assert found[:, 0] == pytest.approx(swing(times - late), abs=2e-4)
    assert found[:2, 0].tolist() == [1.0, 1.0]


def test_an_offset_takes_the_mean_out_within_its_bounds():
    rng = np.random.default_rng(1)
    difference = rng.random((5, 20, 3))
    left, offset = without_offset(difference)
    assert np.abs(left.mean(axis=1)).max() < 1e-15
    assert offset == pytest.approx(-difference.mean(axis=1))
    left, offset = without_offset(difference, (-0.1, 0.1))
    assert np.all(offset == -0.1)
    assert left == pytest.approx(difference - 0.1)
