"""Specimens as gmsh meshes: a straight block or strip of elements, its nodes then moved to their places."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from lab.specimens import FinnedTube, PinchedTube, Specimen
from meshes.finned_size import surface_area
from meshes.finned_tube import PARTS, FinnedPart, Sheet, sheets
from meshes.gathering import MeshError
from meshes.gmsh_session import appearing, gmsh_session
from meshes.options import MeshOptions
from meshes.tube import Part, tube_image
from meshes.tube_size import wall_area, wall_volume
from meshes.twist import helicoid_area, twisted

Array = NDArray[np.float64]
#: Solid: the whole body in hexahedra; shell: its middle surface in quadrilaterals.
Element = Literal["solid", "shell"]
_GMSH_TYPE = {"solid": 12, "shell": 10}  # gmsh's numbers of the 27-node hexahedron and the 9-node quadrilateral


@dataclass(frozen=True)
class _Image:
    """A body, or one of several, as an image of the unit cube, of its middle plane for a shell.

    Parameters
    ----------
    counts
        Elements along the parameters.
    faces
        Names of the faces 0 and 1 of every parameter, "" for none.
    place
        Positions (n, 3), m, of parameters (n, 3).
    size
        Exact volume (area), m^3 (m^2).
    closed
        The faces 0 and 1 of the first parameter are one.
    body
        Name of the body.
    """

    counts: tuple[int, int, int]
    faces: tuple[str, ...]
    place: Callable[[Array], Array]
    size: float
    closed: bool = False
    body: str = "body"


def quality_path(path: Path) -> Path:
    """Where the quality figures of the mesh ``path`` lie."""
    return path.with_name(f"{path.stem}.quality.json")


def make_mesh(
    specimen: Specimen, options: MeshOptions, path: Path, element: Element = "solid", part: Part | FinnedPart = "whole"
) -> dict[str, Any]:
    """Mesh ``specimen`` with complete quadratic cells and write it as gmsh MSH 4.1.

    Every node lies exactly in its place; volume or area differ from the specimen's only by what quadratic
    elements cannot follow between nodes.  The file and its quality figures appear whole or not at all.

    Parameters
    ----------
    specimen
        Beam or tube; lengths in m.
    options
        Numbers of elements.
    path
        File to write, suffix ``.msh``.
    element
        27-node hexahedra of the body, or 9-node quadrilaterals of its middle surface.
    part
        Of a tube; see ``meshes.tube.tube_surface`` and ``meshes.finned_tube.finned_surface``.

    Returns
    -------
    dict
        Quality figures as in ``quality_path(path)``: ``elements``, ``nodes``, ``min_scaled_jacobian``,
        ``max_scaled_jacobian``, ``min_sicn`` (gmsh's signed inverse condition number), ``max_aspect_ratio``
        (longest over shortest corner edge), and ``volume`` (m^3) of a solid or ``area`` (m^2) of a surface with
        ``volume_deviation`` or ``area_deviation`` (relative to the specimen's).

    Raises
    ------
    MeshError
        Numbers of elements, a part or an element that the specimen cannot have.
    """
    images = _images(specimen, options, element, part)
    with appearing(path) as temporary, gmsh_session() as gmsh:
        bodies = _straight(gmsh, images, element)
        _move(gmsh, images, bodies, element)
        figures = _quality(gmsh, sum(image.size for image in images), element)
        gmsh.write(str(temporary))
        with appearing(quality_path(path)) as text:
            text.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")
    return figures


def _images(
    specimen: Specimen, options: MeshOptions, element: Element, part: Part | FinnedPart
) -> tuple[_Image, ...]:  # fmt: skip
    if isinstance(specimen, FinnedTube):
        return _finned(specimen, options, element, part)
    solid = element == "solid"
    if isinstance(specimen, PinchedTube):
        if part not in ("whole", "eighth"):
            raise MeshError(f"part {part!r}: a pinched tube has the whole and an eighth")
        counts, faces, place = tube_image(specimen, options, part)
        size = (wall_volume if solid else wall_area)(specimen, part)
        return (_Image(counts, faces, lambda at: place(*at.T), size, closed=part == "whole"),)
    if part != "whole":
        raise MeshError(f"part {part!r}: a twisted beam has no such symmetry; only the whole")
    return (
        _Image(
            (options.along, options.across, options.through),
            ("root", "tip", "sides", "sides", "sides", "sides"),
            lambda at: twisted(at, specimen, options),
            specimen.area * specimen.length if solid else helicoid_area(specimen),
        ),
    )


def _finned(
    specimen: FinnedTube, options: MeshOptions, element: Element, part: Part | FinnedPart
) -> tuple[_Image, ...]:  # fmt: skip
    """Tube and fins as sheets of their own."""
    if element == "solid":
        raise MeshError(
            "a tube with fins has no mesh of hexahedra, which cannot follow its creases: choose element shell; "
            "meshes.mesh_cad makes tetrahedra of its CAD solid"
        )
    if part == "eighth":
        raise MeshError(f"part {part!r}: a tube with fins has {', '.join(PARTS)}")

    def image(sheet: Sheet) -> _Image:
        counts = (*sheet.counts, 1)
        area = surface_area(specimen, sheet.body, part)
        return _Image(counts, sheet.edges, lambda at: sheet.place(at[:, 0], at[:, 1]), area, sheet.closed, sheet.body)

    return tuple(image(sheet) for sheet in sheets(specimen, options, part))


def _straight(gmsh: Any, images: tuple[_Image, ...], element: Element) -> list[int]:
    """Unit cubes or squares above one another, extruded from points, with their groups; their tags."""
    dim = 3 if element == "solid" else 2
    groups: dict[str, list[int]] = {}
    bodies = []
    for number, image in enumerate(images):
        geo = gmsh.model.geo
        point = geo.addPoint(0.0, 0.0, 2.0 * number)
        (_, root), *_ = geo.extrude([(0, point)], 0, 1, 0, [image.counts[1]], recombine=True)[1:]
        if element == "solid":
            _, (_, root), *_ = geo.extrude([(1, root)], 0, 0, 1, [image.counts[2]], recombine=True)
        _, (_, body), *_ = geo.extrude([(dim - 1, root)], 1, 0, 0, [image.counts[0]], recombine=True)
        geo.synchronize()
        gmsh.model.addPhysicalGroup(dim, [body], name=image.body)
        for _, tag in gmsh.model.getBoundary([(dim, body)], oriented=False):
            box = np.array(gmsh.model.getBoundingBox(dim - 1, tag)).reshape(2, 3)
            axis = int(np.argmin(np.ptp(box, axis=0)[:dim]))
            if name := image.faces[2 * axis + round(box[0, axis])]:
                groups.setdefault(name, []).append(tag)
        bodies.append(body)
    for name, tags in groups.items():
        gmsh.model.addPhysicalGroup(dim - 1, tags, name=name)
    gmsh.model.mesh.generate(dim)
    gmsh.model.mesh.setOrder(2)
    if element == "shell":
        # The upper side is that of the solid: +c where a and b turn right-handed.
        gmsh.model.mesh.reverse([(2, body) for body in bodies])
    return bodies


def _move(gmsh: Any, images: tuple[_Image, ...], bodies: list[int], element: Element) -> None:
    for image, body in zip(images, bodies, strict=True):
        tags, coordinates, _ = gmsh.model.mesh.getNodes(3 if element == "solid" else 2, body, includeBoundary=True)
        unit = coordinates.reshape(-1, 3)
        if element == "shell":
            unit[:, 2] = 0.5
        for tag, place in zip(tags, image.place(unit), strict=True):
            gmsh.model.mesh.setNode(tag, place, [])
    if any(image.closed for image in images):
        gmsh.model.mesh.removeDuplicateNodes()


def _quality(gmsh: Any, exact: float, element: Element) -> dict[str, Any]:
    mesh, number = gmsh.model.mesh, _GMSH_TYPE[element]
    tags, _ = mesh.getElementsByType(number)
    scaled, sicn = (mesh.getElementQualities(tags, name) for name in ("minSJ", "minSICN"))
    longest, shortest = (mesh.getElementQualities(tags, name) for name in ("maxEdge", "minEdge"))
    local, weights = mesh.getIntegrationPoints(number, "Gauss5")
    _, determinants, _ = mesh.getJacobians(number, local)
    size = float((determinants.reshape(len(tags), -1) @ weights).sum())
    name = "volume" if element == "solid" else "area"
    return {
        "elements": len(tags),
        "nodes": len(mesh.getNodes()[0]),
        "min_scaled_jacobian": float(np.min(scaled)),
        "max_scaled_jacobian": float(np.max(scaled)),
        "min_sicn": float(np.min(sicn)),
        "max_aspect_ratio": float(np.max(longest / shortest)),
        name: size,
        f"{name}_deviation": size / exact - 1.0,
    }
