"""The pinched tube as a CAD solid: wall, end blocks, and prismatic pads with fillets."""

from typing import Any

import numpy as np

from lab.specimens import PinchedTube

#: Lengths in the CAD kernel are millimetres.
MM = 1e3
#: Radius of the fillets over height or transition of the pads, whichever is smaller.
_ROUNDING = 0.65


def tube_solid_cad(gmsh: Any, specimen: PinchedTube, blocks: bool) -> None:
    """Put the tube into gmsh's model, mm, as one solid; without ``blocks`` the wall between them alone.

    The parabola that leads up to the pads in the meshes is a step here with a fillet at its foot, where both have the
    same volume.
    """
    occ = gmsh.model.occ
    outside, inside = MM * specimen.radius, MM * (specimen.radius - specimen.wall)
    length, block = MM * specimen.length, MM * specimen.block_length if blocks else 0.0

    def cylinder(radius: float, start: float, height: float) -> tuple[int, int]:
        tag = occ.addCylinder(0, 0, start, 0, 0, height, radius)
        # The cylinder's seam half-way between two pads.
        occ.rotate([(3, tag)], 0, 0, 0, 0, 0, 1, np.pi / 2 + np.pi / specimen.pairs / 2)
        return 3, tag

    body, _ = occ.cut([cylinder(outside, -block, length + 2 * block)], [cylinder(inside, 0, length)])
    if not specimen.pad_height:
        occ.synchronize()
        return
    pads = [_pad(gmsh, specimen, float(angle)) for angle in specimen.pad_directions()]
    body, _ = occ.fuse(body, pads)
    occ.synchronize()
    occ.fillet([tag for _, tag in body], _feet(gmsh, specimen), [fillet_radius(specimen)])
    occ.synchronize()


def fillet_radius(specimen: PinchedTube) -> float:
    """At the feet of the pads, mm."""
    return MM * _ROUNDING * min(specimen.pad_height, specimen.pad_fillet)


def _widening(specimen: PinchedTube) -> float:
    """How far the step stands beside the pad, mm: the parabola's third less the fillet's share."""
    return MM * specimen.pad_fillet / 3 - (1 - np.pi / 4) * fillet_radius(specimen) ** 2 / (MM * specimen.pad_height)


def _footprint(specimen: PinchedTube) -> float:
    """Half the width of a pad up to the step, mm."""
    return MM * specimen.pad_width / 2 + _widening(specimen)


def _pad(gmsh: Any, specimen: PinchedTube, direction: float) -> tuple[int, int]:
    """Pad in its place, reaching half-way into the wall; its four edges that run inwards are rounded."""
    occ = gmsh.model.occ
    half, middle = _footprint(specimen), MM * specimen.length / 2
    turn = half / (MM * specimen.mid_radius)
    inner = MM * (specimen.radius - specimen.wall - specimen.pad_height)
    sector, core = (
        occ.addCylinder(0, 0, middle - half, 0, 0, 2 * half, radius, angle=2 * turn)
        for radius in (MM * specimen.mid_radius, inner)
    )
    ((_, pad),), _ = occ.cut([(3, sector)], [(3, core)])
    occ.synchronize()
    inwards = [
        tag
        for _, tag in gmsh.model.getBoundary(gmsh.model.getBoundary([(3, pad)], oriented=False), combined=False)
        if np.ptp(_radii(gmsh, tag)) > 0.5 * MM * specimen.pad_height
    ]
    ((_, pad),) = occ.fillet([pad], sorted({abs(tag) for tag in inwards}), [_widening(specimen)])
    occ.rotate([(3, pad)], 0, 0, 0, 0, 0, 1, direction - turn)
    return 3, pad


def _feet(gmsh: Any, specimen: PinchedTube) -> list[int]:
    """Curves around the feet of the pads."""
    foot = MM * (specimen.radius - specimen.wall)
    middle, half, near = MM * specimen.length / 2, _footprint(specimen), 1e-4 * foot
    result = []
    for _, tag in gmsh.model.getEntities(1):
        _, _, low, _, _, high = gmsh.model.getBoundingBox(1, tag)
        on_pad = middle - half - near < low and high < middle + half + near
        if on_pad and np.abs(_radii(gmsh, tag) - foot).max() < near:
            result.append(tag)
    return result


def _radii(gmsh: Any, curve: int) -> Any:
    """Distances from the axis of points along a curve, mm."""
    (low,), (high,) = gmsh.model.getParametrizationBounds(1, curve)
    points = np.reshape(gmsh.model.getValue(1, curve, np.linspace(low, high, 5)), (-1, 3))
    return np.hypot(points[:, 0], points[:, 1])
