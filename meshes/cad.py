"""Specimens as CAD solids: STEP and STL, and meshes of tetrahedra of what those describe."""

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from lab.specimens import FinnedTube, PinchedTube, Specimen, TwistedBeam
from meshes.finned_cad import CAD_PARTS, face_names, finned_cad
from meshes.gathering import MeshError
from meshes.gmsh_session import appearing, gmsh_session
from meshes.tube_cad import MM, fillet_radius, tube_solid_cad

_SUFFIXES = (".step", ".stp", ".stl")
_TETRAHEDRON = 11  # gmsh's number of that with 10 nodes
#: Its edges by corner, in the order of its nodes 4 to 9.
_EDGES = ((0, 1), (1, 2), (2, 0), (3, 0), (2, 3), (1, 3))
#: Signed inverse condition number below which a tetrahedron is straightened.
_POOR = 0.05


def write_cad(specimen: Specimen, path: Path, deviation: float = 5e-5, part: str = "whole") -> dict[str, float]:
    """Write the solid as STEP or STL, by the suffix of ``path``; both in mm.

    A tube has its end blocks, and pads with fillets; a beam its twist, without what its tip carries; a tube with fins
    its hollow chambers, without load fins.

    Parameters
    ----------
    specimen
        Beam or tube.
    path
        ``.step``, ``.stp`` or ``.stl``; it appears whole or not at all.
    deviation
        Of an STL's triangles from the curved surface, about, m.
    part
        Of a tube with fins: whole, bare (without chambers), or its pneumatic actuator alone.

    Returns
    -------
    dict
        ``volume`` of the solid, m^3, and of an STL the number of ``triangles``.

    Raises
    ------
    MeshError
        An unknown suffix, a part that the specimen does not have, or what the CAD kernel cannot make.
    """
    if part not in CAD_PARTS:
        raise MeshError(f"part {part!r}: there is {', '.join(CAD_PARTS)}")
    if part != "whole" and not isinstance(specimen, FinnedTube):
        raise MeshError(f"part {part!r}: only a FinnedTube has it; a {specimen.kind} has the whole")
    if part == "actuator" and isinstance(specimen, FinnedTube) and not specimen.chambers.number:
        raise MeshError("part 'actuator': this tube has no chambers")
    if path.suffix.lower() not in _SUFFIXES:
        raise MeshError(f"CAD file {path.name!r}: the suffix must be one of {', '.join(_SUFFIXES)}")
    with appearing(path) as temporary, gmsh_session() as gmsh:
        figures = {"volume": _solid(gmsh, specimen, lambda: _whole(gmsh, specimen, part))}
        if path.suffix.lower() == ".stl":
            _triangles(gmsh, specimen, MM * deviation)
            figures["triangles"] = len(gmsh.model.mesh.getElementsByType(2)[0])
        with _silence():
            gmsh.write(str(temporary))
    return figures


def mesh_cad(
    specimen: PinchedTube | FinnedTube, path: Path, size: float, quarter: bool = False
) -> dict[str, float]:  # fmt: skip
    """Mesh the CAD solid of a tube with 10-node tetrahedra as gmsh MSH 4.1, m, to check structured meshes by.

    Of a pinched tube: the wall between the blocks, pads with real fillets; boundaries ``root``, ``tip``, ``inside``,
    ``outside``.  Of a tube with fins: without chambers; boundaries ``lower end``, ``upper end``, ``inside``,
    ``outside``, ``fin`` (the fins' faces and edges), ``tip``, and of its quarter ``crest`` (x = 0), ``side`` (y = 0).

    Parameters
    ----------
    specimen
        Its imperfection is left out.
    path
        File to write, suffix ``.msh``.
    size
        Length of edges, m; smaller at fillets.
    quarter
        Of a tube with fins: what the mirrors x = 0 and y = 0 leave.

    Returns
    -------
    dict
        ``elements``, ``nodes``, ``min_sicn`` as of ``make_mesh``, ``volume`` of the solid, m^3, and how many
        tetrahedra are ``straightened`` because they folded on the curved faces.
    """
    finned = isinstance(specimen, FinnedTube)
    if quarter and not finned:
        raise MeshError("a quarter is of a tube with fins")
    with appearing(path) as temporary, gmsh_session() as gmsh:
        if isinstance(specimen, FinnedTube):
            bare, least = specimen, size
            figures = {"volume": _solid(gmsh, bare, lambda: finned_cad(gmsh, bare, "bare", quarter))}
            groups = face_names(gmsh, specimen)
        else:
            wall, least = specimen, min(size, specimen.pad_height or size)
            figures = {"volume": _solid(gmsh, wall, lambda: tube_solid_cad(gmsh, wall, blocks=False))}
            groups = _face_names(gmsh, specimen)
        for name, faces in groups.items():
            gmsh.model.addPhysicalGroup(2, faces, name=name)
        gmsh.model.addPhysicalGroup(3, [tag for _, tag in gmsh.model.getEntities(3)], name="body")
        _sizes(gmsh, MM * size, MM * least / 2, around=24)
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.setOrder(2)
        figures |= {"straightened": _unfold(gmsh)}
        tags, _ = gmsh.model.mesh.getElementsByType(_TETRAHEDRON)
        figures |= {"elements": len(tags), "nodes": len(gmsh.model.mesh.getNodes()[0])}
        figures["min_sicn"] = float(np.min(gmsh.model.mesh.getElementQualities(tags, "minSICN")))
        gmsh.option.setNumber("Mesh.ScalingFactor", 1 / MM)
        gmsh.write(str(temporary))
    return figures


def _whole(gmsh: Any, specimen: Specimen, part: str) -> None:
    if isinstance(specimen, PinchedTube):
        tube_solid_cad(gmsh, specimen, blocks=True)
    elif isinstance(specimen, FinnedTube):
        finned_cad(gmsh, specimen, part)
    else:
        _beam(gmsh, specimen)


def _solid(gmsh: Any, specimen: Specimen, make: Callable[[], None]) -> float:
    """One solid in gmsh's model, mm; its volume, m^3."""
    try:
        make()
    except Exception as error:  # gmsh raises nothing narrower
        raise MeshError(f"the CAD kernel cannot make this {specimen.kind}: {error}") from error
    solids = gmsh.model.getEntities(3)
    if len(solids) != 1:
        raise MeshError(f"the CAD kernel made {len(solids)} solids of this {specimen.kind} instead of one")
    return float(gmsh.model.occ.getMass(*solids[0])) / MM**3


def _beam(gmsh: Any, specimen: TwistedBeam) -> None:
    """The twisted beam, lofted through sections 3 deg apart."""
    occ = gmsh.model.occ
    count = 2 + int(abs(np.rad2deg(specimen.twist)) / 3)
    width, thickness, length = MM * specimen.width, MM * specimen.thickness, MM * specimen.length
    sections = []
    for x in np.linspace(0.0, length, count):
        angle = float(specimen.section_angle(x / MM))
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * [width / 2, thickness / 2] @ turn.T
        points = [occ.addPoint(x, y, z) for y, z in corners]
        sides = [occ.addLine(points[n], points[(n + 1) % 4]) for n in range(4)]
        sections.append(occ.addWire(sides, checkClosed=True))
    occ.addThruSections(sections, makeSolid=True)
    # Else the sections' lines would stand beside the solid.
    occ.synchronize()
    occ.remove([(1, tag) for _, tag in occ.getEntities(1)], recursive=True)
    occ.synchronize()


def _triangles(gmsh: Any, specimen: Specimen, deviation: float) -> None:
    if isinstance(specimen, PinchedTube):
        large, small = MM * specimen.radius, fillet_radius(specimen) or MM * specimen.radius
    elif isinstance(specimen, FinnedTube):
        large = small = MM * specimen.radius
    else:
        large = small = MM * specimen.width / 2
    # A chord s lies s^2 / (8 r) off an arc of radius r.
    longest, shortest = (float(np.sqrt(8 * radius * deviation)) for radius in (large, small))
    _sizes(gmsh, longest, shortest, around=36)
    # Small edges must not make the broad faces between them fine: several times the triangles.
    gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0)
    gmsh.option.setNumber("Mesh.Algorithm", 5)
    gmsh.option.setNumber("Mesh.Binary", 1)
    gmsh.model.mesh.generate(2)
    # Faces of hollows look into them.
    gmsh.model.mesh.setOutwardOrientation(gmsh.model.getEntities(3)[0][1])


def _sizes(gmsh: Any, longest: float, shortest: float, around: int) -> None:
    for name, value in (("SizeMax", longest), ("SizeMin", shortest), ("SizeFromCurvature", around)):
        gmsh.option.setNumber(f"Mesh.Mesh{name}", value)


def _unfold(gmsh: Any) -> int:
    """Straighten the edges of tetrahedra that the curved faces fold; how many."""
    mesh = gmsh.model.mesh
    tags, nodes = mesh.getElementsByType(_TETRAHEDRON)
    nodes = nodes.reshape(-1, 10)
    numbers, coordinates, _ = mesh.getNodes()
    places = np.empty((int(numbers.max()) + 1, 3))
    places[numbers] = coordinates.reshape(-1, 3)
    treated = np.zeros(len(tags), dtype=bool)
    # Neighbours, which the straightened edges bend, may need the same in turn.
    while (poor := np.flatnonzero((mesh.getElementQualities(tags, "minSICN") < _POOR) & ~treated)).size:
        treated[poor] = True
        for corners, middles in ((cell[:4], cell[4:]) for cell in nodes[poor]):
            for (one, other), middle in zip(_EDGES, middles, strict=True):
                mesh.setNode(middle, places[corners[[one, other]]].mean(axis=0), [])
    return int(treated.sum())


def _face_names(gmsh: Any, specimen: PinchedTube) -> dict[str, list[int]]:
    groups: dict[str, list[int]] = {"root": [], "tip": [], "inside": [], "outside": []}
    length, near = MM * specimen.length, 1e-3 * MM * specimen.wall
    for _, tag in gmsh.model.getEntities(2):
        low, high = np.reshape(gmsh.model.getParametrizationBounds(2, tag), (2, 2))
        x, y, z = gmsh.model.getValue(2, tag, (low + high) / 2)
        flat = gmsh.model.getType(2, tag) == "Plane"
        if flat and min(abs(z), abs(z - length)) < near:
            groups["root" if abs(z) < near else "tip"].append(tag)
        else:
            groups["outside" if abs(np.hypot(x, y) - MM * specimen.radius) < near else "inside"].append(tag)
    return groups


@contextmanager
def _silence() -> Iterator[None]:
    """Nothing on the process's standard output: the kernel's STEP writer reports there, whatever gmsh is told."""
    kept = os.dup(1)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 1)
        yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)
        os.close(nowhere)
