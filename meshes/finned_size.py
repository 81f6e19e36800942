"""Areas and volumes of the tube with fins, against which meshes and CAD solids are measured."""

import numpy as np
from numpy.typing import NDArray

from lab.specimens import FinnedTube
from meshes.finned_tube import Body, FinnedPart

Array = NDArray[np.float64]
#: Points of Gauss's rule around and through a fin; the integrands are smooth.
_POINTS = 40
#: Share of tube and of fin in a part.
_SHARES: dict[FinnedPart, tuple[float, float]] = {
    "whole": (1.0, 1.0), "half": (0.5, 0.5), "half-x": (0.5, 1.0), "quarter": (0.25, 0.5),
}  # fmt: skip


def surface_area(specimen: FinnedTube, body: Body, part: FinnedPart = "whole") -> float:
    """Of a middle surface, m^2: that of a fin begins half-way between the curves where its faces end."""
    tube, fin = _SHARES[part]
    if body == "tube":
        return float(tube * 2 * np.pi * specimen.mid_radius * specimen.length)
    psi, weight = _rule(0.0, specimen.fin_arc / 2)
    root = (
        specimen.root_along(psi, specimen.face_radius(0.0)) + specimen.root_along(psi, specimen.face_radius(1.0))
    ) / 2
    return float(2 * fin * specimen.mid_radius * weight @ (specimen.tip_along - root))


def tube_volume(specimen: FinnedTube) -> float:
    """Of the tube without fins and chambers, m^3."""
    return float(np.pi * (specimen.radius**2 - specimen.inner_radius**2) * specimen.length)


def fin_volume(specimen: FinnedTube) -> float:
    """Of one fin outside the tube, m^3."""
    psi, around = _rule(0.0, specimen.fin_arc / 2)
    radius, through = _rule(specimen.face_radius(0.0), specimen.face_radius(1.0))
    along = np.stack([specimen.tip_along - specimen.root_along(psi, r) for r in radius])
    return float(2 * (radius * through) @ along @ around)


def chamber_volume(specimen: FinnedTube) -> float:
    """Of the walls of one chamber inside the tube, m^3: a box on the curved wall around a cavity on it."""
    chambers, inside = specimen.chambers, specimen.inner_radius

    def box(width: float, length: float, top: float) -> float:
        across, weight = _rule(0.0, width / 2)
        return float(2 * length * weight @ (np.sqrt(inside**2 - across**2) - top))

    top, wall = inside - chambers.height, chambers.wall
    cavity = box(chambers.width - 2 * wall, chambers.length - 2 * wall, top + wall)
    return box(chambers.width, chambers.length, top) - cavity


def _rule(low: float, high: float) -> tuple[Array, Array]:
    points, weights = np.polynomial.legendre.leggauss(_POINTS)
    half = (high - low) / 2
    return low + half * (points + 1), half * weights
