"""Records of shaken beams with orbits that are known."""

import numpy as np
import pytest

from lab.experiments import BaseShake
from lab.records import Channel, Record, channels
from lab.specimens import TwistedBeam
from results.accuracy import Entry


def _ellipse(shake, major, ratio, tilt, phase):
    turn = 2 * np.pi * shake.frequency * shake.times + phase
    along, across = major / 2 * np.cos(turn), ratio * major / 2 * np.sin(turn)
    return np.stack(
        [np.cos(tilt) * along - np.sin(tilt) * across, np.sin(tilt) * along + np.cos(tilt) * across], axis=1
    )


@pytest.fixture
def orbit():
    """Entry of a beam whose tip travels an ellipse, or a given path of y and z, as seen from the clamp."""

    def make(
        performer="fea", *, specimen=None, major=4e-3, ratio=0.5, tilt=0.3, phase=0.4, path=None, campaign="shake",
        slug=None, status="completed", seen=None, **shake,
    ):  # fmt: skip
        specimen = specimen or TwistedBeam()
        experiment = BaseShake(**{"seen_from": "clamp", **shake})
        plane = _ellipse(experiment, major, ratio, tilt, phase) if path is None else path
        markers = np.concatenate([np.zeros((len(plane), 1)), plane], axis=1)[:, None]
        found = channels(
            Channel("time", "s", experiment.times, ("time",)),
            Channel("markers", "m", markers, ("time", "marker", "axis")),
        )
        origin = "fea" if performer == "fea" else "prb"
        record = Record(
            origin, performer, specimen.model_dump(mode="json"), experiment.model_dump(mode="json"), found,
            how={"wall_time_s": 1.0}, status=status, reason="" if status == "completed" else "not steady",
        )  # fmt: skip
        words = {"twist": f"{np.degrees(specimen.twist):g}deg", "frequency": f"{experiment.frequency:g}Hz"}
        name = slug or "_".join(f"{key}={value}" for key, value in words.items())
        return Entry(campaign, performer, name, "beam", experiment, record, "x", seen)

    return make
