"""The pinched tube as a middle surface and as a solid: the ideal cylinder, its pads, its imperfection, its grid.

A point is told by its angle from +x about +z (rad) and its place z along the axis (m).
"""

from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from lab.specimens import PinchedTube
from meshes.gathering import MeshError
from meshes.options import MeshOptions
from meshes.structured import solid_mesh, surface_mesh
from meshes.tube_grid import stations_along, stations_around

if TYPE_CHECKING:
    from skfem import MeshHex2, MeshQuad2

Array = NDArray[np.float64]
#: The whole tube, or what three mirrors leave: z >= length/2, x >= 0, y >= 0.
Part = Literal["whole", "eighth"]
_Faces = tuple[str, str, str, str, str, str]
_FACES: dict[Part, _Faces] = {
    "whole": ("", "", "root", "tip", "inside", "outside"),
    "eighth": ("side", "crest", "middle", "tip", "inside", "outside"),
}


def tube_surface(specimen: PinchedTube, options: MeshOptions, part: Part = "whole") -> "MeshQuad2":
    """Middle surface of the wall; its normal points outwards.

    Parameters
    ----------
    specimen
        Lengths in m.
    options
        ``along`` elements over the whole length and ``across`` from one pad to the next.
    part
        An eighth has no imperfection, which has no symmetry.

    Returns
    -------
    MeshQuad2
        Edges ``root`` (z = 0) and ``tip`` (z = length); of an eighth ``middle`` (z = length / 2), ``tip``,
        ``crest`` (x = 0, under the first pair of pads) and ``side`` (y = 0).

    Raises
    ------
    MeshError
        Too few elements to follow the pads, or numbers that an eighth cannot halve.
    """
    counts, edges, place = tube_image(specimen, options, part)
    return surface_mesh(counts[:2], lambda a, b: place(a, b, 0.5), edges[:4], closed=part == "whole")


def tube_solid(specimen: PinchedTube, options: MeshOptions, part: Part = "whole") -> "MeshHex2":
    """The wall in hexahedra, ``through`` of them; boundaries of ``tube_surface`` as faces, ``inside``, ``outside``."""
    counts, faces, place = tube_image(specimen, options, part)
    return solid_mesh(counts, place, faces, closed=part == "whole")


def tube_image(
    specimen: PinchedTube, options: MeshOptions, part: Part = "whole"
) -> tuple[tuple[int, int, int], _Faces, Callable[[Array, Array, Array | float], Array]]:
    """The wall as an image of the unit cube: around, along, outwards.

    Returns
    -------
    tuple
        Numbers of elements, names of the faces, and positions (n, 3), m, of parameters.
    """
    angles, heights = _grid(specimen, options, part)

    def place(a: Array, b: Array, c: Array | float) -> Array:
        return wall_places(specimen, _at(angles, a), _at(heights, b), c, part)

    return (len(angles) - 1, len(heights) - 1, options.through), _FACES[part], place


def pad_share(specimen: PinchedTube, points: Array) -> Array:
    """1 on the pads, 0 on the bare wall, a fillet between them (n,), at points (n, 3), m, of the tube at rest."""
    return _bump(specimen, _angles(points), points[:, 2])


def wall_thickness(specimen: PinchedTube, points: Array) -> Array:
    """Thickness of the wall with its pads, m (n,), at points (n, 3), m, of the tube at rest."""
    return specimen.wall + specimen.pad_height * pad_share(specimen, points)


def radial_directions(specimen: PinchedTube, points: Array) -> Array:
    """Unit vectors (n, 3) away from the axis, along which the thickness is measured."""
    angle = _angles(points)
    return np.column_stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)])


def wall_places(specimen: PinchedTube, angle: Array, z: Array, depth: Array | float, part: Part = "whole") -> Array:
    """Positions (n, 3), m, in the wall: ``depth`` 0 at the inside, 1 at the outside.  Pads grow inwards."""
    thickness = specimen.wall + specimen.pad_height * _bump(specimen, angle, z)
    radius = specimen.radius - (1.0 - depth) * thickness
    if part == "whole" and specimen.imperfection:
        radius = radius + imperfection(specimen, angle, z)
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), z])


def imperfection(specimen: PinchedTube, angle: Array, z: Array) -> Array:
    """How far the wall lies outside its ideal place, m (n,): smooth, zero at both ends, without any symmetry.

    Its largest size is ``specimen.imperfection``; ``specimen.imperfection_angle`` turns it about the axis.
    """
    around = angle - specimen.imperfection_angle
    return specimen.imperfection / _largest() * _uneven(around, z / specimen.length)


def _uneven(angle: Array, share: Array) -> Array:
    # Harmonics one to three around, even and odd along: one part at least in every class of symmetry of a tube.
    even = np.cos(angle - 0.7) + 0.5 * np.cos(2 * angle + 0.9) + 0.5 * np.cos(3 * angle - 0.4)
    odd = 0.4 * np.cos(angle + 1.9) + 0.5 * np.cos(2 * angle - 0.3) + 0.3 * np.cos(3 * angle + 1.1)
    return np.sin(np.pi * share) * even + np.sin(2 * np.pi * share) * odd


@cache
def _largest() -> float:
    angle, share = np.meshgrid(np.linspace(0, 2 * np.pi, 721), np.linspace(0, 1, 361))
    return float(np.abs(_uneven(angle, share)).max())


def _bump(specimen: PinchedTube, angle: Array, z: Array) -> Array:
    spacing = np.pi / specimen.pairs
    # Angle from the next pad, the first being on +y.
    off = (angle - np.pi / 2 + spacing / 2) % spacing - spacing / 2
    half = specimen.pad_width / 2
    around = np.maximum(specimen.mid_radius * np.abs(off) - half, 0.0)
    along = np.maximum(np.abs(z - specimen.length / 2) - half, 0.0)
    share = np.clip(1.0 - np.hypot(around, along) / specimen.pad_fillet, 0.0, 1.0)
    # Like a fillet, without a kink at its foot; and quadratic, so that one element across repeats it exactly: the
    # smoother s^2 (3 - 2 s) made pinches 2 % softer once meshes were fine enough to see it.
    return share**2


def _angles(points: Array) -> Array:
    return np.arctan2(points[:, 1], points[:, 0])


def _grid(specimen: PinchedTube, options: MeshOptions, part: Part) -> tuple[Array, Array]:
    """Angles and places z of the elements' edges."""
    angles, heights = stations_around(specimen, options), stations_along(specimen, options)
    if part == "whole":
        return angles, heights
    quarter, odd = divmod(specimen.pairs * options.across, 2)
    if odd or options.along % 2:
        raise MeshError(
            f"an eighth halves the numbers of elements: along {options.along} must be even, and so must "
            f"across {options.across}" + (f" with {specimen.pairs} pairs" if specimen.pairs % 2 else "")
        )
    return angles[-quarter - 1 :] - 2 * np.pi, heights[options.along // 2 :]


def _at(stations: Array, share: Array) -> Array:
    """Places of parameters in 0..1; middle nodes half-way between the elements' edges."""
    return np.interp(share, np.linspace(0.0, 1.0, len(stations)), stations)
