"""Compiled element loops of the 18-node solid shell: force, tangent, energy.

x(r, s, z) = sum over a of N_a(r, s) (m_a + z d_a), with m the mean and d half the difference of the top and
bottom node a.  The covariant Green-Lagrange strains are sampled where the element does not lock, 53 numbers e
(quadratic in the displacement), and interpolated from there (Bucalem & Bathe 1993 on both layers z = +-1/sqrt(3);
33 at the nodes against curvature thickness locking, Betsch & Stein 1995):

    on the lower layer 11 on 2 x 3 points (6), 22 on 3 x 2 (6), 12 on 2 x 2 (4); 13 on 2 x 3 (6) and 23 on 3 x 2
    (6); on the upper layer 11, 22, 12 (16); 33 at the nodes (9); shears doubled.

Where an element is no parallelogram, 12 at the 2 x 2 points alone would fail the patch test: the four numbers are those
of the bilinear function that fits 12 at the 3 x 3 points of quadrature, weighted by 1/volume.  The stress 12 of
a uniform state is bilinear over the volume, so what the fit leaves out does no work.

Four enhanced strains z (1, r, s, r s) in the normal direction (Buechter, Ramm & Roehl 1994) let the thickness change
linearly; they are solved for in each element, so forces are functions of the displacement alone.  For Saint Venant-
Kirchhoff the energy is then e'H e/2 with a constant H (53, 53); other laws take the points one by one.

Viscous stress is Hv (viscosity e + past) with Hv = P'CvP, P the strains that e causes at rest; where the viscous
modulus Cv is the elastic one, Hv = H.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fea.materials import SAINT_VENANT_KIRCHHOFF, elasticity, energy_density, hooke, second_piola

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

#: Sampled strains.
TIES = 53
#: Strain component of every entry of a row of ``Tables.ties``.
COMPONENTS = np.array([0] * 2 + [1] * 2 + [2] * 9 + [3] * 4 + [4] * 2 + [5] * 2)
# Sampled vectors: slopes on the lower and the upper layer, half thickness where 11 and 22 are sampled, at the corners
# of the 3 x 3 points and at the nodes.
_LAYER, _AT_11, _AT_12, _AT_NODES, VECTORS = 30, 60, 72, 76, 85
# First sampled strain of the two layers, of the transverse shears and of the thickness.
LAYERS, SHEAR, THICKNESS = (0, 28), 16, 44
_Z = 1.0 / np.sqrt(3.0)
_LOCAL_ITERATIONS = 25
_SUMS = {"reassoc", "contract", "nsz"}


class Tables(NamedTuple):
    """What is the same for all elements.

    Parameters
    ----------
    slopes
        Slopes of the nine shape functions (9, 30): by r where 11 is sampled, by s where 22 is, by r and by s at
        3 x 3 points.
    values
        Shape functions (9, 16) where 11 and 22 are sampled and at the corners of the 3 x 3 points.
    ties, weights
        Sampled strains (18, 21) that the strains at a quadrature point are made of, and their weights.
    enhanced
        Enhanced strain functions at the points, (18, n).
    """

    slopes: Array
    values: Array
    ties: Ints
    weights: Array
    enhanced: Array


class Elements(NamedTuple):
    """What each element has of its own.

    Parameters
    ----------
    cells
        Nodes (elements, 18): bottom and top in turn.
    order, starts
        Elements by colour, and where each colour starts.
    base
        Sampled vectors of the reference shape (elements, 3, 85), m.
    transforms
        Covariant strains to local ones (elements, 18, 6, 6).
    volumes
        Volume of every quadrature point (elements, 18), m^3.
    spread
        Volume at the middle over that at the point, per reference volume (elements, 18).
    stiffness
        H (elements, 53, 53), J; (0, 53, 53) where the law has none.
    viscous
        Hv (elements, 53, 53), J.
    predictor
        Enhanced strains that the sampled ones cause at rest, (elements, n, 53).
    fit
        The four 12 strains of both layers from nine, (elements, 2, 4, 9).
    """

    cells: Ints
    order: Ints
    starts: Ints
    base: Array
    transforms: Array
    volumes: Array
    spread: Array
    stiffness: Array
    viscous: Array
    predictor: Array
    fit: Array


@njit(cache=True)
def _fill(vector: Array, value: float) -> None:
    for n in range(len(vector)):
        vector[n] = value


@njit(cache=True, fastmath=_SUMS)
def _sample(middle: Array, half: Array, tables: Tables, vectors: Array) -> None:
    """Sampled vectors (3, 85) of a field whose mean and half difference are (3, 9)."""
    for k in range(3):
        row = vectors[k]
        for i in range(_AT_NODES):
            row[i] = 0.0
        for a in range(9):
            lower, upper, thick = middle[k, a] - _Z * half[k, a], middle[k, a] + _Z * half[k, a], half[k, a]
            for i in range(_LAYER):
                row[i] += tables.slopes[a, i] * lower
                row[_LAYER + i] += tables.slopes[a, i] * upper
            for i in range(16):
                row[_AT_11 + i] += tables.values[a, i] * thick
            row[_AT_NODES + a] = thick


@njit(cache=True)
def sample(middle: Array, half: Array, tables: Tables, vectors: Array) -> None:
    """Sampled vectors (elements, 3, 85) of fields (elements, 3, 9)."""
    for number in range(len(middle)):
        _sample(middle[number], half[number], tables, vectors[number])


@njit(cache=True)
def _gather(field: Array, nodes: Ints, middle: Array, half: Array) -> None:
    for a in range(9):
        for k in range(3):
            bottom, top = field[nodes[2 * a], k], field[nodes[2 * a + 1], k]
            middle[k, a] = 0.5 * (top + bottom)
            half[k, a] = 0.5 * (top - bottom)


@njit(cache=True, fastmath=_SUMS)
def _sampled_strains(g: Array, h: Array, fit: Array, e: Array) -> None:
    """Strains e (53,) of the reference vectors ``g`` when they change by ``h``, both (3, 85)."""
    _fill(e, 0.0)
    for k in range(3):
        gk, hk = g[k], h[k]
        for layer in range(2):
            o, first = _LAYER * layer, LAYERS[layer]
            for i in range(12):
                e[first + i] += hk[o + i] * (gk[o + i] + 0.5 * hk[o + i])
            for i in range(9):
                r, s = o + 12 + i, o + 21 + i
                shear = gk[r] * hk[s] + hk[r] * (gk[s] + hk[s])
                for n in range(4):
                    e[first + 12 + n] += fit[layer, n, i] * shear
        for i in range(12):
            g1, h1 = 0.5 * (gk[i] + gk[_LAYER + i]), 0.5 * (hk[i] + hk[_LAYER + i])
            g3, h3 = gk[_AT_11 + i], hk[_AT_11 + i]
            e[SHEAR + i] += g1 * h3 + h1 * (g3 + h3)
        for a in range(9):
            g3, h3 = gk[_AT_NODES + a], hk[_AT_NODES + a]
            e[THICKNESS + a] += h3 * (g3 + 0.5 * h3)


@njit(cache=True)
def _shears(stress: Array, fit: Array, shears: Array) -> None:
    """Work-conjugates (2, 9) of 12 at the 3 x 3 points of both layers."""
    for layer in range(2):
        for i in range(9):
            total = 0.0
            for n in range(4):
                total += fit[layer, n, i] * stress[LAYERS[layer] + 12 + n]
            shears[layer, i] = total


@njit(cache=True, fastmath=_SUMS)
def _add_force(
    now: Array, stress: Array, shears: Array, tables: Tables, pull: Array, nodes: Ints, result: Array
) -> None:
    """Add the forces of the tying stresses (53,) to ``result``; ``now`` are the present vectors (3, 85).

    ``shears`` (2, 9): see ``_shears``.
    """
    for k in range(3):
        g, p = now[k], pull[k]
        for layer in range(2):
            o, first = _LAYER * layer, LAYERS[layer]
            for i in range(12):
                p[o + i] = stress[first + i] * g[o + i]
            for i in range(9):
                r, s = o + 12 + i, o + 21 + i
                p[r] = shears[layer, i] * g[s]
                p[s] = shears[layer, i] * g[r]
        for i in range(12):
            along = 0.5 * stress[SHEAR + i] * g[_AT_11 + i]
            p[i] += along
            p[_LAYER + i] += along
            p[_AT_11 + i] = 0.5 * stress[SHEAR + i] * (g[i] + g[_LAYER + i])
        for a in range(9):
            lower, upper, thick = 0.0, 0.0, stress[THICKNESS + a] * g[_AT_NODES + a]
            for i in range(_LAYER):
                lower += tables.slopes[a, i] * p[i]
                upper += tables.slopes[a, i] * p[_LAYER + i]
            for i in range(12):
                thick += tables.values[a, i] * p[_AT_11 + i]
            middle, half = lower + upper, thick + _Z * (upper - lower)
            result[nodes[2 * a], k] += 0.5 * (middle - half)
            result[nodes[2 * a + 1], k] += 0.5 * (middle + half)


@njit(cache=True)
def _turned_over(now: Array) -> bool:
    """Whether a layer's volume is not positive: the sum over its four outermost quadrature points.

    A sharp fold may close one edge of an element for a while; strains are sampled elsewhere, and open it again.
    """
    corners = (0, 2, 6, 8)
    for layer in range(2):
        whole = 0.0
        for i in range(4):
            r, s, t = _LAYER * layer + 12 + corners[i], _LAYER * layer + 21 + corners[i], _AT_12 + i
            volume = now[0, t] * (now[1, r] * now[2, s] - now[2, r] * now[1, s])
            volume += now[1, t] * (now[2, r] * now[0, s] - now[0, r] * now[2, s])
            volume += now[2, t] * (now[0, r] * now[1, s] - now[1, r] * now[0, s])
            whole += volume
        if not whole > 0.0:
            return True
    return False


@njit(cache=True, fastmath=_SUMS)
def _add_product(matrix: Array, vector: Array, result: Array) -> None:
    for i in range(len(matrix)):
        total = 0.0
        for j in range(len(vector)):
            total += matrix[i, j] * vector[j]
        result[i] += total


@njit(cache=True)
def _solve(matrix: Array, right: Array) -> None:
    """Solve in place by elimination without pivoting; not finite where the matrix is singular."""
    n, columns = right.shape
    for i in range(n):
        # Division by zero raises in compiled code.
        pivot = matrix[i, i] if matrix[i, i] != 0.0 else np.nan
        for j in range(i + 1, n):
            factor = matrix[j, i] / pivot
            for k in range(i, n):
                matrix[j, k] -= factor * matrix[i, k]
            for k in range(columns):
                right[j, k] -= factor * right[i, k]
    for i in range(n - 1, -1, -1):
        pivot = matrix[i, i] if matrix[i, i] != 0.0 else np.nan
        for k in range(columns):
            total = right[i, k]
            for j in range(i + 1, n):
                total -= matrix[i, j] * right[j, k]
            right[i, k] = total / pivot


@njit(cache=True, fastmath=_SUMS)
def _compatible(transforms: Array, tables: Tables, e: Array, strains: Array) -> None:
    """Local strains (18, 6) that the sampled ones alone cause.

    Transverse shears are the mean of both layers: where the walls are warped or the thickness runs obliquely,
    bending would leak into a part that changes sign through the thickness, and stiffen the shell.
    """
    covariant = np.empty(6)
    for q in range(18):
        _fill(covariant, 0.0)
        for n in range(len(COMPONENTS)):
            covariant[COMPONENTS[n]] += tables.weights[q, n] * e[tables.ties[q, n]]
        for m in range(6):
            total = 0.0
            for n in range(6):
                total += transforms[q, m, n] * covariant[n]
            strains[q, m] = total
    for q in range(0, 18, 2):
        for m in range(4, 6):
            mean = 0.5 * (strains[q, m] + strains[q + 1, m])
            strains[q, m] = mean
            strains[q + 1, m] = mean


@njit(cache=True)
def _enhance(
    law: int, parameters: Array, volumes: Array, spread: Array, predictor: Array, tables: Tables,
    e: Array, strains: Array,
) -> bool:  # fmt: skip
    """Add the enhanced strains that no stress resists to ``strains`` (18, 6); False where there are none.

    Newton's method in the element, from what would be right for small strains.
    """
    count = len(predictor)
    alpha, trial, step, matrix = np.zeros(count), np.zeros(count), np.empty((count, 1)), np.empty((count, count))
    stress, tangent, basis, point = np.empty(6), np.empty((6, 6)), np.empty(count), np.empty(6)
    _add_product(predictor, e, trial)
    scale = 0.0
    for q in range(18):
        for n in range(6):
            scale = max(scale, abs(strains[q, n]))
    for _ in range(_LOCAL_ITERATIONS):
        for j in range(count):
            step[j, 0] = 0.0
            for k in range(count):
                matrix[j, k] = 0.0
        for q in range(18):
            for n in range(6):
                point[n] = strains[q, n]
            for j in range(count):
                basis[j] = spread[q] * tables.enhanced[q, j]
                point[2] += basis[j] * trial[j]
            second_piola(law, parameters, point, stress)
            elasticity(law, parameters, point, tangent)
            for j in range(count):
                step[j, 0] -= volumes[q] * basis[j] * stress[2]
                for k in range(count):
                    matrix[j, k] += volumes[q] * basis[j] * basis[k] * tangent[2, 2]
        if not np.isfinite(step.sum()):
            for j in range(count):
                trial[j] = 0.5 * (trial[j] + alpha[j])
            continue
        _solve(matrix, step)
        size = 0.0
        for j in range(count):
            alpha[j] = trial[j]
            trial[j] += step[j, 0]
            size = max(size, abs(step[j, 0]))
        # Newton's method squares the error, so what is left after this step is rounding.
        if size <= max(1e-8 * scale, 1e-13):
            for q in range(18):
                for j in range(count):
                    strains[q, 2] += spread[q] * tables.enhanced[q, j] * trial[j]
            return True
    return False


@njit(cache=True, fastmath=_SUMS)
def _add_stress(transforms: Array, volumes: Array, tables: Tables, q: int, local: Array, stress: Array) -> None:
    """Add the work-conjugates of the sampled strains to ``stress`` (53,) for the ``local`` stress (6,) at a point."""
    covariant = np.zeros(6)
    for m in range(6):
        for n in range(6):
            covariant[n] += volumes[q] * transforms[q, m, n] * local[m]
    for n in range(len(COMPONENTS)):
        stress[tables.ties[q, n]] += tables.weights[q, n] * covariant[COMPONENTS[n]]


@njit(cache=True)
def _point_stresses(
    law: int, parameters: Array, transforms: Array, volumes: Array, tables: Tables, strains: Array, stress: Array
) -> None:
    """Tying stresses (53,) of the local strains (18, 6)."""
    local = np.empty((2, 6))
    _fill(stress, 0.0)
    for first in range(0, 18, 2):
        second_piola(law, parameters, strains[first], local[0])
        second_piola(law, parameters, strains[first + 1], local[1])
        for m in range(4, 6):
            shared = 0.5 * (volumes[first] * local[0, m] + volumes[first + 1] * local[1, m])
            local[0, m] = shared / volumes[first]
            local[1, m] = shared / volumes[first + 1]
        _add_stress(transforms, volumes, tables, first, local[0], stress)
        _add_stress(transforms, volumes, tables, first + 1, local[1], stress)


@njit(cache=True)
def _strains_of_ties(transforms: Array, tables: Tables, q: int, b: Array) -> None:
    """Local strains at a point by its own sampled strains and by those of the point in the other layer, (6, 42)."""
    entries, other = len(COMPONENTS), q ^ 1
    for n in range(entries):
        component = COMPONENTS[n]
        for m in range(4):
            b[m, n] = tables.weights[q, n] * transforms[q, m, component]
            b[m, entries + n] = 0.0
        for m in range(4, 6):
            b[m, n] = 0.5 * tables.weights[q, n] * transforms[q, m, component]
            b[m, entries + n] = 0.5 * tables.weights[other, n] * transforms[other, m, component]


@njit(cache=True, fastmath=_SUMS)
def _point_stiffness(
    moduli: Array, transforms: Array, volumes: Array, spread: Array, tables: Tables,
    stiffness: Array, coupling: Array, enhanced: Array,
) -> None:  # fmt: skip
    """Stiffness of sampled strains (53, 53), of enhanced ones (n, n) and between them (n, 53).

    ``moduli`` are (18, 6, 6).
    """
    _fill(stiffness.reshape(-1), 0.0)
    _fill(coupling.reshape(-1), 0.0)
    _fill(enhanced.reshape(-1), 0.0)
    entries = len(COMPONENTS)
    b, turned, product = np.empty((6, 2 * entries)), np.empty((6, 2 * entries)), np.empty((2 * entries, 2 * entries))
    ties = np.empty(2 * entries, np.int64)
    for q in range(18):
        _strains_of_ties(transforms, tables, q, b)
        for n in range(entries):
            ties[n] = tables.ties[q, n]
            ties[entries + n] = tables.ties[q ^ 1, n]
        np.dot(moduli[q], b, turned)
        np.dot(b.T, turned, product)
        for m in range(2 * entries):
            for n in range(2 * entries):
                stiffness[ties[m], ties[n]] += volumes[q] * product[m, n]
        for j in range(len(coupling)):
            basis = volumes[q] * spread[q] * tables.enhanced[q, j]
            for n in range(2 * entries):
                coupling[j, ties[n]] += basis * turned[2, n]
            for k in range(len(coupling)):
                enhanced[j, k] += basis * spread[q] * tables.enhanced[q, k] * moduli[q, 2, 2]


@njit(cache=True)
def at_rest(
    law: int, parameters: Array, transforms: Array, volumes: Array, spread: Array, tables: Tables
) -> tuple[Array, Array]:
    """H (elements, 53, 53) and the predictor (elements, n, 53) of ``Elements``."""
    elements, count = len(volumes), tables.enhanced.shape[1]
    stiffness, predictor = np.empty((elements, TIES, TIES)), np.empty((elements, count, TIES))
    coupling, enhanced, cross = np.empty((count, TIES)), np.empty((count, count)), np.empty((TIES, TIES))
    moduli, strain = np.empty((18, 6, 6)), np.zeros(6)
    for q in range(18):
        elasticity(law, parameters, strain, moduli[q])
    for e in range(elements):
        _point_stiffness(moduli, transforms[e], volumes[e], spread[e], tables, stiffness[e], coupling, enhanced)
        for j in range(count):
            for n in range(TIES):
                predictor[e, j, n] = -coupling[j, n]
        _solve(enhanced, predictor[e])
        np.dot(coupling.T, predictor[e], cross)
        _add_scaled(1.0, cross, stiffness[e])
    return stiffness, predictor


@njit(cache=True)
def viscous_at_rest(
    parameters: Array, transforms: Array, volumes: Array, spread: Array, predictor: Array, tables: Tables
) -> Array:
    """Hv (elements, 53, 53) of ``Elements``."""
    elements, count = len(volumes), tables.enhanced.shape[1]
    result, coupling, enhanced = np.empty((elements, TIES, TIES)), np.empty((count, TIES)), np.empty((count, count))
    moduli, strain = np.empty((18, 6, 6)), np.zeros(6)
    cross, turned = np.empty((TIES, TIES)), np.empty((count, TIES))
    for q in range(18):
        for n in range(6):
            strain[n] = 1.0
            hooke(parameters[0], parameters[2], strain, moduli[q, n])
            strain[n] = 0.0
    for e in range(elements):
        _point_stiffness(moduli, transforms[e], volumes[e], spread[e], tables, result[e], coupling, enhanced)
        np.dot(enhanced, predictor[e], turned)
        _add_scaled(2.0, coupling, turned)
        np.dot(predictor[e].T, turned, cross)
        _add_scaled(0.5, cross, result[e])
        _add_scaled(0.5, cross.T, result[e])
    return result


@njit(cache=True)
def expanded(starts: NDArray[np.int32], widths: NDArray[np.int32], cells: Ints) -> NDArray[np.int32]:
    """Stored entry of every entry of the element matrices (elements, 54, 54) from ``fea.scatter``; -1 below."""
    elements, nodes = cells.shape
    result = np.full((elements, 3 * nodes, 3 * nodes), -1, np.int32)
    for e in range(elements):
        for a in range(nodes):
            width = widths[cells[e, a]]
            for b in range(nodes):
                if starts[e, a, b] < 0:
                    continue
                for i in range(3):
                    row = (0, 3 * width - 1, 6 * width - 3)[i]
                    for j in range(i if a == b else 0, 3):
                        result[e, 3 * a + i, 3 * b + j] = starts[e, a, b] + row + j
    return result


@njit(cache=True)
def _add_scaled(factor: float, matrix: Array, result: Array) -> None:
    for i in range(result.shape[0]):
        for j in range(result.shape[1]):
            result[i, j] += factor * matrix[i, j]


@njit(cache=True)
def _elastic(
    law: int, parameters: Array, elements: Elements, tables: Tables, number: int, e: Array, strains: Array,
    stress: Array,
) -> None:  # fmt: skip
    """Tying stresses (53,) of a law without a constant H; leaves the local strains (18, 6)."""
    transforms, volumes, spread = elements.transforms[number], elements.volumes[number], elements.spread[number]
    _compatible(transforms, tables, e, strains)
    found = _enhance(law, parameters, volumes, spread, elements.predictor[number], tables, e, strains)
    _point_stresses(law, parameters, transforms, volumes, tables, strains, stress)
    if not found:
        _fill(stress, np.nan)


@njit(cache=True)
def _stress(
    law: int, parameters: Array, elements: Elements, tables: Tables, number: int, viscosity: float, past: Array,
    e: Array, strains: Array, stress: Array,
) -> None:  # fmt: skip
    """Elastic plus viscous tying stresses (53,)."""
    rate = e.copy()
    if law == SAINT_VENANT_KIRCHHOFF:
        if viscosity > 0.0:
            for n in range(TIES):
                rate[n] += viscosity * e[n] + past[number, n]
        _fill(stress, 0.0)
        _add_product(elements.stiffness[number], rate, stress)
        return
    _elastic(law, parameters, elements, tables, number, e, strains, stress)
    if viscosity > 0.0:
        for n in range(TIES):
            rate[n] = viscosity * e[n] + past[number, n]
        _add_product(elements.viscous[number], rate, stress)


@njit(cache=True, nogil=True)
def add_force(
    first: int, last: int, law: int, parameters: Array, elements: Elements, tables: Tables,
    displacement: Array, viscosity: float, past: Array, result: Array,
) -> None:  # fmt: skip
    """Add to ``result`` (all nodes, 3) the internal forces, N, of the elements ``order[first:last]``."""
    middle, half, vectors, pull = np.empty((3, 9)), np.empty((3, 9)), np.empty((3, VECTORS)), np.empty((3, VECTORS))
    e, stress, strains, shears = np.empty(TIES), np.empty(TIES), np.empty((18, 6)), np.empty((2, 9))
    for n in range(first, last):
        number = elements.order[n]
        _gather(displacement, elements.cells[number], middle, half)
        _sample(middle, half, tables, vectors)
        _sampled_strains(elements.base[number], vectors, elements.fit[number], e)
        _stress(law, parameters, elements, tables, number, viscosity, past, e, strains, stress)
        _add_scaled(1.0, elements.base[number], vectors)
        # Saint Venant-Kirchhoff has equilibria with elements inside out: they are not the shell's.
        if _turned_over(vectors):
            _fill(stress, np.nan)
        _shears(stress, elements.fit[number], shears)
        _add_force(vectors, stress, shears, tables, pull, elements.cells[number], result)


@njit(cache=True, fastmath=_SUMS)
def _strain_displacement(now: Array, fit: Array, tables: Tables, b: Array) -> None:
    """Derivatives of in-plane and transverse shear strains by the layers' positions (2, 28, 27).

    The lower layer has the strains 0 to 27, the upper one 16 to 43; columns are 3 node + axis.
    """
    slopes, values = tables.slopes, tables.values
    for a in range(9):
        for k in range(3):
            column = 3 * a + k
            for layer in range(2):
                o, first = _LAYER * layer, 12 * layer
                for i in range(12):
                    b[layer, first + i, column] = slopes[a, i] * now[k, o + i]
                for n in range(4):
                    value = 0.0
                    for i in range(9):
                        r, s = 12 + i, 21 + i
                        value += fit[layer, n, i] * (slopes[a, r] * now[k, o + s] + slopes[a, s] * now[k, o + r])
                    b[layer, first + 12 + n, column] = value
            for i in range(12):
                mean = 0.5 * slopes[a, i] * now[k, _AT_11 + i]
                difference = values[a, i] * (now[k, i] + now[k, _LAYER + i]) / (4.0 * _Z)
                b[0, 16 + i, column], b[1, i, column] = mean - difference, mean + difference


@njit(cache=True, fastmath=_SUMS)
def _products(stiffness: Array, now: Array, b: Array, hb: Array, blocks: Array) -> None:
    """B'HB by the layers' positions: lower-lower, upper-lower, upper-upper into ``blocks`` (3, 27, 27)."""
    np.dot(stiffness[: THICKNESS - 16].T, b[0], hb[0])
    np.dot(stiffness[SHEAR:THICKNESS].T, b[1], hb[1])
    # A thickness strain sees only its own node: left out of the products, added here.
    for a in range(9):
        for k in range(3):
            thick, row = now[k, _AT_NODES + a] / (2.0 * _Z), stiffness[THICKNESS + a]
            for i in range(TIES):
                hb[0, i, 3 * a + k] -= thick * row[i]
                hb[1, i, 3 * a + k] += thick * row[i]
    np.dot(b[0].T, hb[0, : THICKNESS - 16], blocks[0])
    np.dot(b[1].T, hb[0, SHEAR:THICKNESS], blocks[1])
    np.dot(b[1].T, hb[1, SHEAR:THICKNESS], blocks[2])
    for a in range(9):
        for k in range(3):
            thick = now[k, _AT_NODES + a] / (2.0 * _Z)
            for j in range(27):
                lower, upper = thick * hb[0, THICKNESS + a, j], thick * hb[1, THICKNESS + a, j]
                blocks[0, 3 * a + k, j] -= lower
                blocks[1, 3 * a + k, j] += lower
                blocks[2, 3 * a + k, j] += upper


@njit(cache=True, fastmath=_SUMS)
def _geometric(stress: Array, shears: Array, tables: Tables, result: Array) -> None:
    """Second derivative of e by the layers' positions, weighted by ``stress``: node by node, (3, 9, 9)."""
    slopes, values = tables.slopes, tables.values
    for a in range(9):
        for b in range(9):
            cross, turned, thick = 0.0, 0.0, stress[THICKNESS + a] / (4.0 * _Z * _Z) if a == b else 0.0
            for i in range(12):
                cross += stress[SHEAR + i] * slopes[a, i] * values[b, i]
                turned += stress[SHEAR + i] * slopes[b, i] * values[a, i]
            for layer in range(2):
                total, first = 0.0, LAYERS[layer]
                for i in range(12):
                    total += stress[first + i] * slopes[a, i] * slopes[b, i]
                for i in range(9):
                    both = slopes[a, 12 + i] * slopes[b, 21 + i] + slopes[a, 21 + i] * slopes[b, 12 + i]
                    total += shears[layer, i] * both
                result[2 * layer, a, b] = total + thick + (2 * layer - 1) * (cross + turned) / (4.0 * _Z)
            result[1, a, b] = (turned - cross) / (4.0 * _Z) - thick


@njit(cache=True)
def _scatter(scale: float, blocks: Array, geometric: Array, slots: NDArray[np.int32], data: Array) -> None:
    """Add an element's matrix by the layers' positions to the stored upper triangle of bottom and top nodes."""
    near, far = 0.5 * (1.0 + _Z), 0.5 * (1.0 - _Z)
    for i in range(27):
        for j in range(27):
            low, up, mixed, turned = blocks[0, i, j], blocks[2, i, j], blocks[1, i, j], blocks[1, j, i]
            low, up, mixed, turned = scale * low, scale * up, scale * mixed, scale * turned
            if i % 3 == j % 3:
                a, b = i // 3, j // 3
                low, up = low + geometric[0, a, b], up + geometric[2, a, b]
                mixed, turned = mixed + geometric[1, a, b], turned + geometric[1, b, a]
            both = near * far * (mixed + turned)
            row, column = i + 3 * (i // 3), j + 3 * (j // 3)
            place = slots[row, column]
            if place >= 0:
                data[place] += near * near * low + both + far * far * up
            place = slots[row + 3, column + 3]
            if place >= 0:
                data[place] += far * far * low + both + near * near * up
            both = near * far * (low + up)
            place = slots[row, column + 3]
            if place >= 0:
                data[place] += both + near * near * turned + far * far * mixed
            place = slots[row + 3, column]
            if place >= 0:
                data[place] += both + near * near * mixed + far * far * turned


@njit(cache=True)
def _stiffness_now(
    law: int, parameters: Array, elements: Elements, tables: Tables, number: int, viscosity: float, strains: Array,
    result: Array,
) -> None:  # fmt: skip
    """Derivative of the tying stresses (53, 53) at the local strains (18, 6)."""
    moduli, count = np.empty((18, 6, 6)), tables.enhanced.shape[1]
    coupling, enhanced, cross = np.empty((count, TIES)), np.empty((count, count)), np.empty((TIES, TIES))
    for q in range(18):
        elasticity(law, parameters, strains[q], moduli[q])
    _point_stiffness(
        moduli, elements.transforms[number], elements.volumes[number], elements.spread[number], tables,
        result, coupling, enhanced,
    )  # fmt: skip
    released = coupling.copy()
    _solve(enhanced, released)
    np.dot(coupling.T, released, cross)
    _add_scaled(-1.0, cross, result)
    if viscosity > 0.0:
        _add_scaled(viscosity, elements.viscous[number], result)


@njit(cache=True, nogil=True)
def add_tangent(
    first: int, last: int, law: int, parameters: Array, elements: Elements, tables: Tables,
    displacement: Array, viscosity: float, past: Array, step: Array, slots: NDArray[np.int32],
    result: Array, data: Array,
) -> None:  # fmt: skip
    """What ``add_force`` does, and the tangents added to ``data``, N/m.

    ``step`` serves a better tangent as in ``fea.kernels.tangent``: the stress in the geometric term is
    that of e less what the last step added to e in second order.  An empty one gives the exact derivative.
    """
    middle, half, vectors, pull = np.empty((3, 9)), np.empty((3, 9)), np.empty((3, VECTORS)), np.empty((3, VECTORS))
    turn, nothing, second_order = np.empty((3, VECTORS)), np.zeros((3, VECTORS)), np.empty(TIES)
    e, stress, strains, stiffness = np.empty(TIES), np.empty(TIES), np.empty((18, 6)), np.empty((TIES, TIES))
    b, hb = np.empty((2, 28, 27)), np.empty((2, TIES, 27))
    blocks, geometric, shears = np.empty((3, 27, 27)), np.empty((3, 9, 9)), np.empty((2, 9))
    # A constant H is used where it lies, and scaled last.
    scale = 1.0 + viscosity if law == SAINT_VENANT_KIRCHHOFF else 1.0
    for n in range(first, last):
        number = elements.order[n]
        nodes = elements.cells[number]
        _gather(displacement, nodes, middle, half)
        _sample(middle, half, tables, vectors)
        _sampled_strains(elements.base[number], vectors, elements.fit[number], e)
        _stress(law, parameters, elements, tables, number, viscosity, past, e, strains, stress)
        if law == SAINT_VENANT_KIRCHHOFF:
            stiffness = elements.stiffness[number]
        else:
            _stiffness_now(law, parameters, elements, tables, number, viscosity, strains, stiffness)
        _add_scaled(1.0, elements.base[number], vectors)
        if _turned_over(vectors):
            _fill(stress, np.nan)
        _shears(stress, elements.fit[number], shears)
        _add_force(vectors, stress, shears, tables, pull, nodes, result)
        if len(step) > 0:
            _gather(step, nodes, middle, half)
            _sample(middle, half, tables, turn)
            _sampled_strains(nothing, turn, elements.fit[number], second_order)
            for i in range(TIES):
                second_order[i] *= -scale
            _add_product(stiffness, second_order, stress)
            _shears(stress, elements.fit[number], shears)
        _geometric(stress, shears, tables, geometric)
        _strain_displacement(vectors, elements.fit[number], tables, b)
        _products(stiffness, vectors, b, hb, blocks)
        _scatter(scale, blocks, geometric, slots[number], data)


@njit(cache=True)
def sampled_strains(elements: Elements, tables: Tables, displacement: Array) -> Array:
    """Sampled strains (elements, 53), covariant, m^2."""
    result = np.empty((len(elements.cells), TIES))
    middle, half, vectors = np.empty((3, 9)), np.empty((3, 9)), np.empty((3, VECTORS))
    for number in range(len(result)):
        _gather(displacement, elements.cells[number], middle, half)
        _sample(middle, half, tables, vectors)
        _sampled_strains(elements.base[number], vectors, elements.fit[number], result[number])
    return result


@njit(cache=True)
def local_strains(law: int, parameters: Array, elements: Elements, tables: Tables, sampled: Array) -> Array:
    """Strains with the enhanced ones, in the local frames (elements, 18, 6); NaN where none were found."""
    result = np.empty((len(sampled), 18, 6))
    for number in range(len(result)):
        e = sampled[number]
        _compatible(elements.transforms[number], tables, e, result[number])
        found = _enhance(
            law, parameters, elements.volumes[number], elements.spread[number], elements.predictor[number], tables, e,
            result[number],
        )  # fmt: skip
        if not found:
            result[number] = np.nan
    return result


@njit(cache=True)
def strain_energy(law: int, parameters: Array, elements: Elements, tables: Tables, sampled: Array) -> Array:
    """Strain energy of every element (elements,), J."""
    result = np.zeros(len(sampled))
    if law == SAINT_VENANT_KIRCHHOFF:
        stress = np.empty(TIES)
        for number in range(len(result)):
            _fill(stress, 0.0)
            _add_product(elements.stiffness[number], sampled[number], stress)
            result[number] = 0.5 * np.dot(stress, sampled[number])
        return result
    strains = local_strains(law, parameters, elements, tables, sampled)
    for number in range(len(result)):
        for q in range(18):
            density = energy_density(law, parameters, strains[number, q])
            result[number] += elements.volumes[number, q] * density
    return result


@njit(cache=True)
def second_piola_stresses(law: int, parameters: Array, strains: Array) -> Array:
    """Second Piola-Kirchhoff stresses (elements, 18, 6), Pa."""
    result = np.empty_like(strains)
    for number in range(len(strains)):
        for q in range(18):
            second_piola(law, parameters, strains[number, q], result[number, q])
    return result
