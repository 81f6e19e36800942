"""Compiled element loops over (element, quadrature point): force, tangent, energy, stress.

Stress is S(E) + C0 : (viscosity E + past) with C0 the elasticity at rest, its deviatoric part under
an isochoric law.  A time integrator that writes dE/dt = rate E + (known from the past) gets Kelvin-Voigt damping
by ``viscosity`` = tau * rate and ``past`` (elements, points, 6) = tau * known.  E does not see rigid motion, so
neither does the damping, and since the unknown enters by E alone, the tangent stays symmetric; from
sym(F' dF/dt) it would not.

With volume modes the energy is isochoric(C) + (1 - s) U(theta) + s U(J), theta the projection of J = det F
onto the modes (Simo, Taylor & Pister 1985, with volume and pressure eliminated inside the element): force
and tangent are the derivatives of that energy.
"""

from typing import NamedTuple

import numpy as np
from numba import get_num_threads, njit, prange
from numpy.typing import NDArray

from fea.materials import (
    elasticity,
    energy_density,
    green_lagrange,
    hooke,
    isochoric_energy,
    pressure_and_slope,
    second_piola,
    split_elasticity,
    split_stress,
    turned_over,
    volume_ratio,
    volumetric_energy,
)
from fea.scatter import Scatter

Array = NDArray[np.float64]
Cells = NDArray[np.int64]
Indices = NDArray[np.int32]

#: Fewer elements than this are not worth waking a second thread for.
WORTH_SHARING = 192

# Sums may be reordered for the vector unit; NaN must survive, it tells of impossible states.
_SUMS = {"reassoc", "contract", "nsz"}

# Voigt numbers, and numbers of the blocks (0,0) (0,1) (0,2) (1,1) (1,2) (2,2) of a symmetric matrix by axes.
_VOIGT = ((0, 3, 4), (3, 1, 5), (4, 5, 2))
_BLOCK = ((0, 1, 2), (1, 3, 4), (2, 4, 5))


class Solid(NamedTuple):
    """Elements of one kind in the reference configuration.

    ``gradients`` (elements, points, 3, k), 1/m, of the shape functions; ``weights`` (elements, points), m^3;
    ``modes`` (elements, modes, points): functions onto which the volume ratio is projected, orthonormal in
    ``weights``, none for a law that needs no projection; ``pointwise``: the share s of the volumetric energy that
    is not projected; ``cells`` (elements, k): nodes.
    """

    gradients: Array
    weights: Array
    modes: Array
    pointwise: float
    cells: Cells


@njit(cache=True, fastmath=_SUMS)
def _gradients(nodal: Array, shape_gradients: Array, result: Array) -> None:
    """Gradients (points, 3, 3) of a field with values ``nodal`` (3, k)."""
    for q in range(len(result)):
        for j in range(3):
            x, y, z = 0.0, 0.0, 0.0
            for a in range(nodal.shape[1]):
                slope = shape_gradients[q, j, a]
                x += nodal[0, a] * slope
                y += nodal[1, a] * slope
                z += nodal[2, a] * slope
            result[q, 0, j], result[q, 1, j], result[q, 2, j] = x, y, z


@njit(cache=True)
def _gather(field: Array, nodes: Cells, nodal: Array) -> None:
    for a in range(len(nodes)):
        for i in range(3):
            nodal[i, a] = field[nodes[a], i]


@njit(cache=True)
def _project(modes: Array, weights: Array, values: Array) -> None:
    """Replace ``values`` (points,) by their projection onto the modes."""
    result = np.zeros(len(values))
    for m in range(len(modes)):
        share = 0.0
        for q in range(len(values)):
            share += modes[m, q] * weights[q] * values[q]
        for q in range(len(values)):
            result[q] += share * modes[m, q]
    values[:] = result


@njit(cache=True)
def _pressures(solid: Solid, e: int, h: Array, parameters: Array, pressure: Array, slope: Array, local: Array) -> None:
    """Pressures at the points; their slopes by the projected (``slope``) and the local (``local``) ratio, Pa."""
    share = solid.pointwise
    for q in range(len(pressure)):
        pressure[q] = volume_ratio(h[q])
    _project(solid.modes[e], solid.weights[e], pressure)
    for q in range(len(pressure)):
        at, by = pressure_and_slope(parameters, pressure[q])
        pressure[q], slope[q] = (1.0 - share) * at, (1.0 - share) * by
    _project(solid.modes[e], solid.weights[e], pressure)
    local[:] = 0.0
    if share > 0.0:
        for q in range(len(pressure)):
            at, by = pressure_and_slope(parameters, volume_ratio(h[q]))
            pressure[q] += share * at
            local[q] = share * by


@njit(cache=True)
def _add_viscous(parameters: Array, viscosity: float, past: Array, strain: Array, stress: Array) -> None:
    rate, viscous = np.empty(6), np.empty(6)
    for n in range(6):
        rate[n] = viscosity * strain[n] + past[n]
    hooke(parameters[0], parameters[2], rate, viscous)
    for n in range(6):
        stress[n] += viscous[n]


@njit(cache=True)
def _deform(
    nodal: Array, solid: Solid, e: int, law: int, parameters: Array, viscosity: float, past: Array,
    h: Array, strain: Array, stress: Array, pressure: Array, slope: Array, local: Array,
) -> None:  # fmt: skip
    """Displacement gradients, strains and stresses at the points; NaN where the element is turned inside out."""
    points = len(h)
    _gradients(nodal, solid.gradients[e], h)
    for q in range(points):
        green_lagrange(h[q], strain[q])
    split = solid.modes.shape[1] > 0
    if split:
        _pressures(solid, e, h, parameters, pressure, slope, local)
    for q in range(points):
        if split:
            split_stress(parameters, strain[q], pressure[q], stress[q])
        else:
            second_piola(law, parameters, strain[q], stress[q])
        # Saint Venant-Kirchhoff has equilibria with elements inside out: they are not the body's.
        if turned_over(h[q]):
            stress[q, :] = np.nan
        if viscosity > 0.0:
            _add_viscous(parameters, viscosity, past[e, q], strain[q], stress[q])


@njit(cache=True, fastmath=_SUMS)
def _add_forces(h: Array, stress: Array, weights: Array, shape_gradients: Array, force: Array) -> None:
    """Add the sum over the points of weight * F S . gradient of every node to ``force`` (3, k)."""
    p = np.empty(3)
    for q in range(len(weights)):
        for i in range(3):
            for j in range(3):
                total = stress[q, _VOIGT[i][j]]
                for k in range(3):
                    total += h[q, i, k] * stress[q, _VOIGT[k][j]]
                p[j] = weights[q] * total
            x, y, z = p[0], p[1], p[2]
            for a in range(force.shape[1]):
                force[i, a] += (
                    x * shape_gradients[q, 0, a] + y * shape_gradients[q, 1, a] + z * shape_gradients[q, 2, a]
                )


@njit(cache=True)
def _forces(
    first: int, last: int, solid: Solid, displacement: Array, law: int, parameters: Array,
    viscosity: float, past: Array, forces: Array,
) -> None:  # fmt: skip
    points, k = solid.weights.shape[1], solid.cells.shape[1]
    u, h, strain, stress = np.empty((3, k)), np.empty((points, 3, 3)), np.empty((points, 6)), np.empty((points, 6))
    pressure, slope, local = np.empty(points), np.empty(points), np.empty(points)
    for e in range(first, last):
        _gather(displacement, solid.cells[e], u)
        _deform(u, solid, e, law, parameters, viscosity, past, h, strain, stress, pressure, slope, local)
        _add_forces(h, stress, solid.weights[e], solid.gradients[e], forces[e])


@njit(cache=True, parallel=True)
def _forces_shared(
    threads: int, solid: Solid, displacement: Array, law: int, parameters: Array,
    viscosity: float, past: Array, forces: Array,
) -> None:  # fmt: skip
    count = len(forces)
    for part in prange(threads):
        first, last = count * part // threads, count * (part + 1) // threads
        _forces(first, last, solid, displacement, law, parameters, viscosity, past, forces)


@njit(cache=True)
def _collect(cells: Cells, forces: Array, nodes: int) -> Array:
    """Sum of element forces (elements, 3, k) at the nodes."""
    result = np.zeros((nodes, 3))
    for e in range(len(cells)):
        for a in range(cells.shape[1]):
            for i in range(3):
                result[cells[e, a], i] += forces[e, i, a]
    return result


def _threads(elements: int) -> int:
    return get_num_threads() if elements >= WORTH_SHARING else 1


def internal_force(
    solid: Solid, displacement: Array, law: int, parameters: Array, viscosity: float, past: Array
) -> Array:
    """Internal nodal forces (nodes, 3), N, at ``displacement`` (nodes, 3), m."""
    elements, k = solid.cells.shape
    forces, threads = np.zeros((elements, 3, k)), _threads(elements)
    if threads > 1:
        _forces_shared(threads, solid, displacement, law, parameters, viscosity, past, forces)
    else:
        _forces(0, elements, solid, displacement, law, parameters, viscosity, past, forces)
    return _collect(solid.cells, forces, len(displacement))


@njit(cache=True)
def _second_order(h: Array, strain: Array) -> None:
    """H'H/2 as a strain (6,)."""
    pairs = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
    for n in range(6):
        i, j = pairs[n]
        total = h[0, i] * h[0, j] + h[1, i] * h[1, j] + h[2, i] * h[2, j]
        strain[n] = total if n > 2 else 0.5 * total


@njit(cache=True)
def _drop_second_order(
    last: Array, solid: Solid, e: int, parameters: Array, viscosity: float,
    strain: Array, stress: Array, pressure: Array,
) -> None:  # fmt: skip
    """Take from stresses and pressures what the last step ``last`` (3, k) added in second order."""
    points, split = len(stress), solid.modes.shape[1] > 0
    mu, lam = (1.0 + viscosity) * parameters[0], parameters[1] + viscosity * parameters[2]
    if split:
        lam = (1.0 + viscosity) * parameters[2]
    turn, second, change, false = np.empty((points, 3, 3)), np.empty(6), np.empty(6), np.empty(points)
    _gradients(last, solid.gradients[e], turn)
    for q in range(points):
        _second_order(turn[q], second)
        false[q] = second[0] + second[1] + second[2]
        hooke(mu, lam, second, change)
        stress[q] -= change
    if split:
        direct = solid.pointwise * false
        _project(solid.modes[e], solid.weights[e], false)
        for q in range(points):
            split_stress(parameters, strain[q], pressure[q], change)
            stress[q] -= change
            pressure[q] -= parameters[3] * ((1.0 - solid.pointwise) * false[q] + direct[q])
            split_stress(parameters, strain[q], pressure[q], change)
            stress[q] += change


@njit(cache=True, fastmath=_SUMS)
def _first_elasticity(h: Array, stress: Array, matrix: Array, weight: float, half: Array, result: Array) -> None:
    """Derivative of F S by F times ``weight``: blocks (i, k) of ``_BLOCK`` by (j, l) into ``result`` (6, 3, 3)."""
    for i in range(3):
        f0, f1, f2 = h[i, 0], h[i, 1], h[i, 2]
        for j in range(3):
            for n in range(6):
                total = matrix[_VOIGT[i][j], n]
                total += f0 * matrix[_VOIGT[0][j], n] + f1 * matrix[_VOIGT[1][j], n] + f2 * matrix[_VOIGT[2][j], n]
                half[i, j, n] = weight * total
    for i in range(3):
        for k in range(i, 3):
            for j in range(3):
                for m in range(3):
                    total = half[i, j, _VOIGT[k][m]] + h[k, 0] * half[i, j, _VOIGT[0][m]]
                    total += h[k, 1] * half[i, j, _VOIGT[1][m]] + h[k, 2] * half[i, j, _VOIGT[2][m]]
                    if i == k:
                        total += weight * stress[_VOIGT[j][m]]
                    result[_BLOCK[i][k], j, m] = total


@njit(cache=True, fastmath=_SUMS)
def _times_gradients(moduli: Array, shape_gradients: Array, rows: Array) -> None:
    """Rows j of ``moduli`` (6, 3, 3) times the gradients of every node, (3, 6 k)."""
    k = shape_gradients.shape[1]
    for j in range(3):
        for n in range(6):
            x, y, z = moduli[n, j, 0], moduli[n, j, 1], moduli[n, j, 2]
            for a in range(k):
                rows[j, n * k + a] = x * shape_gradients[0, a] + y * shape_gradients[1, a] + z * shape_gradients[2, a]


@njit(cache=True, fastmath=_SUMS)
def _cofactor(h: Array, result: Array) -> None:
    """dJ/dF (3, 3) of F = I + H."""
    f = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            f[i, j] = h[i, j] + (1.0 if i == j else 0.0)
    for i in range(3):
        m, n = (i + 1) % 3, (i + 2) % 3
        for j in range(3):
            o, p = (j + 1) % 3, (j + 2) % 3
            result[i, j] = f[m, o] * f[n, p] - f[m, p] * f[n, o]


@njit(cache=True, fastmath=_SUMS)
def _add_volume_stiffness(solid: Solid, e: int, h: Array, slope: Array, blocks: Array) -> None:
    """Add what follows from the change of the projected pressures to ``blocks`` (k, 6 k)."""
    modes, weights, gradients = solid.modes[e], solid.weights[e], solid.gradients[e]
    k, count = blocks.shape[0], len(modes)
    cofactor, change = np.empty((3, 3)), np.empty(3 * k)
    changes, stiffness = np.zeros((count, 3 * k)), np.zeros((count, count))
    for q in range(len(slope)):
        _cofactor(h[q], cofactor)
        for i in range(3):
            x, y, z = cofactor[i, 0], cofactor[i, 1], cofactor[i, 2]
            for a in range(k):
                change[i * k + a] = x * gradients[q, 0, a] + y * gradients[q, 1, a] + z * gradients[q, 2, a]
        for m in range(count):
            factor = weights[q] * modes[m, q]
            for n in range(count):
                stiffness[m, n] += factor * modes[n, q] * slope[q]
            for a in range(3 * k):
                changes[m, a] += factor * change[a]
    stiff = np.dot(stiffness, changes)
    for m in range(count):
        for i in range(3):
            # Blocks (i, i) to (i, 2) lie side by side.
            first = (_BLOCK[i][i] - i) * k
            for a in range(k):
                factor = changes[m, i * k + a]
                for b in range(i * k, 3 * k):
                    blocks[a, first + b] += factor * stiff[m, b]


@njit(cache=True)
def _add_blocks(blocks: Array, starts: Indices, widths: Indices, nodes: Cells, data: Array) -> None:
    """Add an element matrix, blocks (i, j) of ``_BLOCK`` side by side, to the stored upper triangle."""
    k = len(nodes)
    for a in range(k):
        width = 3 * widths[nodes[a]]
        for b in range(k):
            start = starts[a, b]
            if start < 0:
                continue
            for i in range(3):
                row = start + (0, width - 1, 2 * width - 3)[i]
                for j in range(i, 3):
                    data[row + j] += blocks[a, _BLOCK[i][j] * k + b]
                if a != b:
                    for j in range(i):
                        data[row + j] += blocks[b, _BLOCK[i][j] * k + a]


@njit(cache=True)
def _tangents(
    elements: Cells, solid: Solid, displacement: Array, law: int, parameters: Array,
    viscosity: float, past: Array, step: Array, starts: Indices, widths: Indices, forces: Array, data: Array,
) -> None:  # fmt: skip
    points, k = solid.weights.shape[1], solid.cells.shape[1]
    u, h, strain, stress = np.empty((3, k)), np.empty((points, 3, 3)), np.empty((points, 6)), np.empty((points, 6))
    pressure, slope, local = np.empty(points), np.empty(points), np.empty(points)
    split = solid.modes.shape[1] > 0
    matrix, at_rest, half, moduli = np.empty((6, 6)), np.empty((6, 6)), np.empty((3, 3, 6)), np.empty((6, 3, 3))
    rows, blocks = np.empty((3 * points, 6 * k)), np.empty((k, 6 * k))
    for n in range(6):
        hooke(parameters[0], parameters[2], np.eye(6)[n], at_rest[n])
    for e in elements:
        _gather(displacement, solid.cells[e], u)
        _deform(u, solid, e, law, parameters, viscosity, past, h, strain, stress, pressure, slope, local)
        _add_forces(h, stress, solid.weights[e], solid.gradients[e], forces[e])
        if len(step) > 0:
            _gather(step, solid.cells[e], u)
            _drop_second_order(u, solid, e, parameters, viscosity, strain, stress, pressure)
        for q in range(points):
            if split:
                split_elasticity(parameters, strain[q], pressure[q], local[q], matrix)
            else:
                elasticity(law, parameters, strain[q], matrix)
            if viscosity > 0.0:
                matrix += viscosity * at_rest
            _first_elasticity(h[q], stress[q], matrix, solid.weights[e, q], half, moduli)
            _times_gradients(moduli, solid.gradients[e, q], rows[3 * q : 3 * q + 3])
        np.dot(solid.gradients[e].reshape(3 * points, k).T, rows, blocks)
        if split:
            _add_volume_stiffness(solid, e, h, slope, blocks)
        _add_blocks(blocks, starts[e], widths, solid.cells[e], data)


@njit(cache=True, parallel=True)
def _tangents_shared(
    threads: int, order: Cells, ends: Cells, solid: Solid, displacement: Array, law: int, parameters: Array,
    viscosity: float, past: Array, step: Array, starts: Indices, widths: Indices, forces: Array, data: Array,
) -> None:  # fmt: skip
    for colour in range(len(ends)):
        begin = ends[colour - 1] if colour > 0 else 0
        count = ends[colour] - begin
        for part in prange(threads):
            _tangents(
                order[begin + count * part // threads : begin + count * (part + 1) // threads],
                solid, displacement, law, parameters, viscosity, past, step, starts, widths, forces, data,
            )  # fmt: skip


def tangent(
    solid: Solid, scatter: Scatter, displacement: Array, law: int, parameters: Array,
    viscosity: float, past: Array, step: Array,
) -> tuple[Array, Array]:  # fmt: skip
    """Internal forces (nodes, 3), N, and their tangent on the pattern of ``scatter`` (stored,), N/m.

    The tangent is the derivative of F S with S' = dS/dE + viscosity * C0.  The stress in its geometric term is
    that of E less what the last ``step`` (nodes, 3), m, added to E in second order: Newton's method with
    stresses as unknowns of their own, condensed (Magisano, Leonetti & Garcea 2017).  A step that turns
    the body stretches it in second order; without this, that false stretch spoils the next tangent.
    An empty ``step`` (0, 3) gives the exact derivative.
    """
    elements, k = solid.cells.shape
    forces, data = np.zeros((elements, 3, k)), np.zeros(len(scatter.pattern.indices))
    threads = _threads(elements)
    common = (
        solid, displacement, law, parameters, viscosity, past, step, scatter.starts, scatter.widths, forces, data,
    )  # fmt: skip
    if threads > 1:
        _tangents_shared(threads, scatter.order, scatter.ends, *common)
    else:
        _tangents(scatter.order, *common)
    return _collect(solid.cells, forces, len(displacement)), data


def warm_up() -> None:
    """Load, or at first compile, what only meshes of ``WORTH_SHARING`` elements use."""
    solid = Solid(np.zeros((1, 1, 3, 1)), np.ones((1, 1)), np.zeros((1, 0, 1)), 0.0, np.zeros((1, 1), np.int64))
    common = (solid, np.zeros((1, 3)), 0, np.ones(8), 0.0, np.zeros((0, 0, 6)))
    forces, first = np.zeros((1, 3, 1)), np.zeros(1, np.int64)
    _forces_shared(1, *common, forces)
    starts, widths = np.zeros((1, 1, 1), np.int32), np.ones(1, np.int32)
    _tangents_shared(1, first, first + 1, *common, np.zeros((0, 3)), starts, widths, forces, np.zeros(6))


@njit(cache=True)
def strain_energy(solid: Solid, displacement: Array, law: int, parameters: Array) -> Array:
    """Strain energy of every element (elements,), J."""
    elements, points = solid.weights.shape
    result, split = np.zeros(elements), solid.modes.shape[1] > 0
    u, h, strain = np.empty((3, solid.cells.shape[1])), np.empty((points, 3, 3)), np.empty(6)
    ratio = np.empty(points)
    for e in range(elements):
        _gather(displacement, solid.cells[e], u)
        _gradients(u, solid.gradients[e], h)
        for q in range(points):
            green_lagrange(h[q], strain)
            ratio[q] = volume_ratio(h[q])
            if split:
                density = isochoric_energy(parameters, strain)
                density += solid.pointwise * volumetric_energy(parameters, ratio[q])
            else:
                density = energy_density(law, parameters, strain)
            result[e] += solid.weights[e, q] * density
        if split:
            _project(solid.modes[e], solid.weights[e], ratio)
            for q in range(points):
                projected = volumetric_energy(parameters, ratio[q])
                result[e] += solid.weights[e, q] * (1.0 - solid.pointwise) * projected
    return result


@njit(cache=True)
def strains(solid: Solid, displacement: Array) -> Array:
    """Green-Lagrange strains (elements, points, 6), doubled shears."""
    result = np.empty((*solid.weights.shape, 6))
    u, h = np.empty((3, solid.cells.shape[1])), np.empty((result.shape[1], 3, 3))
    for e in range(len(result)):
        _gather(displacement, solid.cells[e], u)
        _gradients(u, solid.gradients[e], h)
        for q in range(result.shape[1]):
            green_lagrange(h[q], result[e, q])
    return result


@njit(cache=True)
def cauchy(
    solid: Solid, displacement: Array, law: int, parameters: Array, viscosity: float, past: Array
) -> Array:  # fmt: skip
    """Cauchy stress F S F' / J (elements, points, 6), Pa."""
    elements, points = solid.weights.shape
    result = np.empty((elements, points, 6))
    u, h = np.empty((3, solid.cells.shape[1])), np.empty((points, 3, 3))
    strain, stress = np.empty((points, 6)), np.empty((points, 6))
    pressure, slope, local = np.empty(points), np.empty(points), np.empty(points)
    pairs = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
    for e in range(elements):
        _gather(displacement, solid.cells[e], u)
        _deform(u, solid, e, law, parameters, viscosity, past, h, strain, stress, pressure, slope, local)
        for q in range(points):
            ratio = volume_ratio(h[q])
            for n in range(6):
                i, j = pairs[n]
                total = 0.0
                for k in range(3):
                    for m in range(3):
                        fi = h[q, i, k] + (1.0 if i == k else 0.0)
                        fj = h[q, j, m] + (1.0 if j == m else 0.0)
                        total += fi * stress[q, _VOIGT[k][m]] * fj
                result[e, q, n] = total / ratio
    return result
