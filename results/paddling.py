"""What the text publishes of paddling, and which of our records stand for it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lab.experiments import PaddleThrust
from lab.published import figures
from lab.specimens import FinnedTube
from results.accuracy import Entry
from results.fins import PSI, is_prototype
from results.slugs import words

#: Density of water, kg/m^3, for what follows from the text alone.
_WATER = 1000.0
#: What the text measured and computed, by whether the load fin is on: number to published figure.
LAB = {
    False: {
        "thrust_max": "c4-thrust-max-nofin", "thrust_min": "c4-thrust-min-nofin", "thrust_mean": "c4-thrust-net-nofin",
        "tip_speed_mean_power": "c4-u-tpe-power", "tip_speed_mean_recovery": "c4-u-tpe-recovery",
    },
    True: {
        "thrust_max": "c4-thrust-max-fin", "thrust_min": "c4-thrust-min-fin", "thrust_mean": "c4-thrust-net-fin",
        "tip_speed_mean_power": "c4-u-loadfin-power", "tip_speed_mean_recovery": "c4-u-loadfin-recovery",
        "swim_speed": "c4-swim-speed",
    },
}  # fmt: skip
DISSERTATION = {
    False: {"thrust_max": "c4-sim-max-nofin", "thrust_min": "c4-sim-min-nofin"},
    True: {"thrust_max": "c4-sim-max-fin", "thrust_min": "c4-sim-min-fin"},
}
#: What a fit that searched numbers for the published thrust has seen: ``(PUBLISHED, "lab" or "model", THRUST)``.
PUBLISHED, THRUST = "published", "thrust"
#: Law of water of 4.5.3, which is what a record has that says nothing of it.
PLATE = "plate"
CASES = {False: "without load fin", True: "with load fin"}


def published(of: dict[bool, dict[str, str]], load_fin: bool, name: str) -> float:
    """A published number, SI; NaN where the text has none."""
    id = of[load_fin].get(name)
    return float(figures()[id]["value"]) if id else math.nan


def carries(entry: Entry) -> bool:
    """Whether a record is of a device with a load fin."""
    return entry.record.specimen.get("load_fin") is not None


def law_of_water(entry: Entry) -> str:
    """Of a record: ``PLATE``, one of a simulator's own, or none."""
    return str(entry.record.how.get("water", PLATE))


def saw_thrust(entry: Entry, name: str) -> bool:
    """Whether the fit behind a record was given the published figure that a reduced number is compared with."""
    return name.startswith("thrust_") and any(s[0] == PUBLISHED and s[2] == THRUST for s in entry.seen or ())


def as_published(entry: Entry) -> bool:
    """Whether a record is of the prototype paddling as in 4.5.2, nothing changed but the state of the body."""
    experiment = entry.experiment
    if not isinstance(experiment, PaddleThrust) or not is_prototype(entry.record.specimen):
        return False
    if law_of_water(entry) != PLATE:
        return False
    frequency, pressure = (float(figures()[id]["value"]) for id in ("c4-thrust-freq", "c4-thrust-pressure"))
    return (
        math.isclose(experiment.frequency, frequency)
        and math.isclose(experiment.pressure, pressure * PSI, rel_tol=1e-3)
        and not words(entry.slug).keys() - {"body"}
    )


def standing_for(entries: Sequence[Entry], body: str, load_fin: bool) -> list[Entry]:
    """The first record of every performer that is as published, with this state of the body."""
    found: dict[str, Entry] = {}
    for entry in entries:
        if as_published(entry) and carries(entry) is load_fin and getattr(entry.experiment, "body", "") == body:
            found.setdefault(entry.performer, entry)
    return list(found.values())


@dataclass(frozen=True)
class PlateLaw:
    """Eq. 4.3 for both fins at once, each a flat plate that moves with one speed across itself: the most it can give.

    Parameters
    ----------
    area
        Of one fin with what it carries, m^2.
    chord
        Length from the crease to the end, m.
    density
        kg/m^3.
    """

    area: float
    chord: float
    density: float = _WATER

    @classmethod
    def of(cls, device: FinnedTube) -> "PlateLaw":
        """Of a device: the fin as broad as its arc's chord, and the load fin beyond."""
        breadth = 2 * device.mid_radius * math.sin(device.fin_arc / 2)
        area, chord = breadth * device.fin_length, device.fin_length
        if device.load_fin is not None:
            area, chord = area + device.load_fin.width * device.load_fin.length, chord + device.load_fin.length
        return cls(area, chord)

    def force(self, speed: float) -> float:
        """Of both fins, N."""
        return 2 * self.density * self.area * speed**2

    def speed(self, force: float) -> float:
        """At which both fins together take ``force``, m/s."""
        return math.sqrt(abs(force) / (2 * self.density * self.area))

    def reynolds(self, speed: float) -> float:
        """Number of a plate of this chord in water of 1e-6 m^2/s."""
        return speed * self.chord / 1e-6


def peak_speed(entry: Entry) -> float:
    """Largest speed of the tip, m/s; NaN without a result."""
    numbers = entry.scalars()
    return numbers["tip_speed_max"].value if "tip_speed_max" in numbers else math.nan


def kept(entry: Entry) -> np.ndarray:
    """Places of the samples in whole cycles after the warm-up."""
    experiment, time = entry.experiment, entry.record["time"]
    assert isinstance(experiment, PaddleThrust)
    return np.flatnonzero(time > (experiment.warm_up - 1e-9) / experiment.frequency)
