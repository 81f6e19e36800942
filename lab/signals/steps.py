"""The steps that a user may list, as a study writes them; they are carried out in that order and no other."""

from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from lab.experiments import Experiment, RingDown, StaticStiffness
from lab.materials import Frozen
from lab.readers.options import Up
from lab.readers.recording import Recording
from lab.readers.rotations import matrix_of
from lab.signals.forces import move_moments, reversed_wrench, tare
from lab.signals.frames import align, take_rest, turned
from lab.signals.gaps import fill_gaps
from lab.signals.legs import find_legs
from lab.signals.rates import Method, low_pass, resample
from lab.signals.releases import detect_release, release_at
from lab.signals.windows import Window, crop
from lab.units import Quantity

Metre = Annotated[float, Quantity("m", "mm")]
Second = Annotated[float, Quantity("s", "s")]
Hertz = Annotated[float, Quantity("Hz", "Hz"), Field(gt=0)]
Sensors = tuple[Literal["markers", "wrench", "pose"], ...]


class _Windowed(Frozen):
    """A stretch of the record's clock: from ``start`` to ``end``, or its ``first`` or ``last`` so many seconds."""

    start: Second | None = None
    end: Second | None = None
    first: Annotated[float, Quantity("s", "s"), Field(gt=0)] | None = None
    last: Annotated[float, Quantity("s", "s"), Field(gt=0)] | None = None

    @model_validator(mode="after")
    def _is_one_stretch(self) -> Self:
        given = [name for name in ("start", "end", "first", "last") if getattr(self, name) is not None]
        if given not in ([], ["start"], ["end"], ["start", "end"], ["first"], ["last"]):
            raise ValueError(f"{' and '.join(given)} together name no stretch; give start and end, or first, or last")
        if self.start is not None and self.end is not None and self.start >= self.end:
            raise ValueError(f"start {self.start:g} s is not before end {self.end:g} s")
        return self

    @property
    def window(self) -> Window:
        """The stretch."""
        return Window(self.start, self.end, self.first, self.last)

    @property
    def given(self) -> bool:
        """Whether any bound was named."""
        return self.window != Window()


class FillGaps(Frozen):
    """Fill gaps of up to ``limit`` samples by a cubic spline; longer ones are refused."""

    do: Literal["fill-gaps"] = "fill-gaps"
    limit: int = Field(gt=0, description="Most missing samples in a row that may be filled.")

    def apply(self, recording: Recording, experiment: Experiment) -> Recording:
        """The recording without gaps."""
        return fill_gaps(recording, self.limit)


class Resample(Frozen):
    """Other sampling times."""

    do: Literal["resample"] = "resample"
    #: None: the experiment's own samples, from t = 0 on.
    rate: Hertz | None = None
    method: Method = "spline"

    def apply(self, recording: Recording, experiment: Experiment) -> Recording:
        """The recording at other times; at a given rate they are whole numbers of intervals from t = 0."""
        if self.rate is not None:
            begin = np.ceil(recording.time[0] * self.rate - 1e-3)
            end = np.floor(recording.time[-1] * self.rate + 1e-3)
            times = np.arange(begin, end + 1) / self.rate
        elif isinstance(experiment, RingDown):
            times = np.arange(experiment.samples) / experiment.rate
        else:
            raise ValueError(f"resample: {experiment.kind} has no sampling rate; give the step a rate")
        if len(times) < 2:
            raise ValueError(f"{recording.source}: resample: {len(times)} sample would be left")
        return resample(recording, times, self.method)


class MapAxes(Frozen):
    """Our axes in terms of the record's: ``{do: axes, x: -z, y: x, z: -y}``."""

    do: Literal["axes"] = "axes"
    x: Up
    y: Up
    z: Up
    only: Sensors = Field((), description="Sensors that are turned; all by default.")

    @model_validator(mode="after")
    def _is_a_rotation(self) -> Self:
        matrix_of({"x": self.x, "y": self.y, "z": self.z}, "axes")
        return self

    def apply(self, recording: Recording, experiment: Experiment) -> Recording:
        """The recording in our axes."""
        rotation = matrix_of({"x": self.x, "y": self.y, "z": self.z}, recording.source)
        what = f" ({', '.join(self.only)})" if self.only else ""
        sentence = f"axes{what}: our x is the record's {self.x}, y its {self.y}, z its {self.z}"
        return turned(recording, rotation, sentence, self.only)


class Turn(Frozen):
    """Turn the record about an axis, right-handed."""

    do: Literal["turn"] = "turn"
    about: Literal["x", "y", "z"]
    angle: Annotated[float, Quantity("rad", "deg")]
    only: Sensors = Field((), description="Sensors that are turned; all by default.")

    def apply(self, recording: Recording, experiment: Experiment) -> Recording:
        """The turned recording."""
        from scipy.spatial.transform import Rotation

        what = f" ({', '.join(self.only)})" if self.only else ""
        sentence = f"turned{what} by {np.degrees(self.angle):.6g} deg about {self.about}"
        return turned(recording, Rotation.from_euler(self.about, self.angle).as_matrix(), sentence, self.only)


class Align(_Windowed):
    """Bring the markers to where some of them are known to be; averaged over a stretch, by default all."""

    do: Literal["align"] = "align"
    places: dict[str, tuple[Metre, Metre, Metre]] = Field(min_length=3)
    tolerance: Annotated[float, Quantity("m", "mm"), Field(gt=0)] = 0.001

    def apply(self, recording: Recording, experiment: Experiment) -> Recording:
        """The recording in the frame of the known places."""
        places = {name: np.array(place) for name, place in self.places.items()}
        return align(recording, places, self.tolerance, self.window)


class LowPass(Frozen):
    """Zero-phase Butterworth low-pass."""

    do: Literal["low-pass"] = "low-pass"
    cutoff: Hertz
    order: int = Field(4, ge=1, le=10)

    def apply(self, recording: Recording, experiment: Experiment) -> Recording:
        """The smoother recording."""
        return low_pass(recording, self.cutoff, self.order)


class Crop(_Windowed):
    """Keep one stretch."""

    do: Literal["crop"] = "crop"

    @model_validator(mode="after")
    def _keeps_a_part(self) -> Self:
        if not self.given:
            raise ValueError("crop needs start, end, first or last")
        return self

    def apply(self, recording: Recording, experiment: Experiment) -> Recording:
        """The stretch."""
        return crop(recording, self.window)


class Release(_Windowed):
    """Set t = 0 to the release: found where the markers leave the place held in a stretch, or ``at`` a known time."""

    do: Literal["release"] = "release"
    threshold: Annotated[float, Quantity("m", "mm"), Field(gt=0)] | None = None
    markers: tuple[str, ...] = Field((), description="Markers that are watched; all by default.")
    at: Second | None = None
    uncertainty: Annotated[float, Quantity("s", "ms"), Field(ge=0)] = 0.0

    @model_validator(mode="after")
    def _is_found_or_known(self) -> Self:
        if (self.at is None) == (self.threshold is None):
            raise ValueError("release needs either a threshold (and the stretch in which the part is held), or 'at'")
        if self.threshold is not None and not self.given:
            raise ValueError(
                "release with a threshold needs the stretch in which the part is held: first, or start and end"
            )
        return self

    def apply(self, recording: Recording, experiment: Experiment) -> Recording:
        """The recording with its clock set."""
        if self.threshold is None:
            assert self.at is not None
            return release_at(recording, self.at, self.uncertainty)
        return detect_release(recording, self.threshold, self.window, self.markers)


class Rest(_Windowed):
    """Displacements from the mean place over a stretch."""

    do: Literal["rest"] = "rest"

    @model_validator(mode="after")
    def _has_a_stretch(self) -> Self:
        if not self.given:
            raise ValueError("rest needs the stretch over which places are averaged: start and end, first, or last")
        return self

    def apply(self, recording: Recording, experiment: Experiment) -> Recording:
        """Displacements in the place of places."""
        return take_rest(recording, self.window)


class Tare(_Windowed):
    """Take the mean force and moment over a stretch off."""

    do: Literal["tare"] = "tare"

    @model_validator(mode="after")
    def _has_a_stretch(self) -> Self:
        if not self.given:
            raise ValueError("tare needs the stretch without load: start and end, first, or last")
        return self

    def apply(self, recording: Recording, experiment: Experiment) -> Recording:
        """The recording with zeroed forces."""
        return tare(recording, self.window)


class Moments(Frozen):
    """Moments about the tip's centre, which lies at ``to`` from the sensor's origin."""

    do: Literal["moments"] = "moments"
    to: tuple[Metre, Metre, Metre]

    def apply(self, recording: Recording, experiment: Experiment) -> Recording:
        """The recording with moments about the other point."""
        return move_moments(recording, np.array(self.to))


class ReverseWrench(Frozen):
    """Exchange action and reaction, where the sensor tells what the part does to it."""

    do: Literal["reverse-wrench"] = "reverse-wrench"

    def apply(self, recording: Recording, experiment: Experiment) -> Recording:
        """The recording with forces and moments of the other sign."""
        return reversed_wrench(recording)


class Legs(Frozen):
    """Bring the log of a static test to the increments of the experiment's legs."""

    do: Literal["legs"] = "legs"
    window: float = Field(0.1, gt=0, le=0.5, description="Averaged around each increment, as a share of one.")

    def apply(self, recording: Recording, experiment: Experiment) -> Recording:
        """One sample per increment."""
        if not isinstance(experiment, StaticStiffness):
            raise ValueError(f"legs: {experiment.kind} has none")
        return find_legs(recording, experiment, self.window)


Step = Annotated[
    FillGaps
    | Resample
    | MapAxes
    | Turn
    | Align
    | LowPass
    | Crop
    | Release
    | Rest
    | Tare
    | Moments
    | ReverseWrench
    | Legs,
    Field(discriminator="do"),
]
