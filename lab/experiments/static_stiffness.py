"""Static stiffness of the tip (5.2) and its regression to matrices (5.3)."""

import math
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from lab.materials import Frozen
from lab.records import Record, Scalar
from lab.units import Quantity

Array = NDArray[np.float64]

#: Entries of K' (eq. 5.6) row by row with their units, as table 5.1 heads them.
KPRIME_ENTRIES: tuple[tuple[str, str], ...] = (
    ("k_yy", "N/m"), ("k_yz", "N/m"), ("m_yx", "N/rad"),
    ("k_zy", "N/m"), ("k_zz", "N/m"), ("m_zx", "N/rad"),
    ("t_xy", "N*m/m"), ("t_xz", "N*m/m"), ("n_xx", "N*m/rad"),
)  # fmt: skip
#: Entries of Q' (eq. 5.4).  Eq. 5.4 is written with z along the beam, eqs 5.5 to 5.11 with x:
#: here, with x along the beam, the quadratic terms are the axial force against X_y^2 and X_z^2.
QPRIME_ENTRIES: tuple[tuple[str, str], ...] = (("p_xy", "N/m^2"), ("p_xz", "N/m^2"))


class StaticStiffness(Frozen):
    """Root clamped, tip face moved as a rigid body, one motion at a time from rest.

    Translation along y, then z, then rotation about x, each in both senses; every other tip motion
    is held, except as far as the rig gives way.  Sensed at every increment: pose of the tip, and
    force and moment that the rig puts on it, in the fixed axes, the moment about the tip's centre.
    """

    kind: Literal["StaticStiffness"] = "StaticStiffness"
    in_motion: ClassVar[bool] = False
    translation: Annotated[float, Quantity("m", "mm"), Field(gt=0)] = 0.005
    rotation: Annotated[float, Quantity("rad", "deg"), Field(gt=0, lt=np.pi / 2)] = math.radians(15.0)
    increments: int = Field(5, ge=1, le=1000, description="Recorded increments per leg, evenly spaced.")
    #: Stiffness of robot, sensor and clamps in translation, the same along x, y and z.  None: rigid.
    rig_stiffness: Annotated[float, Quantity("N/m", "N/mm"), Field(gt=0)] | None = None

    def legs(self) -> tuple[tuple[int, float], ...]:
        """Degree of freedom (0..2 along x, y, z; 3..5 about them) and end value of each leg, m or rad."""
        ends = ((1, self.translation), (2, self.translation), (3, self.rotation))
        return tuple((dof, sense * end) for dof, end in ends for sense in (1.0, -1.0))

    def reduce(self, record: Record) -> dict[str, Scalar]:
        """K' and Q' from a record, by the least squares of section 5.3.

        K' has no intercept and is fitted to the robot's motions, as in the dissertation: with a
        compliant rig it contains the rig.  The tip hardens, so the slope depends on where the samples
        lie: a robot's force log is dense and even (ASSUMED: steady speed), and each leg is
        brought to that by a cubic spline through rest and its increments.

        Needs the channels ``leg`` (n,), ``motion`` (n, 6) and ``wrench`` (n, 6).
        """
        motion, wrench = _dense(record["leg"], record["motion"], record["wrench"])
        lateral = motion[:, 1:4]
        kprime = _regress(lateral, wrench[:, 1:4])
        quadratic = _regress(np.column_stack([motion[:, 1:3] ** 2, lateral]), wrench[:, :1])[0, :2]
        values = [*kprime.ravel(), *quadratic]
        return {
            name: Scalar(float(v), unit)
            for (name, unit), v in zip(KPRIME_ENTRIES + QPRIME_ENTRIES, values, strict=True)
        }


def _dense(leg: NDArray[np.int64], motion: Array, wrench: Array, count: int = 200) -> tuple[Array, Array]:
    """``count`` even samples per leg from rest (excluded) to its end, both (legs * count, 6)."""
    from scipy.interpolate import CubicSpline

    share = np.arange(1, count + 1) / count
    parts = []
    for number in np.unique(leg):
        mine = leg == number
        places = np.linspace(0.0, 1.0, int(mine.sum()) + 1)
        both = np.vstack([np.zeros(12), np.hstack([motion[mine], wrench[mine]])])
        parts.append(CubicSpline(places, both)(share))
    stacked = np.vstack(parts)
    return stacked[:, :6], stacked[:, 6:]


def _regress(inputs: Array, outputs: Array) -> Array:
    """Matrix A of outputs = A inputs by least squares without intercept, (outputs, inputs)."""
    # Columns in m, m^2 and rad differ by orders of magnitude: scale them for the solver.
    scale = np.abs(inputs).max(axis=0)
    solution, *_ = np.linalg.lstsq(inputs / scale, outputs, rcond=None)
    return solution.T / scale
