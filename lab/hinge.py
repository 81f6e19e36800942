"""What makes a pinched section a hinge: the shape of the section, and which way it bends most easily."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Ratio of the smaller to the larger above which two directions count as equal, so that no axis is told.
AS_ONE = 0.9


@dataclass(frozen=True)
class SectionShape:
    """Deformed mid-length section.

    Parameters
    ----------
    axis
        Line of its largest extent from +x, rad, 0 to pi; NaN where extents do not differ.
    width
        Smallest distance of two parallel lines that hold the section between them, m.
    roundness
        Smaller over larger radius of gyration: 1 for a circle, 0 for a line.
    """

    axis: float
    width: float
    roundness: float


def section_shape(section: Array, as_one: float = AS_ONE) -> SectionShape:
    """Shape of a closed curve of places in order (m, 2), m, by its second moments per length."""
    after = np.roll(section, -1, axis=0)
    middle, length = (section + after) / 2, np.linalg.norm(after - section, axis=1)
    arms = middle - np.average(middle, axis=0, weights=length)
    moments = np.einsum("m,mi,mj->ij", length / length.sum(), arms, arms)
    values, vectors = np.linalg.eigh(moments)
    roundness = float(np.sqrt(max(values[0], 0.0) / values[1]))
    axis = float(np.arctan2(vectors[1, 1], vectors[0, 1]) % np.pi)
    angles = np.linspace(0.0, np.pi, 181)[:-1]
    across = section @ np.stack([np.cos(angles), np.sin(angles)])
    return SectionShape(axis if roundness < as_one else float("nan"), float(np.ptp(across, axis=0).min()), roundness)


@dataclass(frozen=True)
class BendingStiffness:
    """Tangent stiffness of the distal block against turning about axes across the tube, no force on it.

    Parameters
    ----------
    axis
        About which it is least, from +x, rad, 0 to pi; NaN where both principal values are as good as equal.
    soft, stiff
        Principal values, N m/rad; negative where the pinched state is unstable.
    """

    axis: float
    soft: float
    stiff: float


def bending_stiffness(flexibility: Array, as_one: float = AS_ONE) -> BendingStiffness:
    """Principal bending stiffness from the flexibility of the distal block (6, 6) (m and rad per N and N m).

    The block turns about x and y under pure moments: the inverse of that 2 x 2 part is the bending stiffness.
    """
    part = flexibility[3:5, 3:5]
    values, vectors = np.linalg.eigh(np.linalg.inv((part + part.T) / 2))
    axis = float(np.arctan2(vectors[1, 0], vectors[0, 0]) % np.pi)
    as_good = values[0] > 0 and values[0] / values[1] > as_one
    return BendingStiffness(float("nan") if as_good else axis, float(values[0]), float(values[1]))
