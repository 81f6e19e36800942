"""The tube with fins as a CAD solid: wall, fins that pierce it, and hollow chambers on its inside."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.specimens import FinnedTube
from meshes.finned_size import chamber_volume, fin_volume, tube_volume
from meshes.tube_cad import MM

#: The device; without its chambers; the pneumatic actuator alone: a ring of the tube as long as its chambers.
CAD_PARTS = ("whole", "bare", "actuator")
_Solids = list[tuple[int, int]]


def finned_cad(gmsh: Any, specimen: FinnedTube, part: str = "whole", quarter: bool = False) -> None:
    """Put the device, or a ``part`` of it, into gmsh's model, mm, as one solid.

    Creases are sharp: the text has no fillets.  Chambers are closed: nor does it say how air gets into them.  A
    ``quarter`` is what the mirrors x = 0 and y = 0 leave.
    """
    occ = gmsh.model.occ
    low, high = _extent(specimen, part)
    body = _ring(gmsh, specimen.radius, specimen.inner_radius, low, high - low)
    if part != "actuator":
        fins = [_fin(gmsh, specimen)]
        fins.append(occ.copy(fins[0]))
        # By its own symmetry the same as its mirror image, whose surfaces would not be plain cylinders.
        occ.rotate(fins[1], 0, 0, 0, 0, 0, 1, np.pi)
        body, _ = occ.fuse(body, [*fins[0], *fins[1]])
    if part != "bare" and specimen.chambers.number:
        body = _with_chambers(gmsh, specimen, body)
    if quarter:
        size = 2 * MM * (specimen.length + specimen.radius + specimen.fin_length)
        body, _ = occ.intersect(body, [(3, occ.addBox(0, 0, -size, size, size, 3 * size))])
    occ.synchronize()


def cad_volume(specimen: FinnedTube, part: str = "whole") -> float:
    """Of ``finned_cad`` by integrals, m^3."""
    low, high = _extent(specimen, part)
    chambers = 0.0 if part == "bare" else 2 * specimen.chambers.number * chamber_volume(specimen)
    fins = 0.0 if part == "actuator" else 2 * fin_volume(specimen)
    return tube_volume(specimen) * (high - low) / specimen.length + fins + chambers


def face_names(gmsh: Any, specimen: FinnedTube) -> dict[str, list[int]]:
    """Faces of the bare device or its quarter by name, as edges in ``meshes.finned_tube``, and what those bound."""
    groups: dict[str, list[int]] = {}
    for _, tag in gmsh.model.getEntities(2):
        groups.setdefault(_face_name(gmsh, specimen, tag), []).append(tag)
    return groups


def _face_name(gmsh: Any, specimen: FinnedTube, tag: int) -> str:
    low, high = np.reshape(gmsh.model.getParametrizationBounds(2, tag), (2, 2))
    # Not a point of the face itself where that is trimmed, but of its plane or cylinder.
    share = np.array([[0.3, 0.4], [0.6, 0.3], [0.5, 0.7]])
    points = np.reshape(gmsh.model.getValue(2, tag, (low + share * (high - low)).ravel()), (-1, 3)) / MM
    near = 1e-6 * specimen.radius
    arms = np.abs(points) * [1.0, 0.0, 1.0] + points * [0.0, 1.0, 0.0]
    planes = {
        "lower end": points[:, 2], "upper end": points[:, 2] - specimen.length, "crest": points[:, 0],
        "side": points[:, 1], "tip": (arms - specimen.fin_centre) @ specimen.fin_axis - specimen.tip_along,
        "inside": np.hypot(*points.T[:2]) - specimen.inner_radius, "outside": np.hypot(*points.T[:2]) - specimen.radius,
    }  # fmt: skip
    return next((name for name, off in planes.items() if np.abs(off).max() < near), "fin")


def _extent(specimen: FinnedTube, part: str) -> tuple[float, float]:
    """z of the tube's ends, m."""
    if part != "actuator":
        return 0.0, specimen.length
    middle, half = specimen.length / 2, specimen.chambers.length / 2
    return middle - half, middle + half


def _ring(gmsh: Any, outside: float, inside: float, start: float, height: float) -> _Solids:
    """A piece of a tube about z, lengths in m; its seams at 45 deg, off all planes of symmetry."""
    occ = gmsh.model.occ
    solids = [(3, occ.addCylinder(0, 0, MM * start, 0, 0, MM * height, MM * radius)) for radius in (outside, inside)]
    occ.rotate(solids, 0, 0, 0, 0, 0, 1, np.pi / 4)
    ring, _ = occ.cut(solids[:1], solids[1:])
    return ring


def _fin(gmsh: Any, specimen: FinnedTube) -> _Solids:
    """The fin at +x; it reaches half-way into the wall, so that both share more than a face."""
    occ, axis = gmsh.model.occ, specimen.fin_axis
    psi = np.linspace(0.0, specimen.fin_arc / 2, 61)
    start = min(float(specimen.root_along(psi, specimen.face_radius(d)).min()) for d in (0.0, 1.0))
    start -= 3 * specimen.wall / np.sin(specimen.attachment_angle)
    concave, convex = (
        (3, occ.addCylinder(0, 0, 0, 0, 0, MM * (specimen.tip_along - start), MM * specimen.face_radius(d),
                            angle=specimen.fin_arc))
        for d in (0.0, 1.0)
    )  # fmt: skip
    fin, _ = occ.cut([convex], [concave])
    occ.rotate(fin, 0, 0, 0, 0, 0, 1, -specimen.fin_arc / 2)
    # What was +x becomes n, what was +z becomes a: a turn about +y by theta.
    occ.rotate(fin, 0, 0, 0, 0, 1, 0, specimen.attachment_angle)
    occ.translate(fin, *(MM * (specimen.fin_centre + start * axis)))
    far = MM * (specimen.length + specimen.radius + specimen.fin_length)
    core = occ.addCylinder(0, 0, -3 * far, 0, 0, 6 * far, MM * specimen.mid_radius)
    pieces, _ = occ.cut(fin, [(3, core)])
    largest = max(pieces, key=lambda piece: float(occ.getMass(*piece)))
    occ.remove([piece for piece in pieces if piece != largest], recursive=True)
    return [largest]


def _with_chambers(gmsh: Any, specimen: FinnedTube, body: _Solids) -> _Solids:
    occ, chambers = gmsh.model.occ, specimen.chambers
    top, wall, reach = specimen.inner_radius - chambers.height, chambers.wall, specimen.radius

    def boxes(width: float, length: float, bottom: float, outside: float) -> _Solids:
        """One in every chamber's place, from ``bottom`` out to the cylinder of radius ``outside``."""
        start, height = specimen.length / 2 - length / 2, reach - bottom
        solids = []
        for angle in np.concatenate([one := chambers.angles(specimen.inner_radius), one + np.pi]):
            solids.append((3, occ.addBox(*(MM * _box(bottom, -width / 2, start)), *(MM * _box(height, width, length)))))
            occ.rotate(solids[-1:], 0, 0, 0, 0, 0, 1, angle)
        core = occ.addCylinder(0, 0, MM * start, 0, 0, MM * length, MM * outside)
        occ.rotate([(3, core)], 0, 0, 0, 0, 0, 1, np.pi / 4)
        found, _ = occ.intersect(solids, [(3, core)])
        return found

    body, _ = occ.fuse(body, boxes(chambers.width, chambers.length, top, specimen.mid_radius))
    cavities = boxes(chambers.width - 2 * wall, chambers.length - 2 * wall, top + wall, specimen.inner_radius)
    body, _ = occ.cut(body, cavities)
    return body


def _box(*sizes: float) -> NDArray[np.float64]:
    return np.array(sizes)
