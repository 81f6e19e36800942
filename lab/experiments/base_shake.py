"""Steady orbit of the tip of a shaken beam (5.4.1)."""

from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from lab.experiments.shaking import SmoothShake
from lab.materials import Frozen
from lab.records import Record, Scalar
from lab.units import Quantity

Array = NDArray[np.float64]
Metre = Annotated[float, Quantity("m", "mm")]

#: An orbit with a smaller ratio of its axes is a line to rounding: it has no sense of travel.
_LINE = 1e-9


class BaseShake(Frozen):
    """The clamp moves along z as A sin(2 pi f t) until the tip repeats its path in every period.

    The amplitude A rises smoothly over the first periods.  The orbit is steady when ``change`` between two whole
    periods at full amplitude falls below ``tolerance``; after ``max_periods``, those of the rise included, a
    performer gives up (status ``diverged``, with the path that it reached).  A transient that shrinks by q in every
    period leaves about change / (1 - q): lightly damped beams want a smaller tolerance.  One frequency is one sample.
    Gravity is left out: the text does not say how the shaker stood.

    Sensed: displacements of the markers relative to the moving clamp over the last period, ``samples_per_period``
    + 1 samples.  Its time 0 is where the clamp passes its middle along +z, so the clamp's place is A sin(2 pi f t).
    Markers ride on the mean rigid motion of the tip face, as in the ring-down.
    """

    kind: Literal["BaseShake"] = "BaseShake"
    in_motion: ClassVar[bool] = True
    frequency: Annotated[float, Quantity("Hz", "Hz"), Field(gt=0)] = 15.0
    amplitude: Annotated[float, Quantity("m", "mm"), Field(gt=0)] = 0.002
    ramp_periods: float = Field(5.0, ge=0, description="Periods within which the amplitude rises; 0: at once.")
    tolerance: float = Field(1e-3, gt=0, lt=1, description="Largest change between periods over the path's size.")
    max_periods: int = Field(200, ge=2, description="Periods after which an orbit counts as unsteady.")
    samples_per_period: int = Field(64, ge=8, le=10_000, description="Samples recorded per period.")
    #: Place of each marker from the tip's centre in the fixed axes of the unloaded beam.
    markers: tuple[tuple[Metre, Metre, Metre], ...] = Field(((0.0, 0.0, 0.0),), min_length=1)

    @model_validator(mode="after")
    def _lets_two_periods_be_compared(self) -> Self:
        if self.max_periods < self.ramp_periods + 2:
            raise ValueError(
                f"max_periods must leave two periods after the rise of {self.ramp_periods:g}: {self.max_periods} is "
                "too few"
            )
        return self

    @property
    def period(self) -> float:
        """Of the clamp's motion, s."""
        return 1.0 / self.frequency

    @property
    def samples(self) -> int:
        """Number of samples in the record, both ends of the period included."""
        return self.samples_per_period + 1

    @property
    def times(self) -> Array:
        """Times of the samples within the last period (samples,), s."""
        return self.period * np.arange(self.samples) / self.samples_per_period

    @property
    def base(self) -> SmoothShake:
        """Motion of the clamp from rest at t = 0."""
        return SmoothShake((0.0, 0.0, self.amplitude), self.frequency, self.ramp_periods * self.period)

    def change(self, before: Array, after: Array) -> float:
        """Largest distance between equal phases of two periods over the largest displacement of the second.

        Parameters
        ----------
        before, after
            Marker displacements over a period each, (samples, markers, 3), m.
        """
        size = float(np.linalg.norm(after, axis=-1).max())
        change = float(np.linalg.norm(after - before, axis=-1).max())
        return change / size if size else float(change > 0.0)

    def reduce(self, record: Record) -> dict[str, Scalar]:
        """Ellipse of the mean marker's path in the y-z plane: that of its first harmonic, by least squares.

        Needs the channels ``time`` (n,) and ``markers`` (n, marker, 3) over a whole period.
        """
        turning = _harmonic(record["time"], record["markers"].mean(axis=1)[:, 1:], self.frequency)
        # y + i z is the sum of two vectors that turn about +x with and against the right hand.
        along, against = (turning[0] + 1j * turning[1]) / 2, (turning[0].conjugate() + 1j * turning[1].conjugate()) / 2
        major, minor = float(abs(along) + abs(against)), float(abs(along) - abs(against))
        tilt = float(np.angle(along) + np.angle(against)) / 2
        sense = float(np.sign(minor)) if abs(minor) > _LINE * major else 0.0
        return {
            "major_axis": Scalar(2 * major, "m", "length of the orbit's major axis"),
            "minor_axis": Scalar(2 * abs(minor), "m", "length of the orbit's minor axis"),
            "tilt": Scalar(_folded(tilt), "rad", "angle of the major axis from +y about +x, -90 to 90 degrees"),
            "sense": Scalar(sense, "1", "sense of travel: 1 right-handed about +x (from +y to +z), -1 left"),
        }


def _harmonic(time: Array, path: Array, frequency: float) -> NDArray[np.complex128]:
    """Amplitudes C (coordinates,) of Re(C exp(2 pi i f t)), least squares beside a mean; the unit of ``path``."""
    # The last sample repeats the first phase, which must not count twice.
    angle = 2 * np.pi * frequency * time[:-1]
    columns = np.column_stack([np.ones_like(angle), np.cos(angle), np.sin(angle)])
    _, cosine, sine = np.linalg.lstsq(columns, path[:-1], rcond=None)[0]
    return np.asarray(cosine - 1j * sine)


def _folded(angle: float) -> float:
    """An undirected line's angle (rad) in [-pi/2, pi/2)."""
    return (angle + np.pi / 2) % np.pi - np.pi / 2
