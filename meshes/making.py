"""The twisted beam as a gmsh mesh: straight elements, their nodes then moved onto the twist."""

import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from lab.specimens import TwistedBeam
from meshes.options import MeshOptions

#: Solid: the whole body in hexahedra; shell: its middle surface in quadrilaterals.
Element = Literal["solid", "shell"]
_GMSH_TYPE = {"solid": 12, "shell": 10}  # gmsh's numbers of the 27-node hexahedron and the 9-node quadrilateral


def quality_path(path: Path) -> Path:
    """Where the quality figures of the mesh ``path`` lie."""
    return path.with_name(f"{path.stem}.quality.json")


def make_mesh(specimen: TwistedBeam, options: MeshOptions, path: Path, element: Element = "solid") -> dict[str, Any]:
    """Mesh ``specimen`` with complete quadratic cells and write it as gmsh MSH 4.1.

    Every node lies on the exact twisted section of its ``x``; volume or area differ from the specimen's
    only by what quadratic elements cannot follow between nodes.  The file and its quality figures
    appear whole or not at all.

    Parameters
    ----------
    specimen
        The beam; lengths in m.
    options
        Numbers of elements.
    path
        File to write, suffix ``.msh``.
    element
        27-node hexahedra of the body, or 9-node quadrilaterals of its middle surface.

    Returns
    -------
    dict
        Quality figures as in ``quality_path(path)``: ``elements``, ``nodes``, ``min_scaled_jacobian``,
        ``max_scaled_jacobian``, ``min_sicn`` (gmsh's signed inverse condition number), ``max_aspect_ratio``
        (longest over shortest corner edge), and ``volume`` (m^3) of a solid or ``area`` (m^2) of a surface with
        ``volume_deviation`` or ``area_deviation`` (relative to the specimen's).
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.stem}.{os.getpid()}.tmp.msh")
    try:
        with _gmsh_session() as gmsh:
            _straight(gmsh, specimen, options, element)
            _twist(gmsh, specimen, options)
            figures = _quality(gmsh, specimen, element)
            gmsh.write(str(temporary))
        _replace_text(quality_path(path), json.dumps(figures, indent=1) + "\n")
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)
    return figures


@contextmanager
def _gmsh_session() -> Iterator[Any]:
    import gmsh

    gmsh.initialize(["-noenv"], readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Mesh.MshFileVersion", 4.1)
        gmsh.option.setNumber("Mesh.SecondOrderIncomplete", 0)
        yield gmsh
    finally:
        gmsh.finalize()


def _straight(gmsh: Any, specimen: TwistedBeam, options: MeshOptions, element: Element) -> None:
    """Straight block or strip from the origin, extruded from a point, with its groups."""
    geo = gmsh.model.geo
    point = geo.addPoint(0.0, 0.0, 0.0)
    (_, root), *_ = geo.extrude([(0, point)], 0, specimen.width, 0, [options.across], recombine=True)[1:]
    if element == "solid":
        _, (_, root), *_ = geo.extrude([(1, root)], 0, 0, specimen.thickness, [options.through], recombine=True)
    dim = 3 if element == "solid" else 2
    swept = geo.extrude([(dim - 1, root)], specimen.length, 0, 0, [options.along], recombine=True)
    (_, tip), (_, body), *sides = swept
    geo.synchronize()
    for size, tags, name in (
        (dim, [body], "body"), (dim - 1, [root], "root"), (dim - 1, [tip], "tip"),
        (dim - 1, [abs(tag) for _, tag in sides], "sides"),
    ):  # fmt: skip
        gmsh.model.addPhysicalGroup(size, tags, name=name)
    gmsh.model.mesh.generate(dim)
    gmsh.model.mesh.setOrder(2)
    if element == "shell":
        # The upper side is that of the solid: +z where the width lies along +y.
        gmsh.model.mesh.reverse([(2, body)])


def graded(place: NDArray[np.float64], grading: float, elements: int) -> NDArray[np.float64]:
    """Places on 0..1 crowded to both ends: ends of ``elements`` even ones go to x - grading sin(2 pi x) / (2 pi).

    Nodes between them stay half-way: quadratic elements fold when their middle nodes move off too far.
    """
    ends = np.linspace(0.0, 1.0, elements + 1)
    return np.interp(place, ends, ends - grading * np.sin(2 * np.pi * ends) / (2 * np.pi))


def twisted(points: NDArray[np.float64], specimen: TwistedBeam, options: MeshOptions) -> NDArray[np.float64]:
    """Points of the unit cube on the beam, graded, each turned with the section of its ``x``; (n, 3), m."""
    x = specimen.length * graded(points[:, 0], options.grading_along, options.along)
    y = specimen.width * (graded(points[:, 1], options.grading_across, options.across) - 0.5)
    z = specimen.thickness * (points[:, 2] - 0.5)
    angle = specimen.section_angle(x)
    return np.column_stack([x, np.cos(angle) * y - np.sin(angle) * z, np.sin(angle) * y + np.cos(angle) * z])


def thickness_directions(specimen: TwistedBeam, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Unit vectors (n, 3) along which the thickness is measured: across the width, in the plane of the section.

    Not the normal of the middle surface, which the twist tilts out of that plane.
    """
    angle = specimen.section_angle(points[:, 0])
    return np.column_stack([np.zeros(len(points)), -np.sin(angle), np.cos(angle)])


def _twist(gmsh: Any, specimen: TwistedBeam, options: MeshOptions) -> None:
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    unit = coordinates.reshape(-1, 3) / [specimen.length, specimen.width, specimen.thickness]
    if gmsh.model.getDimension() == 2:
        unit[:, 2] = 0.5
    for tag, place in zip(tags, twisted(unit, specimen, options), strict=True):
        gmsh.model.mesh.setNode(tag, place, [])


def _quality(gmsh: Any, specimen: TwistedBeam, element: Element) -> dict[str, Any]:
    mesh, number = gmsh.model.mesh, _GMSH_TYPE[element]
    tags, _ = mesh.getElementsByType(number)
    scaled, sicn = (mesh.getElementQualities(tags, name) for name in ("minSJ", "minSICN"))
    longest, shortest = (mesh.getElementQualities(tags, name) for name in ("maxEdge", "minEdge"))
    local, weights = mesh.getIntegrationPoints(number, "Gauss5")
    _, determinants, _ = mesh.getJacobians(number, local)
    size = float((determinants.reshape(len(tags), -1) @ weights).sum())
    name, exact = ("volume", specimen.area * specimen.length) if element == "solid" else ("area", _helicoid(specimen))
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


def _helicoid(specimen: TwistedBeam) -> float:
    """Area of the twisted middle surface: integral of sqrt(1 + (rate y)^2) over x and y, m^2."""
    edge = abs(specimen.twist) / specimen.length * specimen.width / 2
    mean = (np.sqrt(1 + edge**2) + (np.arcsinh(edge) / edge if edge > 1e-9 else 1.0)) / 2
    return float(specimen.length * specimen.width * mean)


def _replace_text(path: Path, text: str) -> None:
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    temporary.write_text(text, encoding="utf-8")
    os.replace(temporary, path)
