"""What a sensor does to a signal: a clock that runs late, a gain, an offset, a test that was not quite as written."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.space import Coordinate
from calibrate.spec import EXPERIMENT_PREFIX, Bounds, DataSpec
from lab.experiments import Experiment, RingDown
from lab.fields import number_at, quantity_of, with_numbers
from lab.units import to_si

Array = NDArray[np.float64]
#: A run that is read between its samples is sampled this much more densely: cubic interpolation at 360 Hz then
#: costs less than 0.01 % of a 60 Hz motion.
_DENSER = 4
#: Share of a sampling interval by which times may miss the model's own samples and still count as them.
_ON_SAMPLE = 1e-4
#: Usual bounds: the clock by some camera frames, a gain by a quarter, places by 5 mm, angles by 10 degrees, other
#: numbers by a factor of 2.
_FRAMES, _GAIN, _PLACE, _ANGLE = 3.0, (0.8, 1.25), 5e-3, math.radians(10.0)


def nuisance_coordinates(name: str, experiment: Experiment, data: DataSpec) -> dict[str, Coordinate]:
    """Sensor numbers of one record, by nuisance.

    Parameters
    ----------
    name
        Of the record.

    Raises
    ------
    ValueError
        In one line, for a nuisance that the experiment does not have, or bounds that cannot be.
    """
    found = {}
    for nuisance, bounds in data.nuisances.items():
        owner = f"{data.campaign}/{data.reference}" if nuisance in data.shared else name
        coordinate = _usual(nuisance, experiment)
        found[nuisance] = Coordinate(f"{owner}: {nuisance}", *coordinate[:2], *_bounds(nuisance, coordinate, bounds))
    return found


_Usual = tuple[str, str, float, tuple[float, float] | None]


def _usual(nuisance: str, experiment: Experiment) -> _Usual:
    """Unit, shown unit, nominal value and usual bounds of a nuisance."""
    if nuisance == "release_time":
        if not isinstance(experiment, RingDown):
            raise ValueError(f"nuisance release_time needs a record with a release, not {experiment.kind}")
        late = _FRAMES / experiment.rate
        return "s", "ms", 0.0, (-late, late)
    if nuisance == "offset":
        return "m", "mm", 0.0, (-math.inf, math.inf)
    if nuisance == "gain":
        return "1", "1", 1.0, _GAIN
    path = nuisance.removeprefix(EXPERIMENT_PREFIX)
    value, unit = number_at(experiment, path)
    quantity = quantity_of(type(experiment), path.split(".")[0])
    shown_in = quantity.shown_in if quantity else unit
    if unit in ("m", "rad"):
        spread = _PLACE if unit == "m" else _ANGLE
        return unit, shown_in, value, (value - spread, value + spread)
    return unit, shown_in, value, (value / 2.0, value * 2.0) if value > 0.0 else None


def _bounds(nuisance: str, usual: _Usual, written: Bounds | None) -> tuple[float, float, float]:
    """Nominal value inside the bounds, and the bounds, SI."""
    unit, _, nominal, pair = usual
    if written is not None:
        try:
            low, high = (to_si(b, unit) if isinstance(b, str) else float(b) for b in written)
        except ValueError as error:
            raise ValueError(f"bounds of nuisance {nuisance}: {error}") from None
        pair = (low, high)
    if pair is None:
        raise ValueError(f"nuisance {nuisance} needs bounds: its value is {nominal:g} {unit}")
    if not pair[0] < pair[1]:
        raise ValueError(f"bounds of nuisance {nuisance}: {pair[0]:g} {unit} is not below {pair[1]:g} {unit}")
    return min(max(nominal, pair[0]), pair[1]), *pair


def experiment_with(experiment: Experiment, numbers: Mapping[str, float]) -> Experiment:
    """The experiment with the nuisances ``experiment.PATH`` of ``numbers`` put in, SI."""
    changes = {
        name.removeprefix(EXPERIMENT_PREFIX): value
        for name, value in numbers.items()
        if name.startswith(EXPERIMENT_PREFIX)
    }
    return with_numbers(experiment, changes) if changes else experiment


@dataclass(frozen=True)
class Clock:
    """Reads a model's run at the times of a record.

    Before its release, a model rests at its start.

    Parameters
    ----------
    experiment
        The run to ask for: long enough, and dense where it is read between its samples.
    places
        Samples of the run, (n,), where the record's clock falls on them; None: interpolated.
    times
        Of the record, (n,), s; 0 is the release as the record has it.
    """

    experiment: Experiment
    places: NDArray[np.int64] | None
    times: Array

    def read(self, time: Array, values: Array, release_time: float = 0.0) -> Array:
        """Values of a run (samples, ...) at the record's times, the model being released at ``release_time`` (s)."""
        if self.places is not None:
            return np.asarray(values[self.places])
        from scipy.interpolate import CubicSpline

        at_rest = np.zeros(values.shape[1:])
        # Released from rest: the slope at the start is zero, and so is all motion before.
        spline = CubicSpline(time, values, bc_type=((1, at_rest), "not-a-knot"))
        return np.asarray(spline(np.clip(self.times - release_time, 0.0, time[-1])))


def clock(experiment: RingDown, times: Array, release: Coordinate | None = None) -> Clock:
    """Clock of a release that was recorded at ``times``, (n,), s.

    Parameters
    ----------
    release
        The release time, where it is searched.
    """
    if release is None:
        exact = times * experiment.rate
        nearest = np.maximum(np.rint(exact), 0.0)
        if np.abs(np.maximum(exact, 0.0) - nearest).max() <= _ON_SAMPLE:
            last = max(int(nearest[-1]), 1)
            run = experiment.model_copy(update={"duration": last / experiment.rate})
            return Clock(run, nearest.astype(np.int64), times)
    rate = _DENSER * experiment.rate
    last_time = float(times[-1]) - (release.lower if release else 0.0)
    samples = max(math.ceil(last_time * rate), 4)
    return Clock(experiment.model_copy(update={"rate": rate, "duration": samples / rate}), None, times)


def without_offset(difference: Array, bounds: tuple[float, float] = (-math.inf, math.inf)) -> tuple[Array, Array]:
    """Differences (..., rows, columns) less the constant per column that makes them smallest, and minus that constant.

    Returns
    -------
    difference
        (..., rows, columns).
    offset
        What the record adds to the truth, (..., columns), inside ``bounds``: each column's best value is its
        mean, and the objective is a parabola about it.
    """
    offset = np.clip(-difference.mean(axis=-2), *bounds)
    return difference + offset[..., None, :], offset
