"""Mid-surfaces of shells and the constant tables of the 18-node solid shell.

Reference coordinates: r, s in [-1, 1] along the mid-surface, z in [-1, 1] from bottom to top.
"""

from functools import cache

import numpy as np
from numpy.typing import NDArray
from skfem import ElementQuad2, MeshQuad, MeshQuad2

from fea.shell_kernels import COMPONENTS, LAYERS, SHEAR, THICKNESS, Tables
from fea.surface import shape_functions

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

#: Sharpest fold, angle between the normals of two neighbours, that a mitre can fill.
LARGEST_FOLD = np.deg2rad(150.0)
# Normals at a node that differ by less than about 11 degrees are one smooth surface's.
_SMOOTH = 1e-2
_CORNERS = 2.0 * ElementQuad2.doflocs[:4] - 1.0
#: Local nodes of the four edges: ends, then middle.
EDGES = np.array([[0, 1, 4], [1, 2, 5], [2, 3, 6], [3, 0, 7]])
_A2, _A3 = 1.0 / np.sqrt(3.0), np.sqrt(0.6)


def quad9(places: Array) -> tuple[Array, Array, Array]:
    """Shape functions (points, 9) and slopes by r and s at ``places`` (points, 2) in [-1, 1]."""
    values, slopes = shape_functions("quad9", 0.5 * (places.T + 1.0))
    return values, 0.5 * slopes[:, 0], 0.5 * slopes[:, 1]


def grid(r: Array, s: Array) -> Array:
    """Points (len(r) len(s), 2), s fastest."""
    return np.stack(np.meshgrid(r, s, indexing="ij"), axis=-1).reshape(-1, 2)


def _lagrange(x: float, nodes: Array) -> Array:
    return np.array([np.prod([(x - b) / (a - b) for b in nodes if b != a]) for a in nodes])


_TWO, _THREE = np.array([-_A2, _A2]), np.array([-_A3, 0.0, _A3])


@cache
def tying_points() -> tuple[Array, Array]:
    """Where strains are sampled: 11 and 13, 22 and 23 (Bucalem & Bathe 1993, nine-node element)."""
    return grid(_TWO, _THREE), grid(_THREE, _TWO)


def shear_fits(determinants: Array) -> Array:
    """Bilinear functions, by their values at 2 x 2 points, that fit nine values (elements, 2, 4, 9).

    Least squares at the 3 x 3 points of either layer, weighted by 1/volume; ``determinants`` (elements, 18)
    of the Jacobians.
    """
    points, weights = quadrature()
    basis = np.stack([np.outer(_lagrange(r, _TWO), _lagrange(s, _TWO)).ravel() for r, s, _ in points[::2]])
    weighted = np.einsum("elq,qn->elnq", (weights / determinants).reshape(-1, 9, 2).swapaxes(1, 2), basis)
    return np.ascontiguousarray(np.linalg.solve(weighted @ basis, weighted))


@cache
def quadrature() -> tuple[Array, Array]:
    """Points (18, 3) with z fastest, and weights (18,): 3 x 3 x 2 Gauss."""
    (g3, w3), (g2, w2) = np.polynomial.legendre.leggauss(3), np.polynomial.legendre.leggauss(2)
    points = np.stack(np.meshgrid(g3, g3, g2, indexing="ij"), axis=-1).reshape(-1, 3)
    return points, np.einsum("i,j,k->ijk", w3, w3, w2).ravel()


@cache
def tables() -> Tables:
    """Constant tables of the element; see ``fea.shell_kernels.Tables``."""
    points, _ = quadrature()
    at_11, at_22, at_12 = (quad9(places) for places in (*tying_points(), points[::2, :2]))
    slopes = np.concatenate([at_11[1], at_22[2], at_12[1], at_12[2]])
    values = np.concatenate([at_11[0], at_22[0], at_12[0][[0, 2, 6, 8]]])
    ties, weights = np.zeros((18, len(COMPONENTS)), dtype=np.int64), np.zeros((18, len(COMPONENTS)))
    for q, (r, s, z) in enumerate(points):
        layer = int(z > 0)
        samples = _interpolations(r, s, layer)
        ties[q] = np.concatenate([tie for tie, _ in samples])
        weights[q] = np.concatenate([weight for _, weight in samples])
    r, s, z = points.T
    return Tables(
        np.ascontiguousarray(slopes.T), np.ascontiguousarray(values.T), ties, weights,
        np.ascontiguousarray(z[:, None] * np.stack([np.ones(18), r, s, r * s], axis=1)),
    )  # fmt: skip


def _interpolations(r: float, s: float, layer: int) -> list[tuple[Ints, Array]]:
    """Tying strains and weights that make up the strains 11, 22, 33, 12, 13, 23 at a quadrature point."""
    two_r, two_s = _lagrange(r, _TWO), _lagrange(s, _TWO)
    # The three-point tying rows lie at the quadrature points themselves: one row counts.
    row_r, row_s = int(np.argmin(np.abs(_THREE - r))), int(np.argmin(np.abs(_THREE - s)))
    along_r, along_s = np.array([row_s, 3 + row_s]), np.array([2 * row_r, 2 * row_r + 1])
    nodal = quad9(np.array([[r, s]]))[0][0]
    first = LAYERS[layer]
    return [
        (first + along_r, two_r),
        (first + 6 + along_s, two_s),
        (THICKNESS + np.arange(9), nodal),
        (first + 12 + np.arange(4), np.outer(two_r, two_s).ravel()),
        (SHEAR + along_r, two_r),
        (SHEAR + 6 + along_s, two_s),
    ]


def promoted(mesh: MeshQuad) -> tuple[MeshQuad2, Array]:
    """Quadratic mesh with the same edges and names, and its nodes (n, 3).

    A plane mesh lies in z = 0 and its elements are turned to run anticlockwise: its normal is +z.
    """
    points = mesh.doflocs if isinstance(mesh, MeshQuad2) else MeshQuad2.from_mesh(mesh).doflocs
    cells = mesh.t.copy()
    if len(points) == 2:
        diagonals = points[:, cells[2:]] - points[:, cells[:2]]
        clockwise = diagonals[0, 0] * diagonals[1, 1] < diagonals[1, 0] * diagonals[0, 1]
        cells[:, clockwise] = cells[:, clockwise][[0, 3, 2, 1]]
        points = np.vstack([points, np.zeros(points.shape[1])])
    # Nodes of edges are numbered by the sorted corners, so they stay when elements are turned.
    return MeshQuad2(points, cells, _boundaries=mesh.boundaries, _subdomains=mesh.subdomains), points.T.copy()


def check_edges(mesh: MeshQuad2) -> Ints:
    """Pairs of neighbours and their local edges (pairs, 2 elements + 2 edges).

    Raises
    ------
    ValueError
        Three elements at an edge, or neighbours whose orientations differ.
    """
    corners = mesh.t[:4].T
    ends = corners[:, EDGES[:, :2]].reshape(-1, 2)
    order = np.lexsort(np.sort(ends, axis=1).T)
    same = (np.sort(ends[order], axis=1)[1:] == np.sort(ends[order], axis=1)[:-1]).all(axis=1)
    triple = np.flatnonzero(same[1:] & same[:-1])
    if len(triple):
        elements = (order[triple[0] : triple[0] + 3] // 4).tolist()
        raise ValueError(
            f"elements {elements} share one edge; a shell has at most two there: make separate parts and tie them"
        )
    first, second = order[:-1][same], order[1:][same]
    wrong = np.flatnonzero(ends[first, 0] == ends[second, 0])
    if len(wrong):
        pair = sorted([int(first[wrong[0]]) // 4, int(second[wrong[0]]) // 4])
        raise ValueError(
            f"elements {pair[0]} and {pair[1]} are neighbours of opposite orientation: list the nodes of one of them "
            "the other way round (a one-sided surface, a Moebius strip, cannot be oriented)"
        )
    return np.stack([first // 4, second // 4, first % 4, second % 4], axis=1)


def thickness_vectors(mesh: MeshQuad2, points: Array, thickness: Array) -> Array:
    """Vector from the bottom to the top surface at every node (nodes, 3), m.

    It has the ``thickness`` (nodes,) along the normals of all elements at its node, in the sense of least
    squares: the normal of a smooth surface, the mitre of a crease.
    """
    cells = mesh.dofs.element_dofs.T
    normals, angles = _normals_at_nodes(points[cells])
    _check_folds(check_edges(mesh), normals)
    weighted = angles[:, :, None] * normals
    squares, sums = np.zeros((len(points), 3, 3)), np.zeros((len(points), 3))
    np.add.at(squares, cells, weighted[..., :, None] * normals[..., None, :])
    np.add.at(sums, cells, weighted)
    size, axes = np.linalg.eigh(squares)
    used = size > _SMOOTH * size[:, 2:]
    along = np.einsum("nji,nj->ni", axes, sums) * used / np.where(used, size, 1.0)
    return thickness[:, None] * np.einsum("nij,nj->ni", axes, along)


def _normals_at_nodes(corners: Array) -> tuple[Array, Array]:
    """Unit normals (elements, 9, 3) and the angle (elements, 9) that the element fills at its nodes."""
    _, by_r, by_s = quad9(2.0 * ElementQuad2.doflocs - 1.0)
    along_r, along_s = by_r @ corners, by_s @ corners
    normals = np.cross(along_r, along_s)
    size = np.linalg.norm(normals, axis=2)
    lengths = np.linalg.norm(along_r, axis=2) * np.linalg.norm(along_s, axis=2)
    flat = np.flatnonzero(~(size > 1e-9 * lengths).all(axis=1))
    if len(flat):
        raise ValueError(f"element {flat[0]} has no normal at one of its nodes: it is degenerate")
    angles = np.full(size.shape, np.pi)
    angles[:, 8] = 2 * np.pi
    cosines = np.einsum("eai,eai->ea", along_r[:, :4], along_s[:, :4]) * _CORNERS.prod(axis=1) / lengths[:, :4]
    angles[:, :4] = np.arccos(np.clip(cosines, -1.0, 1.0))
    return normals / size[:, :, None], angles


def _check_folds(pairs: Ints, normals: Array) -> None:
    first, second = (normals[pairs[:, n], EDGES[pairs[:, 2 + n], 2]] for n in (0, 1))
    cosines = np.einsum("pi,pi->p", first, second)
    sharp = np.flatnonzero(cosines < np.cos(LARGEST_FOLD))
    if len(sharp):
        a, b = pairs[sharp[0], :2]
        fold = np.rad2deg(np.arccos(np.clip(cosines[sharp[0]], -1.0, 1.0)))
        raise ValueError(
            f"the surface folds by {fold:.0f} degrees between elements {a} and {b}; up to "
            f"{np.rad2deg(LARGEST_FOLD):.0f} can be mitred: make separate parts and tie them"
        )


def jacobians(middle: Array, half: Array, places: Array) -> Array:
    """Rows dx/dr, dx/ds, dx/dz (elements, points, 3, 3) at ``places`` (points, 3).

    ``middle`` and ``half`` (elements, 9, 3): mid-surface and half the thickness vector at the nodes.
    """
    values, by_r, by_s = quad9(places[:, :2])
    z = places[:, 2, None]
    along = [by @ middle + (z * by) @ half for by in (by_r, by_s)]
    return np.stack([*along, values @ half], axis=2)


def check_jacobians(middle: Array, half: Array) -> None:
    """Refuse elements whose volume is not positive wherever stress or strain is sampled."""
    layers = [np.hstack([p, np.full((6, 1), z)]) for p in tying_points() for z in _TWO]
    nodes = np.hstack([2.0 * ElementQuad2.doflocs - 1.0, np.zeros((9, 1))])
    places = np.concatenate([quadrature()[0], *layers, nodes])
    wrong = np.flatnonzero(~(np.linalg.det(jacobians(middle, half, places)) > 0.0).all(axis=1))
    if len(wrong):
        raise ValueError(
            f"element {wrong[0]} is inside out or too warped for its thickness ({len(wrong)} such elements): "
            "the thickness vectors must point out of the side from which its nodes run anticlockwise"
        )


def local_frames(jacobian: Array) -> Array:
    """Orthonormal rows e1, e2, e3 (..., 3, 3): e1 along r, e3 normal to the surface z = constant."""
    first = jacobian[..., 0, :] / np.linalg.norm(jacobian[..., 0, :], axis=-1, keepdims=True)
    third = np.cross(jacobian[..., 0, :], jacobian[..., 1, :])
    third /= np.linalg.norm(third, axis=-1, keepdims=True)
    return np.stack([first, np.cross(third, first), third], axis=-2)


def strain_transforms(jacobian: Array, frames: Array, shear_factor: float) -> Array:
    """Covariant strains to strains in the local frame (..., 6, 6), Voigt 11 22 33 12 13 23, doubled shears.

    The transverse shears 13 and 23 come multiplied by the square root of ``shear_factor``.
    """
    inverse = np.linalg.inv(jacobian @ np.swapaxes(frames, -1, -2))
    pairs = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
    result = np.empty((*jacobian.shape[:-2], 6, 6))
    for m, (p, q) in enumerate(pairs):
        for n, (i, j) in enumerate(pairs):
            value = inverse[..., p, i] * inverse[..., q, j]
            if i != j:
                value = 0.5 * (value + inverse[..., p, j] * inverse[..., q, i])
            result[..., m, n] = value if p == q else 2.0 * value
    result[..., 4:, :] *= np.sqrt(shear_factor)
    return result
