"""``study.h5``: what several samples of a campaign look like side by side."""

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

from lab.experiments import NaturalModes, Pinch
from lab.records import Channel, Record, channels
from lab.specimens import PinchedTube, TwistedBeam
from results.accuracy import Entry
from results.collection import read_study, write_study


@pytest.fixture
def written(tmp_path):
    """Campaign of a study with these entries, read back."""

    def write(campaign, entries):
        placed = []
        for number, entry in enumerate(entries):
            path = tmp_path / f"{number}.vtkhdf"
            path.write_bytes(b"a record")
            placed.append(replace(entry, path=path.name))
        write_study(tmp_path / "study.h5", placed, {}, {}, {"study": "a study"})
        with xr.open_dataset(tmp_path / "study.h5", engine="h5netcdf", group=f"campaigns/{campaign}") as found:
            return read_study(tmp_path / "study.h5"), found.load()

    return write


def modes(performer, *frequencies, status="completed"):
    specimen, experiment, count = TwistedBeam(twist=0.0), NaturalModes(count=6), len(frequencies)
    found = channels(
        Channel("mode", "1", np.arange(1, count + 1), ("mode",), "number of the mode"),
        Channel("frequency", "Hz", np.array(frequencies), ("mode",), "natural frequency"),
        Channel("tip", "m, rad", np.ones((count, 6)), ("mode", "dof")),
    )
    record = Record("prb", performer, specimen.model_dump(mode="json"), {"kind": experiment.kind}, found, status=status)
    return Entry("modes", performer, "twist=0deg", "beam", experiment, record, "")


def test_samples_with_fewer_modes_are_padded(written):
    failed = modes("chain", status="failed")
    summary, campaign = written("modes", [modes("five", 20.0, 90.0), modes("fea", 19.0, 80.0, 150.0), failed])
    np.testing.assert_array_equal(
        campaign["frequency"], [[20.0, 90.0, np.nan], [19.0, 80.0, 150.0], [np.nan, np.nan, np.nan]]
    )
    np.testing.assert_array_equal(campaign["mode"], [1, 2, 3])
    assert campaign["frequency"].attrs == {"units": "Hz", "long_name": "natural frequency"}
    np.testing.assert_array_equal(summary["f_3"], [np.nan, 150.0, np.nan])


def test_a_campaign_without_a_result_has_no_arrays(written):
    _, campaign = written("modes", [modes("five", status="failed")])
    assert not campaign.data_vars


def test_a_time_that_all_samples_share_is_their_coordinate(orbit, written):
    _, campaign = written("shake", [orbit("fea", frequency=15.0), orbit("chain", frequency=15.0, major=1e-3)])
    np.testing.assert_allclose(campaign["time"], np.linspace(0.0, 1 / 15, 65))
    assert campaign["markers"].shape == (2, 65, 1, 3)
    assert campaign["time"].attrs["units"] == "s"


def test_shakes_of_two_frequencies_share_no_time(orbit, written):
    slow, fast = orbit(frequency=5.0), orbit(frequency=10.0, samples_per_period=48)
    _, campaign = written("shake", [slow, fast])
    assert "time" not in campaign.coords
    assert campaign["markers"].shape == (2, 65, 1, 3)
    np.testing.assert_array_equal(campaign["markers"][1, :49], fast.record["markers"])
    assert np.isnan(campaign["markers"][1, 49:]).all()


def test_forces_and_travels_of_a_pinch_stand_side_by_side(written):
    def pinch(performer, *forces):
        specimen, experiment, states = PinchedTube(), Pinch(), np.arange(len(forces))
        found = channels(
            Channel("increment", "1", states, ("increment",)),
            Channel("travel", "m", 1e-3 * states, ("increment",)),
            Channel("force", "N", np.array(forces), ("increment",)),
        )
        about = (specimen.model_dump(mode="json"), experiment.model_dump(mode="json"))
        return Entry("pinches", performer, "single", "tube", Unreduced(), Record("fea", performer, *about, found), "")

    class Unreduced(Pinch):
        def reduce(self, record):
            return {}

    _, campaign = written("pinches", [pinch("fea", 0.0, 1.0, 2.0), pinch("hinge", 0.0, 1.5)])
    np.testing.assert_array_equal(campaign["force"], [[0, 1, 2], [0, 1.5, np.nan]])
    np.testing.assert_array_equal(campaign["increment"], [0, 1, 2])
