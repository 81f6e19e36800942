"""The twisted beam as a gmsh mesh: a straight block in elements, its nodes then moved onto the twist."""

import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.specimens import TwistedBeam
from meshes.options import MeshOptions

_HEX27 = 12  # gmsh's element type number


def quality_path(path: Path) -> Path:
    """Where the quality figures of the mesh ``path`` lie."""
    return path.with_name(f"{path.stem}.quality.json")


def make_mesh(specimen: TwistedBeam, options: MeshOptions, path: Path) -> dict[str, Any]:
    """Mesh ``specimen`` with complete quadratic hexahedra and write it as gmsh MSH 4.1.

    Every node lies on the exact twisted section of its ``x``; the volume differs from w t L only
    by what quadratic elements cannot follow between nodes.  The file and its quality figures
    appear whole or not at all.

    Parameters
    ----------
    specimen
        The beam; lengths in m.
    options
        Numbers of elements.
    path
        File to write, suffix ``.msh``.

    Returns
    -------
    dict
        Quality figures as in ``quality_path(path)``: ``elements``, ``nodes``, ``min_scaled_jacobian``,
        ``max_scaled_jacobian``, ``min_sicn`` (gmsh's signed inverse condition number), ``max_aspect_ratio``
        (longest over shortest corner edge), ``volume`` (m^3), ``volume_deviation`` (relative to w t L).
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.stem}.{os.getpid()}.tmp.msh")
    try:
        with _gmsh_session() as gmsh:
            _block(gmsh, specimen, options)
            _twist(gmsh, specimen, options)
            figures = _quality(gmsh, specimen)
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


def _block(gmsh: Any, specimen: TwistedBeam, options: MeshOptions) -> None:
    """Straight block from the origin, extruded point to line to section to body, with its groups."""
    geo = gmsh.model.geo
    point = geo.addPoint(0.0, 0.0, 0.0)
    (_, line), *_ = geo.extrude([(0, point)], 0, specimen.width, 0, [options.across], recombine=True)[1:]
    _, (_, root), *_ = geo.extrude([(1, line)], 0, 0, specimen.thickness, [options.through], recombine=True)
    swept = geo.extrude([(2, root)], specimen.length, 0, 0, [options.along], recombine=True)
    (_, tip), (_, body), *sides = swept
    geo.synchronize()
    for dim, tags, name in (
        (3, [body], "body"), (2, [root], "root"), (2, [tip], "tip"), (2, [tag for _, tag in sides], "sides"),
    ):  # fmt: skip
        gmsh.model.addPhysicalGroup(dim, tags, name=name)
    gmsh.model.mesh.generate(3)
    gmsh.model.mesh.setOrder(2)


def graded(place: NDArray[np.float64], grading: float) -> NDArray[np.float64]:
    """Places on 0..1 crowded to both ends: x - grading sin(2 pi x) / (2 pi)."""
    return place - grading * np.sin(2 * np.pi * place) / (2 * np.pi)


def twisted(points: NDArray[np.float64], specimen: TwistedBeam, options: MeshOptions) -> NDArray[np.float64]:
    """Points of the unit cube on the beam, graded, each turned with the section of its ``x``; (n, 3), m."""
    x = specimen.length * graded(points[:, 0], options.grading_along)
    y = specimen.width * (graded(points[:, 1], options.grading_across) - 0.5)
    z = specimen.thickness * (points[:, 2] - 0.5)
    angle = specimen.section_angle(x)
    return np.column_stack([x, np.cos(angle) * y - np.sin(angle) * z, np.sin(angle) * y + np.cos(angle) * z])


def _twist(gmsh: Any, specimen: TwistedBeam, options: MeshOptions) -> None:
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    sizes = [specimen.length, specimen.width, specimen.thickness]
    for tag, place in zip(tags, twisted(coordinates.reshape(-1, 3) / sizes, specimen, options), strict=True):
        gmsh.model.mesh.setNode(tag, place, [])


def _quality(gmsh: Any, specimen: TwistedBeam) -> dict[str, Any]:
    mesh = gmsh.model.mesh
    tags, _ = mesh.getElementsByType(_HEX27)
    scaled, sicn = (mesh.getElementQualities(tags, name) for name in ("minSJ", "minSICN"))
    longest, shortest = (mesh.getElementQualities(tags, name) for name in ("maxEdge", "minEdge"))
    local, weights = mesh.getIntegrationPoints(_HEX27, "Gauss5")
    _, determinants, _ = mesh.getJacobians(_HEX27, local)
    volume = float((determinants.reshape(len(tags), -1) @ weights).sum())
    exact = specimen.area * specimen.length
    return {
        "elements": len(tags),
        "nodes": len(mesh.getNodes()[0]),
        "min_scaled_jacobian": float(np.min(scaled)),
        "max_scaled_jacobian": float(np.max(scaled)),
        "min_sicn": float(np.min(sicn)),
        "max_aspect_ratio": float(np.max(longest / shortest)),
        "volume": volume,
        "volume_deviation": volume / exact - 1.0,
    }


def _replace_text(path: Path, text: str) -> None:
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    temporary.write_text(text, encoding="utf-8")
    os.replace(temporary, path)
