"""Compiled loops over contact points: where they touch, forces, tangent.

A contact point is a quadrature point of a slave facet; a pair is a slave facet with a master facet that its
points may touch.  Shared arguments:

``kind`` of the master facets (``fea.contact.facets``); ``positions`` (P, 3), m, now; ``masters`` (M, km) and
``slaves`` (F, ks) nodes; ``values`` (Q, ks) shape functions of the slave facet at its points; ``weights``
(F, Q), m^2, undeformed; ``starts`` (F + 1,), the pairs of slave facet f are starts[f] to starts[f + 1];
``master_of`` (pairs,); ``pair`` (F Q,), the pair in which a point has its foot, -1 for none; ``at`` (F Q, 2)
the foot's place on the master facet; ``gap`` (F Q,), m, infinite where there is no foot.

First and second variation of the gap g = (x - y(xi)) . n with the closest point y (Laursen & Simo 1993;
Konyukhov & Schweizerhof 2013):

    dg = n . (dx - dy),   A dxi = t . (dx - dy) + g n . dy_,   A = m - g k
    ddg = -(n . dy_ Dxi + n . Dy_ dxi) - k dxi Dxi + g (n . dy_ + k dxi) / m (n . Dy_ + k Dxi)

with dy_ the variation of the slopes t = y_, the metric m = t . t, and the curvature k = n . y__.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fea.contact.facets import PLANE, dot, normal_of, outside, place, project, shapes
from fea.contact.law import pressure, traction

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


@njit(cache=True)
def _gather(positions: Array, nodes: Ints, corners: Array) -> None:
    for n in range(len(nodes)):
        for i in range(3):
            corners[n, i] = positions[nodes[n], i]


@njit(cache=True)
def _sum(weights: Array, corners: Array, point: Array) -> None:
    point[:] = 0.0
    for n in range(len(weights)):
        for i in range(3):
            point[i] += weights[n] * corners[n, i]


@njit(cache=True)
def _gap(point: Array, frame: Array, normal: Array) -> float:
    normal_of(frame, normal)
    return (
        (point[0] - frame[0, 0]) * normal[0]
        + (point[1] - frame[0, 1]) * normal[1]
        + (point[2] - frame[0, 2]) * normal[2]
    )


@njit(cache=True)
def locate(
    kind: int, positions: Array, masters: Ints, slaves: Ints, values: Array, starts: Ints, master_of: Ints,
    border: float, pair: Ints, at: Array, gap: Array,
) -> None:  # fmt: skip
    """Foot of every point: ``pair``, ``at`` and ``gap`` are renewed.

    A point keeps its facet up to ``border`` (reference lengths) beyond the facet's edge, so that it does not
    flicker between two facets whose normals differ; then it takes the best one among its pairs.
    """
    points, km = len(values), masters.shape[1]
    corners, facet = np.empty((slaves.shape[1], 3)), np.empty((km, 3))
    table, frame = np.empty((6, km)), np.empty((6, 3))
    point, normal, guess = np.empty(3), np.empty(3), np.empty(2)
    middle = 0.5 if km == 9 else 1.0 / 3.0
    for f in range(len(slaves)):
        if starts[f] == starts[f + 1]:
            pair[f * points : (f + 1) * points] = -1
            gap[f * points : (f + 1) * points] = np.inf
            continue
        _gather(positions, slaves[f], corners)
        for q in range(points):
            i = f * points + q
            _sum(values[q], corners, point)
            if pair[i] >= 0:
                _gather(positions, masters[master_of[pair[i]]], facet)
                if project(kind, facet, point, at[i], table, frame) and outside(kind, at[i, 0], at[i, 1]) <= border:
                    gap[i] = _gap(point, frame, normal)
                    continue
            pair[i], gap[i] = -1, np.inf
            least = 2.0 * border
            for p in range(starts[f], starts[f + 1]):
                _gather(positions, masters[master_of[p]], facet)
                guess[:] = middle
                if not project(kind, facet, point, guess, table, frame):
                    continue
                beyond = outside(kind, guess[0], guess[1])
                if beyond > border:
                    continue
                here = _gap(point, frame, normal)
                # Feet inside a facet come first; among them, and among those outside, the nearest.
                alike = (beyond > 0.0) == (least > 0.0)
                better = abs(here) < abs(gap[i]) if alike else beyond < least
                if better:
                    least, pair[i], gap[i] = beyond, p, here
                    at[i, 0], at[i, 1] = guess[0], guess[1]


@njit(cache=True)
def _slip(
    kind: int, positions: Array, masters: Ints, master: int, at: Array, point: Array, normal: Array,
    anchor: int, anchor_at: Array, facet: Array, table: Array, frame: Array, slip: Array, where: Array,
) -> float:  # fmt: skip
    """Slip (3,) of a point from its anchor along the surface, and its length; ``where`` (2,), the anchor's place.

    ``facet`` holds the corners of ``master``; ``table`` is left with the shape functions at the anchor.
    An anchor on another facet is carried over to this one by projection.
    """
    if anchor == master:
        where[0], where[1] = anchor_at[0], anchor_at[1]
    else:
        shapes(kind, anchor_at[0], anchor_at[1], table)
        other, spot = np.empty_like(facet), np.empty(3)
        _gather(positions, masters[anchor], other)
        _sum(table[0], other, spot)
        where[0], where[1] = at[0], at[1]
        if not project(kind, facet, spot, where, table, frame):
            where[0], where[1] = at[0], at[1]
    shapes(kind, where[0], where[1], table)
    _sum(table[0], facet, slip)
    for i in range(3):
        slip[i] = point[i] - slip[i]
    across = dot(slip, normal)
    for i in range(3):
        slip[i] -= across * normal[i]
    return np.sqrt(dot(slip, slip))


@njit(cache=True)
def forces(
    kind: int, positions: Array, masters: Ints, slaves: Ints, values: Array, weights: Array, master_of: Ints,
    pair: Ints, at: Array, gap: Array, penalty: Array, width: Array, shift: Array,
    limit: Array, anchor: Ints, anchor_at: Array, result: Array, normals: Array, pressures: Array, shears: Array,
) -> float:  # fmt: skip
    """Nodal forces with the sign of internal ones added to ``result`` (P, 3), N; returns the energy, J.

    ``pressures`` (F Q,), Pa, ``shears`` (F Q, 3), Pa, what the slave point resists with, and ``normals``
    (F Q, 3) of the masters are set for every point.
    """
    points, km = len(values), masters.shape[1]
    facet, corners = np.empty((km, 3)), np.empty((slaves.shape[1], 3))
    table, frame, foot = np.empty((6, km)), np.empty((6, 3)), np.empty(km)
    point, normal, slip, where = np.empty(3), np.empty(3), np.empty(3), np.empty(2)
    energy = 0.0
    for i in range(len(pair)):
        f, q = i // points, i % points
        p, _, stored = pressure(penalty[i], width[i], shift[i], gap[i])
        energy += weights[f, q] * stored
        pressures[i] = p
        shears[i] = 0.0
        if p <= 0.0:
            continue
        master = master_of[pair[i]]
        _gather(positions, masters[master], facet)
        _gather(positions, slaves[f], corners)
        _sum(values[q], corners, point)
        shapes(kind, at[i, 0], at[i, 1], table)
        place(table, facet, frame)
        normal_of(frame, normal)
        foot[:] = table[0]
        normals[i] = normal
        for n in range(3):
            push = weights[f, q] * p * normal[n]
            for a in range(slaves.shape[1]):
                result[slaves[f, a], n] -= push * values[q, a]
            for a in range(km):
                result[masters[master, a], n] += push * foot[a]
        if limit[i] <= 0.0 or anchor[i] < 0:
            continue
        length = _slip(
            kind, positions, masters, master, at[i], point, normal, anchor[i], anchor_at[i],
            facet, table, frame, slip, where,
        )  # fmt: skip
        secant, _, stored = traction(penalty[i], limit[i], length)
        energy += weights[f, q] * stored
        for n in range(3):
            shears[i, n] = secant * slip[n]
            pull = weights[f, q] * shears[i, n]
            for a in range(slaves.shape[1]):
                result[slaves[f, a], n] += pull * values[q, a]
            for a in range(km):
                result[masters[master, a], n] -= pull * table[0, a]
    return energy


@njit(cache=True)
def _variations(
    table: Array, frame: Array, normal: Array, gap: float, p: float, fall: float, values: Array, km: int,
    rows: Array, mix: Array,
) -> None:  # fmt: skip
    """Rows n.(dx - dy), -n.dy_1, -n.dy_2, dxi_1, dxi_2 of ``rows``, and the matrix ``mix`` between them.

    The tangent at a point is rows' mix rows = fall dg Dg - p ddg.
    """
    ks = len(values)
    m11, m12, m22 = dot(frame[1], frame[1]), dot(frame[1], frame[2]), dot(frame[2], frame[2])
    k11, k12, k22 = dot(frame[3], normal), dot(frame[4], normal), dot(frame[5], normal)
    a11, a12, a22 = m11 - gap * k11, m12 - gap * k12, m22 - gap * k22
    det = a11 * a22 - a12 * a12
    b11, b12, b22 = a22 / det, -a12 / det, a11 / det
    det = m11 * m22 - m12 * m12
    c11, c12, c22 = m22 / det, -m12 / det, m11 / det
    for n in range(ks + km):
        own = values[n] if n < ks else -table[0, n - ks]
        one, two = (0.0, 0.0) if n < ks else (-table[1, n - ks], -table[2, n - ks])
        for i in range(3):
            j = 3 * n + i
            rows[0, j] = normal[i] * own
            rows[1, j] = normal[i] * one
            rows[2, j] = normal[i] * two
            t1, t2 = frame[1, i] * own - gap * rows[1, j], frame[2, i] * own - gap * rows[2, j]
            rows[3, j] = b11 * t1 + b12 * t2
            rows[4, j] = b12 * t1 + b22 * t2
    mix[:] = 0.0
    mix[0, 0] = fall
    mix[1, 1], mix[1, 2], mix[2, 1], mix[2, 2] = -p * gap * c11, -p * gap * c12, -p * gap * c12, -p * gap * c22
    # (1/m) k and k (1/m) k
    e11, e12 = c11 * k11 + c12 * k12, c11 * k12 + c12 * k22
    e21, e22 = c12 * k11 + c22 * k12, c12 * k12 + c22 * k22
    mix[1, 3] = mix[3, 1] = -p + p * gap * e11
    mix[1, 4] = mix[4, 1] = p * gap * e12
    mix[2, 3] = mix[3, 2] = p * gap * e21
    mix[2, 4] = mix[4, 2] = -p + p * gap * e22
    mix[3, 3] = p * (k11 - gap * (k11 * e11 + k12 * e21))
    mix[3, 4] = mix[4, 3] = p * (k12 - gap * (k11 * e12 + k12 * e22))
    mix[4, 4] = p * (k22 - gap * (k12 * e12 + k22 * e22))


@njit(cache=True)
def _friction_rows(
    slip: Array, length: float, normal: Array, frame: Array, values: Array, anchor: Array, rows: Array
) -> None:
    """Relative motion along the slip and across it within the surface, (2, 3 nodes)."""
    along, across = np.empty(3), np.empty(3)
    for i in range(3):
        along[i] = slip[i] / length if length > 0.0 else frame[1, i]
    size = np.sqrt(dot(along, along))
    for i in range(3):
        along[i] /= size
    for i in range(3):
        j, l = (i + 1) % 3, (i + 2) % 3  # noqa: E741
        across[i] = normal[j] * along[l] - normal[l] * along[j]
    for n in range(len(values) + len(anchor)):
        weight = values[n] if n < len(values) else -anchor[n - len(values)]
        for i in range(3):
            rows[0, 3 * n + i] = along[i] * weight
            rows[1, 3 * n + i] = across[i] * weight


@njit(cache=True)
def tangents(
    kind: int, positions: Array, masters: Ints, slaves: Ints, values: Array, weights: Array, master_of: Ints,
    pair: Ints, at: Array, gap: Array, penalty: Array, width: Array, shift: Array,
    limit: Array, anchor: Ints, anchor_at: Array, result: Array,
) -> None:  # fmt: skip
    """Symmetric matrices of the pairs added to ``result`` (pairs, 3k, 3k), N/m.

    k = ks + km, or fewer where the last masters are no unknowns.  Friction is linearised at a fixed normal.
    """
    points, km, ks = len(values), masters.shape[1], slaves.shape[1]
    size = result.shape[1]
    facet, corners = np.empty((km, 3)), np.empty((ks, 3))
    table, frame = np.empty((6, km)), np.empty((6, 3))
    point, normal, slip, where = np.empty(3), np.empty(3), np.empty(3), np.empty(2)
    rows, mix, product = np.zeros((7, 3 * (ks + km))), np.zeros((7, 7)), np.zeros((7, 3 * (ks + km)))
    for i in range(len(pair)):
        f, q = i // points, i % points
        p, fall, _ = pressure(penalty[i], width[i], shift[i], gap[i])
        if p <= 0.0:
            continue
        master = master_of[pair[i]]
        _gather(positions, masters[master], facet)
        shapes(kind, at[i, 0], at[i, 1], table)
        place(table, facet, frame)
        normal_of(frame, normal)
        _variations(table, frame, normal, gap[i], p, fall, values[q], km, rows, mix)
        count = 1 if kind == PLANE and km == 3 and size == 3 * ks else 5
        if limit[i] > 0.0 and anchor[i] >= 0:
            _gather(positions, slaves[f], corners)
            _sum(values[q], corners, point)
            length = _slip(
                kind, positions, masters, master, at[i], point, normal, anchor[i], anchor_at[i],
                facet, table, frame, slip, where,
            )  # fmt: skip
            mix[5, 5], mix[6, 6] = traction(penalty[i], limit[i], length)[1::-1]
            _friction_rows(slip, length, normal, frame, values[q], table[0], rows[5:])
            count = 7
        for a in range(count):
            product[a] = 0.0
            for b in range(count):
                factor = weights[f, q] * mix[a, b]
                if factor != 0.0:
                    for j in range(size):
                        product[a, j] += factor * rows[b, j]
        matrix = result[pair[i]]
        for j in range(size):
            for a in range(count):
                factor = rows[a, j]
                if factor != 0.0:
                    for l in range(size):  # noqa: E741
                        matrix[j, l] += factor * product[a, l]


@njit(cache=True)
def facing_pairs(
    kind: int, positions: Array, masters: Ints, slaves: Ints, values: Array, slopes: Array,
    pairs: Ints, facing: float, depth: float, reach: Array, margin: Array,
) -> Ints:  # fmt: skip
    """How near the ``pairs`` (m, 2) of slave and master facets come to touching, (m,).

    2 where a point of the slave has its foot at most ``margin[1]`` (reference lengths) beyond the master's
    edge, a gap between -``depth`` and ``reach[1]`` (m), and normals with a cosine below -``facing``; 1 with
    ``margin[0]`` and ``reach[0]``, which are larger; else 0.
    """
    km, ks = masters.shape[1], slaves.shape[1]
    corners, facet = np.empty((ks, 3)), np.empty((km, 3))
    table, frame, own = np.empty((6, km)), np.empty((6, 3)), np.empty((6, 3))
    point, normal, mine, guess = np.empty(3), np.empty(3), np.empty(3), np.empty(2)
    centre, away = np.empty((6, 3)), np.empty(3)
    middle = 0.5 if km == 9 else 1.0 / 3.0
    result = np.zeros(len(pairs), dtype=np.int64)
    for n in range(len(pairs)):
        master = pairs[n, 1]
        _gather(positions, slaves[pairs[n, 0]], corners)
        _gather(positions, masters[master], facet)
        shapes(kind, middle, middle, table)
        place(table, facet, centre)
        m11, m12, m22 = dot(centre[1], centre[1]), dot(centre[1], centre[2]), dot(centre[2], centre[2])
        det = m11 * m22 - m12 * m12
        for q in range(len(values)):
            _sum(values[q], corners, point)
            for i in range(3):
                away[i] = point[i] - centre[0, i]
            f, g = dot(away, centre[1]), dot(away, centre[2])
            # Where the foot would be on a flat facet; half a facet allows for its curvature.
            guess[0] = middle + (m22 * f - m12 * g) / det
            guess[1] = middle + (m11 * g - m12 * f) / det
            if outside(kind, guess[0], guess[1]) > margin[0] + 0.5:
                continue
            guess[:] = middle
            if not project(kind, facet, point, guess, table, frame):
                continue
            gap, beyond = _gap(point, frame, normal), outside(kind, guess[0], guess[1])
            if gap < -depth or gap > reach[0] or beyond > margin[0]:
                continue
            _sum(slopes[q, 0], corners, own[1])
            _sum(slopes[q, 1], corners, own[2])
            normal_of(own, mine)
            if dot(mine, normal) < -facing:
                result[n] = max(result[n], 2 if gap <= reach[1] and beyond <= margin[1] else 1)
                if result[n] == 2:
                    break
    return result


@njit(cache=True)
def slips(
    kind: int, positions: Array, masters: Ints, slaves: Ints, values: Array, master_of: Ints,
    pair: Ints, at: Array, anchor: Ints, anchor_at: Array, which: Ints,
) -> tuple[Array, Array]:  # fmt: skip
    """Slip lengths (m,), m, of the points ``which`` (m,), and their anchors' places on the facets they touch (m, 2)."""
    points, km = len(values), masters.shape[1]
    facet, corners = np.empty((km, 3)), np.empty((slaves.shape[1], 3))
    table, frame = np.empty((6, km)), np.empty((6, 3))
    point, normal, slip = np.empty(3), np.empty(3), np.empty(3)
    lengths, places = np.empty(len(which)), np.empty((len(which), 2))
    for n in range(len(which)):
        i = which[n]
        master = master_of[pair[i]]
        _gather(positions, masters[master], facet)
        _gather(positions, slaves[i // points], corners)
        _sum(values[i % points], corners, point)
        shapes(kind, at[i, 0], at[i, 1], table)
        place(table, facet, frame)
        normal_of(frame, normal)
        lengths[n] = _slip(
            kind, positions, masters, master, at[i], point, normal, anchor[i], anchor_at[i],
            facet, table, frame, slip, places[n],
        )  # fmt: skip
    return lengths, places
