"""Steady orbit of the tip of a shaken beam (5.4.1)."""

from collections.abc import Sequence
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from lab.experiments.ring_down import turned
from lab.experiments.shaking import SmoothShake
from lab.materials import Frozen
from lab.orbits import ellipse, harmonics, sense, signed_area
from lab.records import Record, Scalar
from lab.units import Quantity

Array = NDArray[np.float64]
Metre = Annotated[float, Quantity("m", "mm")]

#: Harmonics of the path that are told, the first included.
HARMONICS = 3
#: Periods over which the shrinking of the transient is measured.
_LOOK = 8
#: Slower shrinking than this in a period cannot be told from the rounding of the steps.
_SLOWEST = 0.995


class BaseShake(Frozen):
    """The clamp moves along z as A sin(2 pi f t) until the tip repeats its path in every period.

    The amplitude A rises smoothly over the first periods, and not faster than ``rise``: a rise of some periods of the
    slowest natural mode leaves little transient.  The orbit is steady when what is left of the transient, as the
    changes from period to period tell it (``remaining``), falls below ``tolerance``; after ``max_periods``, those of
    the rise included, a performer gives up (status ``diverged``, with the path that it reached).  One frequency is one
    sample.
    Without ``own_weight`` gravity is left out: the text does not say how the shaker stood.  With it, gravity acts on
    the beam and on what its tip carries, and rest is the equilibrium under it, as in ``RingDown``.

    Sensed: displacements of the markers from rest relative to the moving clamp over the last period,
    ``samples_per_period`` + 1 samples.  Its time 0 is where the clamp passes its middle along +z, so the clamp's place
    is A sin(2 pi f t).  Markers ride on the mean rigid motion of the tip face, as in the ring-down.

    The numbers of the orbit are those of its path as ``seen_from`` the room, the clamp's motion included, as cameras
    see it: ASSUMED, since the text speaks of the trajectory of the beam's distal end and of no moving frame.  Below
    resonance the two differ in kind: the tip then follows the clamp on a line of 2 A.
    """

    kind: Literal["BaseShake"] = "BaseShake"
    in_motion: ClassVar[bool] = True
    frequency: Annotated[float, Quantity("Hz", "Hz"), Field(gt=0)] = 15.0
    amplitude: Annotated[float, Quantity("m", "mm"), Field(gt=0)] = 0.002
    ramp_periods: float = Field(5.0, ge=0, description="Periods within which the amplitude rises; 0: at once.")
    rise: Annotated[float, Quantity("s", "s"), Field(ge=0, description="Least time of the rise.")] = 0.0
    tolerance: float = Field(1e-3, gt=0, lt=1, description="Transient that may be left over the path's size.")
    max_periods: int = Field(400, ge=2, description="Periods after which an orbit counts as unsteady.")
    gravity: Annotated[float, Quantity("m/s^2", "m/s^2"), Field(gt=0)] = 9.81
    #: Direction of gravity from +y about +x (180 deg: along -y, y being up).  None: left out.
    own_weight: Annotated[float, Quantity("rad", "deg"), Field(ge=-np.pi, le=np.pi)] | None = None
    seen_from: Literal["room", "clamp"] = Field("room", description="Frame of the orbit's numbers.")
    samples_per_period: int = Field(64, ge=8, le=10_000, description="Samples recorded per period.")
    #: Place of each marker from the tip's centre in the fixed axes of the unloaded beam.
    markers: tuple[tuple[Metre, Metre, Metre], ...] = Field(((0.0, 0.0, 0.0),), min_length=1)

    @model_validator(mode="after")
    def _lets_two_periods_be_compared(self) -> Self:
        if self.max_periods < self.rising_periods + 3:
            raise ValueError(
                f"max_periods must leave three periods after the rise of {self.rising_periods:g}: {self.max_periods} "
                "is too few"
            )
        return self

    @property
    def rising_periods(self) -> float:
        """Periods within which the amplitude rises."""
        return max(self.ramp_periods, self.rise * self.frequency)

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
        return SmoothShake((0.0, 0.0, self.amplitude), self.frequency, self.rising_periods * self.period)

    @property
    def own_gravity(self) -> tuple[float, float, float] | None:
        """Acceleration that gravity gives the beam and what its tip carries, m/s^2; None: left out."""
        return None if self.own_weight is None else turned(self.gravity, self.own_weight)

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

    @staticmethod
    def remaining(changes: Sequence[float]) -> float:
        """Transient that is left after some periods at full amplitude, over the path's size; inf if that is not known.

        A free vibration that shrinks by q in every period changes the path by at least 1 - q of itself, so no more
        than change / (1 - q) is left.  The changes tell q, over several periods where there are so many.

        Parameters
        ----------
        changes
            ``change`` from each period at full amplitude to the next, in their order.
        """
        look = min(len(changes) - 1, _LOOK)
        if look < 1:
            return float("inf")
        before, now = changes[-1 - look], changes[-1]
        shrinking = (now / before) ** (1.0 / look) if before else 1.0
        return float(now / (1.0 - min(shrinking, _SLOWEST)))

    def path(self, record: Record) -> Array:
        """The mean marker's path across the beam over the last period, (samples, 2), m: y and z, as ``seen_from``."""
        return self.path_of(record["markers"])

    def path_of(self, markers: Array) -> Array:
        """The same from marker displacements relative to the clamp (samples, markers, 3), m."""
        path: Array = markers.mean(axis=1)[:, 1:]
        if self.seen_from == "room":
            path = path + [0.0, self.amplitude] * np.sin(2 * np.pi * self.frequency * self.times)[:, None]
        return path

    def reduce(self, record: Record) -> dict[str, Scalar]:
        """Ellipse, sense of travel and harmonics of the mean marker's path in the y-z plane, as ``seen_from``.

        Needs the channel ``markers`` (n, marker, 3) over a whole period.
        """
        path = self.path(record)
        fitted, size = ellipse(path), np.linalg.norm(harmonics(path, HARMONICS), axis=1)
        about = f"orbit, seen from the {self.seen_from}"
        return {
            "major_axis": Scalar(fitted.major, "m", f"length of the major axis of the {about}"),
            "minor_axis": Scalar(abs(fitted.minor), "m", f"length of the minor axis of the {about}"),
            "axis_ratio": Scalar(fitted.ratio, "1", "minor over major axis with the sign of the sense of travel"),
            "tilt": Scalar(fitted.tilt, "rad", "angle of the major axis from +y about +x, -90 to 90 degrees"),
            "sense": Scalar(
                float(sense(fitted.ratio)), "1",
                "sense of travel: 1 right-handed about +x (from +y to +z), -1 left-handed, 0 a line",
            ),
            "signed_area": Scalar(signed_area(path), "m^2", "area that the path encloses, positive if right-handed"),
            "span_x": Scalar(float(np.ptp(record["markers"].mean(axis=1)[:, 0])), "m", "extent of the path along x"),
            "span_y": Scalar(float(np.ptp(path[:, 0])), "m", "extent of the path along y"),
            "span_z": Scalar(float(np.ptp(path[:, 1])), "m", "extent of the path along z"),
            "ellipse_residual": Scalar(fitted.residual, "m", "root mean square distance of the path from its ellipse"),
            **{
                f"harmonic_{n}": Scalar(_share(size[n - 1], size[0]), "1", f"harmonic {n} of the path over the first")
                for n in range(2, HARMONICS + 1)
            },
        }  # fmt: skip


def _share(part: float, whole: float) -> float:
    """``part`` over ``whole``; NaN for a path that stands still."""
    return float(part / whole) if whole else float("nan")
