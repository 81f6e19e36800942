"""Free decay after a hanging load is cut (5.4.2)."""

from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field, field_validator

from lab.materials import Frozen
from lab.measures import dominant_mode
from lab.records import Record, Scalar
from lab.units import Quantity

Metre = Annotated[float, Quantity("m", "mm")]


class RingDown(Frozen):
    """A weight hangs from the tip face, is cut at t = 0, and the beam swings freely.

    The load pulls along y turned by ``direction`` about +x (0: +y, 90 deg: +z).  The text does not say
    which way the beam was loaded: ASSUMED, a parameter.  It hangs from the material point of the tip face at
    ``load_place``; off the axis it twists the beam, so that the release excites torsion as well.

    Without ``own_weight`` gravity acts on the load only: the text's beam weighs 0.05 N, and markers are measured
    from the position at rest.  A heavy or soft beam sags, which stiffens or softens its swing: with
    ``own_weight`` gravity also acts on the beam and on what its tip carries, and rest is the equilibrium under it.
    A beam that is held up at its tip and let go is a load that points against ``own_weight``.

    Markers ride on a light carrier that follows the mean rigid motion of the tip face.  Their
    places on it are not published: ASSUMED.  Sensed: marker positions minus rest, at ``rate``,
    first sample at the release.
    """

    kind: Literal["RingDown"] = "RingDown"
    in_motion: ClassVar[bool] = True
    load_mass: Annotated[float, Quantity("kg", "g"), Field(gt=0)] = 0.200
    gravity: Annotated[float, Quantity("m/s^2", "m/s^2"), Field(gt=0)] = 9.81
    direction: Annotated[float, Quantity("rad", "deg"), Field(ge=-np.pi, le=np.pi)] = 0.0
    #: Where the weight hangs, from the tip's centre in the fixed axes of the unloaded beam; x is 0, on the face.
    load_place: tuple[Metre, Metre, Metre] = (0.0, 0.0, 0.0)
    #: Direction of gravity on the beam and on what its tip carries, turned as ``direction`` is.  None: left out.
    own_weight: Annotated[float, Quantity("rad", "deg"), Field(ge=-np.pi, le=np.pi)] | None = None
    duration: Annotated[float, Quantity("s", "s"), Field(gt=0)] = 0.25
    rate: Annotated[float, Quantity("Hz", "Hz"), Field(gt=0)] = 360.0
    #: Place of each marker from the tip's centre in the fixed axes of the unloaded beam.
    markers: tuple[tuple[Metre, Metre, Metre], ...] = Field(
        ((0.0, 0.010, 0.0), (0.0, -0.010, 0.0), (0.0, 0.0, 0.010)), min_length=1
    )

    @field_validator("load_place")
    @classmethod
    def _on_the_face(cls, value: tuple[float, float, float]) -> tuple[float, float, float]:
        if value[0] != 0.0:
            raise ValueError(f"the weight hangs from the tip face: its x must be 0, not {value[0]:g} m")
        return value

    @property
    def samples(self) -> int:
        """Number of samples, the one at the release included."""
        return round(self.duration * self.rate) + 1

    @property
    def load(self) -> tuple[float, float, float]:
        """Force of the weight on the tip before the release, N."""
        return turned(self.load_mass * self.gravity, self.direction)

    @property
    def own_gravity(self) -> tuple[float, float, float] | None:
        """Acceleration that gravity gives the beam and what its tip carries, m/s^2; None: left out."""
        return None if self.own_weight is None else turned(self.gravity, self.own_weight)

    def reduce(self, record: Record) -> dict[str, Scalar]:
        """Start deflection, frequency and damping of the main mode of the mean marker's motion.

        Needs the channels ``time`` (n,) and ``markers`` (n, marker, 3).
        """
        mean = record["markers"].mean(axis=1)
        frequency, damping = dominant_mode(record["time"], mean[:, 1:])
        return {
            "release_y": Scalar(float(mean[0, 1]), "m", "mean marker displacement along y at the release"),
            "release_z": Scalar(float(mean[0, 2]), "m", "mean marker displacement along z at the release"),
            "frequency": Scalar(frequency, "Hz", "damped frequency of the main mode"),
            "damping_ratio": Scalar(damping, "1", "damping ratio of the main mode"),
        }


def turned(size: float, angle: float) -> tuple[float, float, float]:
    """Vector along +y turned by ``angle`` (rad) about +x."""
    return (0.0, size * float(np.cos(angle)), size * float(np.sin(angle)))
