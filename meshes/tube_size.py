"""Volume and area of the pinched tube by fine sums, against which meshes are measured."""

import numpy as np
from numpy.typing import NDArray

from lab.specimens import PinchedTube
from meshes.tube import Part, wall_places

Array = NDArray[np.float64]
#: Steps around a pair's spacing and along; the sums are good to some 1e-6.
_STEPS = (300, 1000)


def wall_volume(specimen: PinchedTube, part: Part = "whole") -> float:
    """Of the wall with its pads, m^3."""
    angle, z, patch = _patches(specimen, part)
    inner, outer = (np.linalg.norm(wall_places(specimen, angle, z, depth, part)[:, :2], axis=1) for depth in (0.0, 1.0))
    return float(patch * (outer**2 - inner**2).sum() / 2)


def wall_area(specimen: PinchedTube, part: Part = "whole") -> float:
    """Of the middle surface, m^2."""
    angle, z, patch = _patches(specimen, part)
    step = 1e-5

    def slope(turn: float, rise: float) -> Array:
        ahead = wall_places(specimen, angle + turn, z + rise, 0.5, part)
        return ahead - wall_places(specimen, angle - turn, z - rise, 0.5, part)

    rise = step * specimen.length
    normals = np.cross(slope(step, 0.0), slope(0.0, rise)) / (4 * step * rise)
    return float(patch * np.linalg.norm(normals, axis=1).sum())


def _patches(specimen: PinchedTube, part: Part) -> tuple[Array, Array, float]:
    """Centres of even patches in angle and z, and the size of one, rad m."""
    turn, low = (2 * np.pi, 0.0) if part == "whole" else (np.pi / 2, specimen.length / 2)
    around, along = (max(_STEPS[0] * 2 * specimen.pairs // (1 if part == "whole" else 4), 1), _STEPS[1])
    angle = turn * (np.arange(around) + 0.5) / around
    z = low + (specimen.length - low) * (np.arange(along) + 0.5) / along
    angles, heights = np.meshgrid(angle, z)
    return angles.ravel(), heights.ravel(), turn * (specimen.length - low) / (around * along)
