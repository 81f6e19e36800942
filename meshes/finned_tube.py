"""The tube with fins as middle surfaces: a cylinder and two curved fins that end on its outside.

Tube and fins are unconnected sheets of one mesh.  Where a fin ends, the nodes of both its layers coincide with nodes
of the tube's outer layer: mesh lines of the tube run along the curves in which the fin's two faces meet it, and other
mesh lines cross them at the fin's columns.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from lab.specimens import FinnedTube
from meshes.finned_grid import QuarterGrid, quarter_grid
from meshes.gathering import QUADRILATERAL, element_places, gathered
from meshes.layered import edge_nodes
from meshes.options import MeshOptions
from meshes.structured import surface_mesh

if TYPE_CHECKING:
    from skfem import MeshQuad2

Array = NDArray[np.float64]
#: The whole device; y >= 0; x >= 0; both.
FinnedPart = Literal["whole", "half", "half-x", "quarter"]
PARTS: tuple[FinnedPart, ...] = ("whole", "half", "half-x", "quarter")
#: Bodies of the mesh: its subdomains.
Body = Literal["tube", "fin", "other fin"]
BODIES: tuple[Body, ...] = ("tube", "fin", "other fin")

#: Over so many thicknesses from the root the directors of a fin turn from oblique to normal.
_TURNING = 6.0


@dataclass(frozen=True)
class Sheet:
    """A middle surface as an image of the unit square: around and along, so that its upper side is the convex one.

    Parameters
    ----------
    body
        Name of the subdomain.
    counts
        Elements around and along.
    edges
        Names of the edges a = 0, a = 1, b = 0, b = 1; "" for none.
    place
        Positions (n, 3), m, of parameters a, b (n,).
    closed
        The edges a = 0 and a = 1 are one.
    """

    body: Body
    counts: tuple[int, int]
    edges: tuple[str, str, str, str]
    place: Callable[[Array, Array], Array]
    closed: bool = False

    def mesh(self) -> "MeshQuad2":
        """The sheet alone."""
        return surface_mesh(self.counts, self.place, self.edges, self.closed)


def finned_surface(specimen: FinnedTube, options: MeshOptions, part: FinnedPart = "whole") -> "MeshQuad2":
    """Middle surfaces of tube and fins as one mesh; normals point outwards, of fins to their convex side.

    Parameters
    ----------
    specimen
        Lengths in m.
    options
        ``along`` elements over the tube's length, ``across`` over a quarter of its circumference; the fins' follow
        from both.  ``grading_along`` crowds them to the crease.
    part
        Half is what the mirror y = 0 leaves (y >= 0), half-x what x = 0 leaves (x >= 0), quarter both.

    Returns
    -------
    MeshQuad2
        Subdomains ``tube``, ``fin`` (at +x) and ``other fin``, unconnected; edges ``lower end`` (z = 0) and
        ``upper end`` of the tube, ``crease`` (root), ``tip`` and ``fin edge`` of the fins, and where mirrors cut
        ``crest`` (x = 0) and ``side`` (y = 0).

    Raises
    ------
    MeshError
        Too few elements.
    """
    meshes = {sheet.body: sheet.mesh() for sheet in sheets(specimen, options, part)}
    corners, places = [], []
    boundaries: dict[str, list[NDArray[np.int64]]] = {}
    subdomains: dict[str, NDArray[np.int64]] = {}
    nodes, cells = 0, 0
    for body, mesh in meshes.items():
        count = mesh.t.shape[1]
        corners.append(nodes + mesh.t.T.astype(np.int64))
        places.append(element_places(mesh))
        for name, facets in (mesh.boundaries or {}).items():
            boundaries.setdefault(name, []).append(nodes + mesh.facets[:, facets].T.astype(np.int64))
        subdomains[body] = np.arange(cells, cells + count)
        nodes, cells = nodes + int(mesh.t.max()) + 1, cells + count
    return gathered(
        QUADRILATERAL, np.concatenate(corners), np.concatenate(places),
        {name: np.concatenate(found) for name, found in boundaries.items()}, subdomains,
    )  # fmt: skip


def sheets(specimen: FinnedTube, options: MeshOptions, part: FinnedPart = "whole") -> tuple[Sheet, ...]:
    """The unconnected sheets of ``finned_surface``, tube first; errors as there."""
    grid = quarter_grid(specimen, options)
    low, high = {"whole": (0, 4), "half": (0, 2), "half-x": (-1, 1), "quarter": (0, 1)}[part]
    cuts = {"whole": ("", ""), "half": ("side", "side"), "half-x": ("crest", "crest"), "quarter": ("side", "crest")}

    def wall(a: Array, b: Array) -> Array:
        return _wall(specimen, grid, grid.across * (low + (high - low) * a), grid.along * b)

    rows = ("lower end", "upper end")
    tube = Sheet(
        "tube", ((high - low) * grid.across, grid.along), (*cuts[part], *rows), wall, closed=part == "whole"
    )  # fmt: skip
    cut = part in ("half", "quarter")
    sides = {1: "side" if cut else "fin edge", -1: "fin edge"}
    counts = (grid.fin_across * (1 if cut else 2), grid.fin_along)

    def fin(mirrored: bool) -> Callable[[Array, Array], Array]:
        def place(a: Array, b: Array) -> Array:
            turn = 1.0 - a if mirrored else a
            found = _fin(specimen, grid, specimen.fin_arc / 2 * (turn if cut else 2.0 * turn - 1.0), b)
            return found * [-1.0, 1.0, 1.0] if mirrored else found

        return place

    ends = ("crease", "tip")
    result = [tube, Sheet("fin", counts, (sides[1], sides[-1], *ends), fin(False))]
    if part in ("whole", "half"):
        result.append(Sheet("other fin", counts, (sides[-1], sides[1], *ends), fin(True)))
    return tuple(result)


def half_thickness(specimen: FinnedTube, points: Array, body: Body) -> Array:
    """Vectors from the middle surface of a ``body`` to its upper (convex) face (n, 3), m.

    Radial on the tube and on the fins, but oblique towards a fin's root, whose faces end on the tube's outside.

    Parameters
    ----------
    points
        Nodes of the middle surface at rest (n, 3), m.
    """
    if body == "tube":
        radial = points * [1.0, 1.0, 0.0]
        return specimen.wall / 2 * radial / np.linalg.norm(radial, axis=1, keepdims=True)
    if body == "other fin":
        return half_thickness(specimen, points * [-1.0, 1.0, 1.0], "fin") * [-1.0, 1.0, 1.0]
    psi, s = fin_parameters(specimen, points)
    across = np.outer(np.cos(psi), specimen.fin_normal) + np.outer(np.sin(psi), [0.0, 1.0, 0.0])
    concave, convex = (specimen.root_along(psi, specimen.face_radius(depth)) for depth in (0.0, 1.0))
    off = np.maximum(s - (concave + convex) / 2, 0.0)
    reach = min(_TURNING * specimen.fin_thickness, float((specimen.tip_along - np.maximum(concave, convex)).min()))
    lean = (convex - concave) / 2 * np.maximum(1.0 - off / reach, 0.0) ** 2
    return specimen.fin_thickness / 2 * across + lean[:, None] * specimen.fin_axis


def fin_middle(specimen: FinnedTube, fin: "MeshQuad2") -> Array:
    """Nodes between the faces of a solid fin (n, 3), m: on its middle surface, but at the root on the tube's outside.

    There they meet nodes of the wall, as those of the faces do.
    """
    places, root = fin.doflocs.T.copy(), edge_nodes(fin, "crease")
    places[root, :2] *= specimen.radius / np.linalg.norm(places[root, :2], axis=1, keepdims=True)
    return places


def fin_parameters(specimen: FinnedTube, points: Array) -> tuple[Array, Array]:
    """psi, rad (n,), and s, m (n,), of points (n, 3), m, of the fin at +x at rest."""
    arms = points - specimen.fin_centre
    return np.arctan2(arms[:, 1], arms @ specimen.fin_normal), arms @ specimen.fin_axis


def _wall(specimen: FinnedTube, grid: QuarterGrid, column: Array, row: Array) -> Array:
    """Middle of the tube's wall; columns count from +x about +z, a quarter of the circumference each ``across``."""
    quadrant, rest = np.divmod(column, grid.across)
    quadrant = quadrant.astype(int) % 4
    backwards = quadrant % 2 == 1
    angle, z = grid.wall(np.where(backwards, grid.across - rest, rest), row)
    x = np.where((quadrant == 1) | (quadrant == 2), -1.0, 1.0) * np.cos(angle)
    y = np.where(quadrant >= 2, -1.0, 1.0) * np.sin(angle)
    return np.column_stack([specimen.mid_radius * x, specimen.mid_radius * y, z])


def _fin(specimen: FinnedTube, grid: QuarterGrid, psi: Array, share: Array) -> Array:
    """Middle of the fin at +x; ``share`` 0 at the root, 1 at the tip, in even elements before they crowd."""
    faces = [specimen.root_along(psi, specimen.face_radius(depth)) for depth in (0.0, 1.0)]
    root = (faces[0] + faces[1]) / 2
    return specimen.fin_places(psi, root + grid.fin_share(share) * (specimen.tip_along - root))
