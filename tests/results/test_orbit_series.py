import math
from dataclasses import replace

import numpy as np
import pytest

from lab.experiments import RingDown
from lab.specimens import TwistedBeam
from lab.specimens.load_frame import LoadFrame
from results.orbit_series import orbit_series


def beam(degrees, **more):
    return TwistedBeam(twist=math.radians(degrees), **more)


def test_two_twists_over_frequency_are_two_series_in_ascending_order(orbit):
    entries = [
        orbit(performer, specimen=beam(phi), frequency=f, major=1e-3 * f)
        for performer in ("fea", "chain")
        for phi in (90, -90)
        for f in (30.0, 10.0, 20.0)
    ]
    right, left = orbit_series(entries)
    assert (right.label, left.label) == ("twist 90 deg", "twist -90 deg")
    assert right.title == "shake, twist 90 deg"
    assert right.axis == "frequency [Hz]"
    assert right.performers == ("fea", "chain")
    assert right.text(10.0) == "10 Hz"
    track = left.track("chain")
    np.testing.assert_array_equal(track.values, [10, 20, 30])
    np.testing.assert_allclose(track.major, [0.01, 0.02, 0.03])
    assert [entry.experiment.frequency for entry in track.entries] == [10, 20, 30]
    assert {entry.record.specimen["twist"] for entry in track.entries} == {-math.pi / 2}


def test_numbers_of_the_orbits(orbit):
    (series,) = orbit_series([orbit(frequency=f, major=6e-3, ratio=-0.25, tilt=0.3) for f in (1.0, 2.0)])
    (track,) = series.tracks
    np.testing.assert_allclose(track.major, 6e-3)
    np.testing.assert_allclose(track.minor, 1.5e-3)
    np.testing.assert_allclose(track.axis_ratio, -0.25)
    np.testing.assert_allclose(track.tilt, 0.3)
    # Extent of a turned ellipse: twice the root of (a cos)^2 + (b sin)^2, up to 64 samples.
    np.testing.assert_allclose(track.span_y, 2 * np.hypot(3e-3 * np.cos(0.3), 0.75e-3 * np.sin(0.3)), rtol=3e-3)
    np.testing.assert_allclose(track.span_z, 2 * np.hypot(3e-3 * np.sin(0.3), 0.75e-3 * np.cos(0.3)), rtol=3e-3)


def test_twist_is_swept_where_the_frequency_is_not(orbit):
    (series,) = orbit_series([orbit(specimen=beam(phi), frequency=15.0) for phi in (90, 0, -180)])
    assert series.swept == "specimen.twist"
    assert series.label == "15 Hz"
    np.testing.assert_allclose(series.shown(series.values), [-180, 0, 90])
    assert series.text(series.values[0]) == "-180 deg"


def test_any_other_number_may_be_swept(orbit):
    (series,) = orbit_series([orbit(amplitude=a, slug=f"amplitude={a}") for a in (2e-3, 1e-3)])
    assert series.axis == "amplitude [mm]"
    assert series.label == "twist 90 deg, 15 Hz"
    loads = [beam(90, load_frame=LoadFrame(load=load)) for load in (0.01, 0.02)]
    (series,) = orbit_series([orbit(specimen=b, slug=f"load={i}") for i, b in enumerate(loads)])
    assert series.axis == "load [g]"


def test_corners_tell_series_apart(orbit):
    entries = [
        orbit(specimen=beam(phi, load_frame=frame), frequency=f, slug=f"{phi} {frame and frame.corner} {f}")
        for phi in (90, -90)
        for frame in (LoadFrame(corner="lower-left"), LoadFrame(corner="upper-right"), None)
        for f in (1.0, 2.0)
    ]
    assert [series.label for series in orbit_series(entries)] == [
        "twist 90 deg, lower-left", "twist 90 deg, upper-right", "twist 90 deg, no load frame",
        "twist -90 deg, lower-left", "twist -90 deg, upper-right", "twist -90 deg, no load frame",
    ]  # fmt: skip


def test_a_union_of_sweeps_is_series_of_each_and_shares_samples(orbit):
    points = [(90, 10.0), (90, 15.0), (90, 20.0), (0, 15.0), (45, 15.0)]
    over_frequency, over_twist = orbit_series([orbit(specimen=beam(phi), frequency=f) for phi, f in points])
    assert (over_frequency.label, over_twist.label) == ("twist 90 deg", "15 Hz")
    np.testing.assert_array_equal(over_frequency.values, [10, 15, 20])
    np.testing.assert_allclose(over_twist.shown(over_twist.values), [0, 45, 90])


def test_settings_of_the_performer_tell_series_apart(orbit):
    entries = [
        orbit(frequency=f, slug=f"time_step={step}_frequency={f:g}Hz") for step in ("0.1ms", "1ms") for f in (1.0, 2.0)
    ]
    labels = [series.label for series in orbit_series(entries)]
    assert labels == ["twist 90 deg, time step 0.1ms", "twist 90 deg, time step 1ms"]


def test_what_a_fit_changes_in_the_specimen_is_no_sweep(orbit):
    stiff = TwistedBeam().material.model_copy(update={"youngs_modulus": 48e6})
    entries = [orbit(frequency=f) for f in (1.0, 2.0)]
    entries += [orbit("fitted", specimen=TwistedBeam(material=stiff), frequency=f) for f in (1.0, 2.0)]
    (series,) = orbit_series(entries)
    assert series.performers == ("fea", "fitted")


def test_samples_without_a_result_keep_their_place(orbit):
    (series,) = orbit_series(
        [orbit(frequency=f, status="diverged" if f == 2.0 else "completed") for f in (1.0, 2.0, 3.0)]
    )
    (track,) = series.tracks
    np.testing.assert_array_equal(np.isnan(track.axis_ratio), [False, True, False])
    assert track.place(2.0) == 1
    assert track.place(2.5) is None


def test_one_sample_is_a_series_of_one_and_other_experiments_are_none(orbit):
    entry = orbit(slug="single")
    (series,) = orbit_series([entry, replace(entry, campaign="ring-down", experiment=RingDown())])
    assert series.label == "twist 90 deg"
    assert series.values == pytest.approx([15.0])


def test_performers_need_not_have_the_same_samples(orbit):
    entries = [orbit(frequency=f) for f in (1.0, 2.0)] + [orbit("chain", frequency=f) for f in (2.0, 3.0)]
    (series,) = orbit_series(entries)
    np.testing.assert_array_equal(series.values, [1, 2, 3])
    np.testing.assert_array_equal(series.track("chain").values, [2, 3])
    assert series.track("five") is None
