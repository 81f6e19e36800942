"""Shape functions of facets and the closest point on a facet, compiled.

Kinds: nine-node quadrilaterals and six-node triangles, numbered as in ``fea.surface``, and the unbounded
plane through three points.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]

QUAD9, TRI6, PLANE = 0, 1, 2
KINDS = {"quad9": QUAD9, "tri6": TRI6}

_COLUMN = np.array([0, 2, 2, 0, 1, 2, 1, 0, 1])
_ROW = np.array([0, 0, 2, 2, 0, 1, 2, 1, 1])


@njit(cache=True)
def shapes(kind: int, r: float, s: float, table: Array) -> None:
    """Values, slopes r, s and second slopes rr, rs, ss of the shape functions into ``table`` (6, nodes)."""
    if kind == QUAD9:
        a = ((1.0 - r) * (1.0 - 2.0 * r), 4.0 * r * (1.0 - r), r * (2.0 * r - 1.0))
        b = ((1.0 - s) * (1.0 - 2.0 * s), 4.0 * s * (1.0 - s), s * (2.0 * s - 1.0))
        da = (4.0 * r - 3.0, 4.0 - 8.0 * r, 4.0 * r - 1.0)
        db = (4.0 * s - 3.0, 4.0 - 8.0 * s, 4.0 * s - 1.0)
        dd = (4.0, -8.0, 4.0)
        for n in range(9):
            i, j = _COLUMN[n], _ROW[n]
            table[0, n] = a[i] * b[j]
            table[1, n] = da[i] * b[j]
            table[2, n] = a[i] * db[j]
            table[3, n] = dd[i] * b[j]
            table[4, n] = da[i] * db[j]
            table[5, n] = a[i] * dd[j]
        return
    q = 1.0 - r - s
    if kind == PLANE:
        table[:] = 0.0
        table[0, 0], table[0, 1], table[0, 2] = q, r, s
        table[1, 0], table[1, 1], table[2, 0], table[2, 2] = -1.0, 1.0, -1.0, 1.0
        return
    rows = (
        (q * (2.0 * q - 1.0), r * (2.0 * r - 1.0), s * (2.0 * s - 1.0), 4.0 * q * r, 4.0 * r * s, 4.0 * q * s),
        (1.0 - 4.0 * q, 4.0 * r - 1.0, 0.0, 4.0 * (q - r), 4.0 * s, -4.0 * s),
        (1.0 - 4.0 * q, 0.0, 4.0 * s - 1.0, -4.0 * r, 4.0 * r, 4.0 * (q - s)),
        (4.0, 4.0, 0.0, -8.0, 0.0, 0.0),
        (4.0, 0.0, 0.0, -4.0, 4.0, -4.0),
        (4.0, 0.0, 4.0, 0.0, 0.0, -8.0),
    )
    for i in range(6):
        for n in range(6):
            table[i, n] = rows[i][n]


@njit(cache=True)
def place(table: Array, corners: Array, frame: Array) -> None:
    """Position and its derivatives r, s, rr, rs, ss into ``frame`` (6, 3) of a facet with nodes at ``corners``."""
    for i in range(6):
        x, y, z = 0.0, 0.0, 0.0
        for n in range(corners.shape[0]):
            weight = table[i, n]
            x += weight * corners[n, 0]
            y += weight * corners[n, 1]
            z += weight * corners[n, 2]
        frame[i, 0], frame[i, 1], frame[i, 2] = x, y, z


@njit(cache=True)
def dot(a: Array, b: Array) -> float:
    """Scalar product of two vectors (3,)."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True)
def normal_of(frame: Array, normal: Array) -> None:
    """Unit normal x_r x x_s into ``normal`` (3,)."""
    a, b = frame[1], frame[2]
    x, y, z = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
    size = np.sqrt(x * x + y * y + z * z)
    normal[0], normal[1], normal[2] = x / size, y / size, z / size


@njit(cache=True)
def outside(kind: int, r: float, s: float) -> float:
    """How far a place lies beyond the border of its facet, in reference lengths."""
    if kind == QUAD9:
        return max(0.0, -r, r - 1.0, -s, s - 1.0)
    if kind == TRI6:
        return max(0.0, -r, -s, r + s - 1.0)
    return 0.0


@njit(cache=True)
def project(kind: int, corners: Array, point: Array, at: Array, table: Array, frame: Array) -> bool:
    """Reference place ``at`` (2,) of the foot of the perpendicular from ``point`` (3,), from a first guess in it.

    Newton's method; without the curvature where that has no minimum.  ``table`` and ``frame`` are left at
    the foot.  False where there is none within one facet length.
    """
    away = np.empty(3)
    for _ in range(25):
        shapes(kind, at[0], at[1], table)
        place(table, corners, frame)
        for i in range(3):
            away[i] = point[i] - frame[0, i]
        f, g = dot(away, frame[1]), dot(away, frame[2])
        metric_rr, metric_rs, metric_ss = dot(frame[1], frame[1]), dot(frame[1], frame[2]), dot(frame[2], frame[2])
        a = metric_rr - dot(away, frame[3])
        b = metric_rs - dot(away, frame[4])
        c = metric_ss - dot(away, frame[5])
        if a <= 0.1 * metric_rr or a * c - b * b <= 0.1 * (metric_rr * metric_ss - metric_rs * metric_rs):
            a, b, c = metric_rr, metric_rs, metric_ss
        determinant = a * c - b * b
        if not determinant > 0.0:
            return False
        dr, ds = (c * f - b * g) / determinant, (a * g - b * f) / determinant
        size = max(abs(dr), abs(ds))
        if kind != PLANE:
            if size > 0.5:
                dr, ds = dr * 0.5 / size, ds * 0.5 / size
            if max(abs(at[0] + dr - 0.5), abs(at[1] + ds - 0.5)) > 1.5:
                return False
        at[0] += dr
        at[1] += ds
        if size < 1e-9:
            shapes(kind, at[0], at[1], table)
            place(table, corners, frame)
            return True
    return False
