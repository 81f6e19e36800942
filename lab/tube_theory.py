"""The open tube as a beam: a thin ring in bending and shear, its ends held round."""

import math

from lab.specimens.pinched_tube import PinchedTube

#: Shear correction of a thin ring.
RING = 0.5


def tip_stiffness(
    modulus: float, poisson_ratio: float, radius: float, wall: float, length: float, place: float = 0.0
) -> float:
    """Force over motion of a point on a rigid block at the tip of a clamped tube, N/m (Timoshenko).

    Parameters
    ----------
    modulus, poisson_ratio
        E, Pa, and nu.
    radius, wall, length
        Of the middle of the wall, its thickness, and between the blocks, m.
    place
        Distance of the point beyond the block's face, m.
    """
    bending = modulus * math.pi * radius**3 * wall
    shear = RING * modulus / (2 * (1 + poisson_ratio)) * 2 * math.pi * radius * wall
    return 1 / ((length**3 / 3 + length**2 * place + length * place**2) / bending + length / shear)


def open_stiffness(tube: PinchedTube, place: float = 0.0) -> float:
    """The same of an unpinched specimen, its pads left out."""
    elastic = tube.material
    return tip_stiffness(elastic.youngs_modulus, elastic.poisson_ratio, tube.mid_radius, tube.wall, tube.length, place)
