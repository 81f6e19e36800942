"""Compiled element loops over (element, quadrature point): force, tangent, energy.

Shared arguments, total Lagrangian:

``gradients`` (elements, points, 3, nodes), 1/m: reference gradients of the shape functions;
``weights`` (elements, points), m^3; ``cells`` (elements, nodes); ``displacement`` (all nodes, 3), m;
``law``, ``mu``, ``lam`` as in ``fea.materials``.

Stress is S(E) + C0 : (viscosity E + past) with C0 the elasticity at rest.  A time integrator that
writes dE/dt = rate E + (known from the past) gets Kelvin-Voigt damping by ``viscosity`` = tau * rate and
``past`` (elements, points, 6) = tau * known.  E does not see rigid motion, so neither does the damping,
and since the unknown enters by E alone, the tangent stays symmetric; from sym(F' dF/dt) it would not.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fea.materials import (
    SAINT_VENANT_KIRCHHOFF,
    elasticity,
    energy_density,
    green_lagrange,
    hooke,
    second_piola,
    turned_over,
)

Array = NDArray[np.float64]
Cells = NDArray[np.int64]

# Sums may be reordered for the vector unit; NaN must survive, it tells of impossible states.
_SUMS = {"reassoc", "contract", "nsz"}


@njit(cache=True, fastmath=_SUMS)
def _gradient(nodal: Array, shape_gradients: Array, result: Array) -> None:
    """Gradient (3, 3) of a field with values ``nodal`` (3, nodes)."""
    for k in range(3):
        for j in range(3):
            total = 0.0
            for a in range(nodal.shape[1]):
                total += nodal[k, a] * shape_gradients[j, a]
            result[k, j] = total


@njit(cache=True)
def _gather(field: Array, nodes: Cells, nodal: Array) -> None:
    for a in range(len(nodes)):
        for k in range(3):
            nodal[k, a] = field[nodes[a], k]


@njit(cache=True)
def _stress(
    law: int, mu: float, lam: float, viscosity: float, past: Array, h: Array, strain: Array, stress: Array
) -> None:
    """Strain (6,) and elastic plus viscous stress (6,); NaN where the element is turned inside out."""
    green_lagrange(h, strain)
    second_piola(law, mu, lam, strain, stress)
    # Saint Venant-Kirchhoff has equilibria with elements inside out: they are not the beam's.
    if turned_over(h):
        stress[:] = np.nan
    if viscosity > 0.0:
        rate, viscous = np.empty(6), np.empty(6)
        for n in range(6):
            rate[n] = viscosity * strain[n] + past[n]
        hooke(mu, lam, rate, viscous)
        for n in range(6):
            stress[n] += viscous[n]


@njit(cache=True, fastmath=_SUMS)
def _add_force(h: Array, stress: Array, weight: float, shape_gradients: Array, force: Array) -> None:
    """Add weight * F S . gradient of every node to ``force`` (3, nodes)."""
    rows = ((0, 3, 4), (3, 1, 5), (4, 5, 2))
    for k in range(3):
        for j in range(3):
            p = stress[rows[k][j]]
            for i in range(3):
                p += h[k, i] * stress[rows[i][j]]
            p *= weight
            for a in range(force.shape[1]):
                force[k, a] += p * shape_gradients[j, a]


@njit(cache=True)
def internal_force(
    gradients: Array, weights: Array, cells: Cells, displacement: Array,
    law: int, mu: float, lam: float, viscosity: float, past: Array,
) -> Array:  # fmt: skip
    """Internal nodal forces (all nodes, 3), N."""
    nodes = cells.shape[1]
    result = np.zeros_like(displacement)
    u, force = np.empty((3, nodes)), np.empty((3, nodes))
    h, strain, stress, nothing = np.empty((3, 3)), np.empty(6), np.empty(6), np.zeros(6)
    for e in range(len(cells)):
        _gather(displacement, cells[e], u)
        force[:] = 0.0
        for q in range(weights.shape[1]):
            _gradient(u, gradients[e, q], h)
            _stress(law, mu, lam, viscosity, past[e, q] if viscosity > 0.0 else nothing, h, strain, stress)
            _add_force(h, stress, weights[e, q], gradients[e, q], force)
        for a in range(nodes):
            for k in range(3):
                result[cells[e, a], k] += force[k, a]
    return result


@njit(cache=True)
def _strain_displacement(h: Array, shape_gradients: Array, b: Array) -> None:
    """Rows dE/du (6, 3 nodes) at one point."""
    pairs = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
    for n in range(6):
        i, j = pairs[n]
        for k in range(3):
            fi = h[k, i] + (1.0 if k == i else 0.0)
            fj = h[k, j] + (1.0 if k == j else 0.0)
            for a in range(shape_gradients.shape[1]):
                if i == j:
                    b[n, 3 * a + k] = fi * shape_gradients[i, a]
                else:
                    b[n, 3 * a + k] = fi * shape_gradients[j, a] + fj * shape_gradients[i, a]


@njit(cache=True)
def _second_order(h: Array, strain: Array) -> None:
    """H'H/2 as a strain (6,)."""
    pairs = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
    for n in range(6):
        i, j = pairs[n]
        total = h[0, i] * h[0, j] + h[1, i] * h[1, j] + h[2, i] * h[2, j]
        strain[n] = total if n > 2 else 0.5 * total


@njit(cache=True)
def _scatter(matrix: Array, geometric: Array, slots: NDArray[np.int32], data: Array) -> None:
    """Add an element matrix, plus ``geometric`` on equal components, to the stored upper triangle."""
    for i in range(len(matrix)):
        for j in range(len(matrix)):
            if slots[i, j] >= 0:
                value = matrix[i, j]
                if i % 3 == j % 3:
                    value += geometric[i // 3, j // 3]
                data[slots[i, j]] += value


@njit(cache=True)
def tangent(
    gradients: Array, weights: Array, cells: Cells, displacement: Array,
    law: int, mu: float, lam: float, viscosity: float, past: Array,
    step: Array, slots: NDArray[np.int32], data: Array,
) -> Array:  # fmt: skip
    """Internal forces (all nodes, 3), N, and their tangent added to ``data``, N/m.

    The tangent is B' D B plus the geometric term, D = dS/dE + viscosity * C0.  The stress in the
    geometric term is that of E less what the last ``step`` (all nodes, 3), m, added to E in second
    order: Newton's method with stresses as unknowns of their own, condensed (Magisano, Leonetti &
    Garcea 2017).  A step that turns the body stretches it in second order; without this, that false
    stretch spoils the next tangent.  ``step`` = 0 gives the exact derivative.
    """
    points, nodes = weights.shape[1], cells.shape[1]
    result = np.zeros_like(displacement)
    u, last, force = np.empty((3, nodes)), np.empty((3, nodes)), np.empty((3, nodes))
    h, strain, stress, nothing = np.empty((3, 3)), np.empty(6), np.empty(6), np.zeros(6)
    b, db = np.empty((6 * points, 3 * nodes)), np.empty((6 * points, 3 * nodes))
    sg, matrix_d, at_rest = np.empty((3 * points, nodes)), np.empty((6, 6)), np.empty((6, 6))
    tensor, turn, second_order = np.empty((3, 3)), np.empty((3, 3)), np.empty(6)
    elasticity(SAINT_VENANT_KIRCHHOFF, mu, lam, strain, at_rest)
    for e in range(len(cells)):
        _gather(displacement, cells[e], u)
        _gather(step, cells[e], last)
        force[:] = 0.0
        for q in range(points):
            w = weights[e, q]
            _gradient(u, gradients[e, q], h)
            _stress(law, mu, lam, viscosity, past[e, q] if viscosity > 0.0 else nothing, h, strain, stress)
            _add_force(h, stress, w, gradients[e, q], force)
            elasticity(law, mu, lam, strain, matrix_d)
            _gradient(last, gradients[e, q], turn)
            _second_order(turn, second_order)
            hooke((1.0 + viscosity) * mu, (1.0 + viscosity) * lam, second_order, second_order)
            stress -= second_order
            matrix_d += viscosity * at_rest
            rows = b[6 * q : 6 * q + 6]
            _strain_displacement(h, gradients[e, q], rows)
            np.dot(w * matrix_d, rows, db[6 * q : 6 * q + 6])
            tensor[0, 0], tensor[1, 1], tensor[2, 2] = w * stress[0], w * stress[1], w * stress[2]
            tensor[0, 1] = tensor[1, 0] = w * stress[3]
            tensor[0, 2] = tensor[2, 0] = w * stress[4]
            tensor[1, 2] = tensor[2, 1] = w * stress[5]
            np.dot(tensor, gradients[e, q], sg[3 * q : 3 * q + 3])
        geometric = np.dot(gradients[e].reshape(3 * points, nodes).T, sg)
        _scatter(np.dot(b.T, db), geometric, slots[e], data)
        for a in range(nodes):
            for k in range(3):
                result[cells[e, a], k] += force[k, a]
    return result


@njit(cache=True)
def strain_energy(
    gradients: Array, weights: Array, cells: Cells, displacement: Array, law: int, mu: float, lam: float
) -> Array:
    """Strain energy of every element (elements,), J."""
    result = np.zeros(len(cells))
    u, h, strain = np.empty((3, cells.shape[1])), np.empty((3, 3)), np.empty(6)
    for e in range(len(cells)):
        _gather(displacement, cells[e], u)
        for q in range(weights.shape[1]):
            _gradient(u, gradients[e, q], h)
            green_lagrange(h, strain)
            result[e] += weights[e, q] * energy_density(law, mu, lam, strain)
    return result


@njit(cache=True)
def strains(gradients: Array, cells: Cells, displacement: Array) -> Array:
    """Green-Lagrange strains (elements, points, 6), doubled shears."""
    result = np.empty((len(cells), gradients.shape[1], 6))
    u, h = np.empty((3, cells.shape[1])), np.empty((3, 3))
    for e in range(len(cells)):
        _gather(displacement, cells[e], u)
        for q in range(gradients.shape[1]):
            _gradient(u, gradients[e, q], h)
            green_lagrange(h, result[e, q])
    return result
