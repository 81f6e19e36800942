"""The twisted beam as an image of the unit cube."""

import numpy as np
from numpy.typing import NDArray

from lab.specimens import TwistedBeam
from meshes.options import MeshOptions

Array = NDArray[np.float64]


def graded(place: Array, grading: float, elements: int) -> Array:
    """Places on 0..1 crowded to both ends: ends of ``elements`` even ones go to x - grading sin(2 pi x) / (2 pi).

    Nodes between them stay half-way: quadratic elements fold when their middle nodes move off too far.
    """
    ends = np.linspace(0.0, 1.0, elements + 1)
    return np.interp(place, ends, ends - grading * np.sin(2 * np.pi * ends) / (2 * np.pi))


def twisted(points: Array, specimen: TwistedBeam, options: MeshOptions) -> Array:
    """Points of the unit cube on the beam, graded, each turned with the section of its ``x``; (n, 3), m."""
    x = specimen.length * graded(points[:, 0], options.grading_along, options.along)
    y = specimen.width * (graded(points[:, 1], options.grading_across, options.across) - 0.5)
    z = specimen.thickness * (points[:, 2] - 0.5)
    angle = specimen.section_angle(x)
    return np.column_stack([x, np.cos(angle) * y - np.sin(angle) * z, np.sin(angle) * y + np.cos(angle) * z])


def thickness_directions(specimen: TwistedBeam, points: Array) -> Array:
    """Unit vectors (n, 3) along which the thickness is measured: across the width, in the plane of the section.

    Not the normal of the middle surface, which the twist tilts out of that plane.
    """
    angle = specimen.section_angle(points[:, 0])
    return np.column_stack([np.zeros(len(points)), -np.sin(angle), np.cos(angle)])


def helicoid_area(specimen: TwistedBeam) -> float:
    """Area of the twisted middle surface: integral of sqrt(1 + (rate y)^2) over x and y, m^2."""
    edge = abs(specimen.twist) / specimen.length * specimen.width / 2
    mean = (np.sqrt(1 + edge**2) + (np.arcsinh(edge) / edge if edge > 1e-9 else 1.0)) / 2
    return float(specimen.length * specimen.width * mean)
