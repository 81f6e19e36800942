"""Surfaces and solids on a grid of parameters, placed by a function: panels, tubes, rings, shells of revolution."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from meshes.gathering import HEXAHEDRON, QUADRILATERAL, Kind, gathered

if TYPE_CHECKING:
    from skfem import MeshHex2, MeshQuad2

Array = NDArray[np.float64]
#: Positions (n, 3), m, of points with the parameters a, b (n,) in 0..1.
SurfacePlace = Callable[[Array, Array], Array]
#: The same with a third parameter c.
SolidPlace = Callable[[Array, Array, Array], Array]


def surface_mesh(
    counts: tuple[int, int], place: SurfacePlace, edges: tuple[str, str, str, str] = ("a0", "a1", "b0", "b1"),
    closed: bool = False,
) -> "MeshQuad2":  # fmt: skip
    """Nine-node quadrilaterals over the parameters a, b in 0..1.

    Parameters
    ----------
    counts
        Elements along a and along b.
    place
        Positions (n, 3), m, of the parameters; every node lies exactly there.
    edges
        Names of the edges a = 0, a = 1, b = 0, b = 1; edges of one name are one boundary, "" has none.
    closed
        The surface closes on itself along a, as a tube does: no seam, and no edges a = 0, a = 1.

    Returns
    -------
    MeshQuad2
        Positions in space; its normal is d/da x d/db.
    """
    return _grid(QUADRILATERAL, counts, lambda at: place(*at.T), edges, closed)


def solid_mesh(
    counts: tuple[int, int, int], place: SolidPlace,
    faces: tuple[str, str, str, str, str, str] = ("a0", "a1", "b0", "b1", "bottom", "top"), closed: bool = False,
) -> "MeshHex2":  # fmt: skip
    """27-node hexahedra over the parameters a, b, c in 0..1; as ``surface_mesh``, a, b, c right-handed in space."""
    return _grid(HEXAHEDRON, counts, lambda at: place(*at.T), faces, closed)


def thickened(place: SurfacePlace, thickness: float | Callable[[Array, Array], Array]) -> SolidPlace:
    """A surface as a solid: c = 0 and 1 lie half a ``thickness`` (m) below and above it along its normal."""
    step = 1e-5

    def solid(a: Array, b: Array, c: Array) -> Array:
        along = place(a + step, b) - place(a - step, b)
        across = place(a, b + step) - place(a, b - step)
        normal = np.cross(along, across)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        height = thickness(a, b) if callable(thickness) else thickness
        return place(a, b) + ((c - 0.5) * height)[:, None] * normal

    return solid


def _grid(
    kind: Kind, counts: tuple[int, ...], place: Callable[[Array], Array], names: tuple[str, ...], closed: bool
) -> Any:
    if len(names) != 2 * kind.dimension or len(counts) != kind.dimension:
        raise ValueError(f"{kind.dimension} counts and {2 * kind.dimension} names are needed")
    if closed and counts[0] < 3:
        raise ValueError("a closed surface needs three elements around")
    steps = np.round(2 * kind.reference).astype(int)
    base = 2 * np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), axis=-1).reshape(-1, 1, kind.dimension)
    nodes = base + steps  # on the grid of half elements
    sizes = 2 * np.array(counts)
    places = place((nodes / sizes).reshape(-1, kind.dimension)).reshape(*nodes.shape[:2], 3)
    if closed:
        nodes = nodes.copy()
        nodes[..., 0] %= sizes[0]
    numbers = np.ravel_multi_index(tuple(nodes.transpose(2, 0, 1)), tuple(sizes + 1))
    boundaries: dict[str, list[NDArray[np.int64]]] = {}
    for side, name in enumerate(names):
        axis, end = divmod(side, 2)
        if not name or (closed and axis == 0):
            continue
        cells = np.flatnonzero(base[:, 0, axis] == (sizes[axis] - 2 if end else 0))
        on_side = np.flatnonzero(steps[: kind.corners, axis] == 2 * end)
        boundaries.setdefault(name, []).append(numbers[cells][:, on_side])
    return gathered(
        kind, numbers[:, : kind.corners], places, {name: np.concatenate(facets) for name, facets in boundaries.items()}
    )
