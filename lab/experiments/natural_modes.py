"""Natural vibrations about rest (5.4.1: what the frequencies of the sweeps meet)."""

from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from lab.materials import Frozen
from lab.records import Record, Scalar

Array = NDArray[np.float64]


class NaturalModes(Frozen):
    """Slowest undamped vibrations of the clamped beam with what its tip carries, about the unloaded shape.

    Sensed: ``frequency`` (mode,), Hz, ascending, and ``tip`` (mode, 6), the motion of the tip's centre (m) and the
    mean rotation of its face (rad) in each mode, scaled to a modal mass of 1 kg.
    """

    kind: Literal["NaturalModes"] = "NaturalModes"
    in_motion: ClassVar[bool] = False
    count: Annotated[int, Field(ge=1, le=50, description="Modes.")] = 6

    def reduce(self, record: Record) -> dict[str, Scalar]:
        """Frequency of every mode; needs the channel ``frequency`` (mode,)."""
        return {
            f"f_{number}": Scalar(float(value), "Hz", f"natural frequency of mode {number}")
            for number, value in enumerate(record["frequency"], 1)
        }

    @staticmethod
    def kinds(record: Record) -> list[str]:
        """What moves the corner of the tip face most in every mode: ``bending``, ``torsion`` or ``stretch``."""
        tip = record["tip"]
        half = record.specimen["width"] / 2.0
        sizes = np.stack([np.hypot(tip[:, 1], tip[:, 2]), half * np.abs(tip[:, 3]), np.abs(tip[:, 0])])
        return [("bending", "torsion", "stretch")[i] for i in np.argmax(sizes, axis=0)]


def senses(tip: Array, width: float) -> Array:
    """Factors 1 and -1 (modes,) that make the largest of every mode's tip motion positive: a shape has no own sign.

    Parameters
    ----------
    tip
        As in ``NaturalModes``, (modes, 6), m and rad; rotations count times half the width.
    width
        Of the section, m.
    """
    sizes = tip * ([1.0] * 3 + [width / 2.0] * 3)
    largest = np.take_along_axis(sizes, np.abs(sizes).argmax(axis=1)[:, None], axis=1)[:, 0]
    return np.where(largest < 0.0, -1.0, 1.0)
