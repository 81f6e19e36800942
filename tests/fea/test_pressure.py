"""Pressure and tractions: resultants, work, tangent."""

import numpy as np
import pytest

from fea.pressure import Pressure, traction
from fea.surface import Surface
from meshes.structured import surface_mesh


def skin(counts=(4, 3), closed=False):
    """A sheet 2 m by 1 m, or a torus, of nine-node facets with the normal d/da x d/db."""

    def sheet(a, b):
        return np.stack([2 * a, b, 0 * a], axis=1)

    def torus(a, b):
        u, v = 2 * np.pi * a, 2 * np.pi * b
        return np.stack([(2 + 0.7 * np.cos(v)) * np.cos(u), (2 + 0.7 * np.cos(v)) * np.sin(u), 0.7 * np.sin(v)], axis=1)

    mesh = surface_mesh(counts, torus if closed else sheet, closed=closed)
    points, facets = np.asarray(mesh.doflocs.T), quadratic_cells(mesh)
    if closed:
        points, facets = merged(points, facets)
    return points, Surface(facets)


def quadratic_cells(mesh):
    from skfem import Basis, ElementQuad2

    return Basis(mesh, ElementQuad2(), intorder=2).element_dofs.T.astype(np.int64)


def merged(points, facets):
    """Nodes at one place become one."""
    keys, first, place = np.unique(np.round(points, 9) + 0.0, axis=0, return_index=True, return_inverse=True)
    return points[first], place.ravel()[facets]


def assembled(term, x, t):
    matrix = np.zeros((x.size, x.size))
    for nodes, values in zip(term.cells, term.tangent(x, t), strict=True):
        rows = (3 * nodes[:, None] + np.arange(3)).ravel()
        matrix[np.ix_(rows, rows)] += values
    return matrix


def slope(function, x, rows, step=1e-6):
    """Central differences of ``function`` by the displacements ``rows`` of x."""
    result = []
    for row in rows:
        ends = []
        for sense in (step, -step):
            moved = x.reshape(-1).copy()
            moved[row] += sense
            ends.append(np.ravel(function(moved.reshape(-1, 3))))
        result.append((ends[0] - ends[1]) / (2 * step))
    return np.stack(result, axis=1)


def test_pressure_pushes_against_the_normal_and_follows_a_turn():
    points, surface = skin()
    term = Pressure(surface, points, 5.0, ramp=lambda t: t**2)
    np.testing.assert_allclose(term.force(np.zeros_like(points), 2.0).sum(axis=0), [0, 0, 5.0 * 4 * 2.0], atol=1e-12)
    turn = np.array([[0, 0, 1.0], [0, 1, 0], [-1, 0, 0]])
    turned = points @ turn.T - points
    np.testing.assert_allclose(term.force(turned, 1.0), term.force(np.zeros_like(points), 1.0) @ turn.T, atol=1e-12)
    dead = Pressure(surface, points, 5.0, follower=False)
    np.testing.assert_array_equal(dead.force(turned, 1.0), dead.force(np.zeros_like(points), 1.0))
    assert len(dead.cells) == len(dead.tangent(turned, 1.0)) == 0
    assert dead.energy(turned, 1.0) == pytest.approx(float(np.sum(dead.force(turned, 1.0) * turned)))


def test_on_a_closed_surface_force_and_tangent_derive_from_the_volume():
    points, surface = skin((6, 6), closed=True)
    term = Pressure(surface, points, 5.0)
    x = 0.05 * np.random.default_rng(1).normal(size=points.shape)
    rows = np.arange(0, x.size, 7)
    work = slope(lambda y: term.energy(y, 0.5), x, rows)
    np.testing.assert_allclose(work[0], term.force(x, 0.5).reshape(-1)[rows], rtol=1e-6, atol=1e-7)
    exact = slope(lambda y: term.force(y, 0.5), x, rows)
    np.testing.assert_allclose(assembled(term, x, 0.5)[:, rows], exact, atol=1e-8 * np.abs(exact).max())
    # Swelling by a tenth: the volume of a body that is 1.1 times as large.
    volume = float(np.sum(term.force(np.zeros_like(points), 1.0) * points)) / 3 / 5.0
    assert term.report(0.1 * points)["swept volume [m^3]"] == pytest.approx((1.1**3 - 1) * volume)


def test_the_tangent_is_exact_where_the_edge_is_held_and_symmetric_everywhere():
    points, surface = skin()
    term = Pressure(surface, points, 5.0)
    x = 0.05 * np.random.default_rng(2).normal(size=points.shape)
    edge = (points[:, 0] < 1e-9) | (points[:, 0] > 2 - 1e-9) | (points[:, 1] < 1e-9) | (points[:, 1] > 1 - 1e-9)
    inside = (3 * np.flatnonzero(~edge)[:, None] + np.arange(3)).ravel()
    matrix, exact = assembled(term, x, 1.0), slope(lambda y: term.force(y, 1.0), x, inside)
    np.testing.assert_array_equal(matrix, matrix.T)
    np.testing.assert_allclose(matrix[np.ix_(inside, inside)], exact[inside], atol=1e-8 * np.abs(exact).max())


def test_traction_sums_to_area_times_vector():
    points, surface = skin()
    forces = traction(surface, points, np.array([1.0, -2.0, 3.0]))
    np.testing.assert_allclose(forces.sum(axis=0), [2.0, -4.0, 6.0])
    np.testing.assert_allclose(forces.T @ points[:, 0], [2.0, -4.0, 6.0])
