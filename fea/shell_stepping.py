"""Compiled time steps of ``fea.shell_motion``: generalised-alpha, modified Newton, nothing of it in Python.

Tangents are kept in a shelf and the one is used whose state lies nearest: a motion that comes back finds its
tangents again.  Between them a multisecant correction learns from the step's own iterations (Walker & Ni 2011), as in
``fea.secant``.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fea import banded, foresight, multisecant
from fea.foresight import Trail
from fea.multisecant import DEPTH
from fea.shell_kernels import Elements, Tables, add_force, add_tangent, sampled_strains, strain_energy

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

#: Iterations with one tangent, with those after it in the same step, in all; and shortened steps.
_PATIENCE, _WILD, _MOST, _CUTS = 10, 3, 60, 8
#: Base accelerations are given at so many instants a step; between them they are linear.
INSTANTS = 8
_HALVINGS = 6
_SUMS = {"reassoc", "contract", "nsz"}


class System(NamedTuple):
    """What moves.

    Parameters
    ----------
    law, parameters, elements, tables
        See ``fea.shell_kernels``.
    slots, taken, place, mass_data
        Of the tangent: stored entry of every element entry; stored entries between unknowns, where they go in the
        band, and the mass there.
    unknowns
        Displacement 3 node + axis of every unknown (n,), in threes along x, y, z.
    clamped
        The same of the displacements that are held.
    mass_rows, mass_columns, mass
        Mass between unknown nodes, compressed rows.
    carried
        Force on the unknowns for a unit acceleration of the base (n, 3), kg, without its sign.
    load
        Constant forces (n,), N.
    first
        See ``fea.banded``.
    """

    law: int
    parameters: Array
    elements: Elements
    tables: Tables
    slots: NDArray[np.int32]
    taken: Ints
    place: Ints
    mass_data: Array
    unknowns: Ints
    clamped: Ints
    mass_rows: Ints
    mass_columns: Ints
    mass: Array
    carried: Array
    load: Array
    first: Ints


class Scheme(NamedTuple):
    """Weights of generalised-alpha, damping, and the residual at which to stop relative to the reactions."""

    alpha_m: float
    alpha_f: float
    beta: float
    gamma: float
    viscous_time: float
    mass_damping: float
    tolerance: float


class State(NamedTuple):
    """One instant, changed in place.

    ``u``, ``v``, ``a``, ``force`` (n,) of the unknowns; ``strains`` (elements, 53) now and ``earlier``;
    ``numbers``: the last step (s, infinite at first), largest reaction so far (N), work of loads and base (J).
    """

    u: Array
    v: Array
    a: Array
    force: Array
    strains: Array
    earlier: Array
    numbers: Array


class Shelf(NamedTuple):
    """Factorised tangents (kept, n, width + 1), their pivots and states (kept, n), ``[filled, next]``."""

    rows: NDArray[np.float32]
    pivots: NDArray[np.float32]
    states: Array
    filled: Ints


class Work(NamedTuple):
    """Scratch, what is learnt, and counts of steps, halved steps, forces, tangents."""

    shelf: Shelf
    trail: Trail
    whole: Array
    moved: Array
    forces: Array
    past: Array
    data: Array
    inertia: Array
    right: Array
    step: Array
    single: NDArray[np.float32]
    steps: Array
    answers: Array
    counts: Ints


def work(system: System, width: int, kept: int) -> Work:
    """Room for ``run``; ``width`` as in ``fea.banded``, ``kept`` tangents."""
    n, nodes = len(system.unknowns), (len(system.unknowns) + len(system.clamped)) // 3
    shelf = Shelf(
        np.zeros((kept, n, width + 1), np.float32), np.zeros((kept, n), np.float32), np.zeros((kept, n)),
        np.zeros(2, np.int64),
    )  # fmt: skip
    return Work(
        shelf, foresight.trail(n), np.zeros((nodes, 3)), np.zeros((nodes, 3)), np.zeros((nodes, 3)),
        np.zeros((len(system.elements.cells), 53)), np.zeros(int(system.slots.max()) + 1),
        np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n, np.float32),
        np.zeros((DEPTH + 1, n)), np.zeros((DEPTH + 1, n)), np.zeros(4, np.int64),
    )  # fmt: skip


@njit(cache=True, fastmath=_SUMS)
def _times_mass(system: System, vector: Array, result: Array) -> None:
    for row in range(len(system.mass_rows) - 1):
        x, y, z = 0.0, 0.0, 0.0
        for k in range(system.mass_rows[row], system.mass_rows[row + 1]):
            column, mass = 3 * system.mass_columns[k], system.mass[k]
            x += mass * vector[column]
            y += mass * vector[column + 1]
            z += mass * vector[column + 2]
        result[3 * row], result[3 * row + 1], result[3 * row + 2] = x, y, z


@njit(cache=True, fastmath=_SUMS)
def _dot(a: Array, b: Array) -> float:
    total = 0.0
    for k in range(len(a)):
        total += a[k] * b[k]
    return total


@njit(cache=True)
def _spread(system: System, vector: Array, whole: Array) -> None:
    flat = whole.reshape(-1)
    for k in range(len(vector)):
        flat[system.unknowns[k]] = vector[k]


@njit(cache=True)
def _forces(system: System, u: Array, viscosity: float, past: Array, work: Work) -> float:
    """Internal forces of all nodes into ``work.forces``; returns the size of the reaction."""
    _spread(system, u, work.whole)
    work.forces[:] = 0.0
    add_force(
        0, len(system.elements.order), system.law, system.parameters, system.elements, system.tables,
        work.whole, viscosity, past, work.forces,
    )  # fmt: skip
    work.counts[2] += 1
    reaction, flat = 0.0, work.forces.reshape(-1)
    for k in system.clamped:
        reaction += flat[k] ** 2
    return np.sqrt(reaction)


@njit(cache=True)
def _known(system: System, scheme: Scheme, state: State, step: float, outer: Array, work: Work) -> None:
    """Put what does not depend on the end of the step into ``work``: ``inertia`` (an acceleration) and ``past``."""
    am, af, beta, gamma = scheme.alpha_m, scheme.alpha_f, scheme.beta, scheme.gamma
    drag = scheme.mass_damping
    for k in range(len(state.u)):
        a = -(state.u[k] + step * state.v[k]) / (beta * step**2) - (0.5 / beta - 1.0) * state.a[k]
        v = state.v[k] + step * ((1.0 - gamma) * state.a[k] + gamma * a)
        work.inertia[k] = (1.0 - am) * a + am * state.a[k] + drag * ((1.0 - af) * v + af * state.v[k])
        work.step[k] = system.load[k]
        for axis in range(3):
            work.step[k] -= system.carried[k, axis] * outer[axis]
    ratio, tau = step / state.numbers[0], scheme.viscous_time / step
    if tau > 0.0:
        work.past[:] = tau * (ratio**2 / (1.0 + ratio) * state.earlier - (1.0 + ratio) * state.strains)


@njit(cache=True)
def _pulls(scheme: Scheme, step: float) -> float:
    """Derivative of the weighted acceleration and drag by the displacement at the end, 1/s^2."""
    drag = (1.0 - scheme.alpha_f) * scheme.gamma * scheme.mass_damping
    return ((1.0 - scheme.alpha_m) / step + drag) / (scheme.beta * step)


@njit(cache=True)
def _viscosity(scheme: Scheme, state: State, step: float) -> float:
    ratio = step / state.numbers[0]
    return scheme.viscous_time / step * (1.0 + 2.0 * ratio) / (1.0 + ratio)


@njit(cache=True)
def _residual(system: System, scheme: Scheme, state: State, step: float, known: Array, u: Array, work: Work) -> float:
    """Out-of-balance force into ``work.right``; returns the size of the reaction."""
    reaction = _forces(system, u, _viscosity(scheme, state, step), work.past, work)
    pulls, af = _pulls(scheme, step), scheme.alpha_f
    for k in range(len(u)):
        work.step[k] = work.inertia[k] + pulls * u[k]
    _times_mass(system, work.step, work.right)
    flat = work.forces.reshape(-1)
    for k in range(len(u)):
        work.right[k] += (1.0 - af) * flat[system.unknowns[k]] + af * state.force[k] - known[k]
    return reaction


@njit(cache=True)
def _linearise(system: System, scheme: Scheme, state: State, step: float, u: Array, moved: Array, work: Work) -> bool:
    """Shelve the factorised tangent at ``u``, reached by ``moved``."""
    shelf = work.shelf
    here = shelf.filled[1]
    shelf.filled[0] = max(shelf.filled[0], here + 1)
    shelf.filled[1] = (here + 1) % len(shelf.rows)
    work.counts[3] += 1
    _spread(system, u, work.whole)
    _spread(system, moved, work.moved)
    work.data[:] = 0.0
    add_tangent(
        0, len(system.elements.order), system.law, system.parameters, system.elements, system.tables,
        work.whole, _viscosity(scheme, state, step), work.past, work.moved, system.slots, work.forces, work.data,
    )  # fmt: skip
    band, pulls = shelf.rows[here].reshape(-1), _pulls(scheme, step)
    band[:] = 0.0
    for k in range(len(system.taken)):
        value = pulls * system.mass_data[k] + (1.0 - scheme.alpha_f) * work.data[system.taken[k]]
        band[system.place[k]] = value
    shelf.states[here] = u
    return banded.factorise(shelf.rows[here], system.first, shelf.pivots[here])


@njit(cache=True)
def _nearest(shelf: Shelf, u: Array) -> int:
    best, least = -1, np.inf
    for number in range(shelf.filled[0]):
        distance, other = 0.0, shelf.states[number]
        for k in range(len(u)):
            distance += (u[k] - other[k]) ** 2
        if distance < least:
            best, least = number, distance
    return best


@njit(cache=True)
def _newton(system: System, scheme: Scheme, state: State, step: float, outer: Array, u: Array, work: Work) -> bool:
    """Find the end ``u`` of a step from a guess; leaves forces and reaction behind."""
    _known(system, scheme, state, step, outer, work)
    known, learnt, chosen, used, patience = work.step.copy(), 0, -1, 0, _PATIENCE
    least, cuts = np.inf, 0
    for _ in range(_MOST):
        reaction = _residual(system, scheme, state, step, known, u, work)
        size = np.sqrt(_dot(work.right, work.right))
        if not (np.isfinite(size) and size <= 1e3 * least):
            # Far too far: a quarter of the step will have to do, and a tangent from there.
            cuts += 1
            if cuts > _CUTS or chosen < 0:
                return False
            for k in range(len(u)):
                work.step[k] *= 0.25
                u[k] -= 3.0 * work.step[k]
            used = patience
            continue
        least = min(least, size)
        if size <= scheme.tolerance * max(state.numbers[1], reaction):
            state.numbers[1] = max(state.numbers[1], reaction)
            return True
        if chosen < 0:
            chosen = _nearest(work.shelf, u)
        if chosen < 0 or used == patience:
            # A step that its tangent does not finish is a wild one: the next tangents serve shorter.
            patience, used = _PATIENCE if chosen < 0 else _WILD, 0
            moved = work.steps[learnt - 1] if learnt else np.zeros(len(u))
            chosen, learnt = work.shelf.filled[1], 0
            if not _linearise(system, scheme, state, step, u, moved, work):
                return False
        for k in range(len(u)):
            work.single[k] = -work.right[k]
        banded.solve(work.shelf.rows[chosen], system.first, work.shelf.pivots[chosen], work.single)
        for k in range(len(u)):
            work.step[k] = work.single[k]
        learnt = multisecant.improve(work.steps, work.answers, learnt, work.step)
        for k in range(len(u)):
            u[k] += work.step[k]
        used += 1
    return False


@njit(cache=True)
def _accept(system: System, scheme: Scheme, state: State, step: float, outer: Array, u: Array, work: Work) -> None:
    """Take over the end ``u`` of a step, after ``_newton``."""
    flat, done = work.forces.reshape(-1), 0.0
    for k in range(len(u)):
        a = (u[k] - state.u[k] - step * state.v[k]) / (scheme.beta * step**2) - (0.5 / scheme.beta - 1.0) * state.a[k]
        state.v[k] += step * ((1.0 - scheme.gamma) * state.a[k] + scheme.gamma * a)
        state.a[k] = a
        pull = system.load[k]
        for axis in range(3):
            pull -= system.carried[k, axis] * outer[axis]
        done += pull * (u[k] - state.u[k])
        state.u[k] = u[k]
        state.force[k] = flat[system.unknowns[k]]
    state.numbers[0] = step
    state.numbers[2] += done
    if scheme.viscous_time > 0.0:
        state.earlier[:] = state.strains
        state.strains[:] = sampled_strains(system.elements, system.tables, work.whole)


@njit(cache=True)
def _outer(base: Array, instant: float, result: Array) -> None:
    """Acceleration of the base at a fractional number of its samples."""
    below = min(int(instant), len(base) - 1)
    above, share = min(below + 1, len(base) - 1), instant - below
    for axis in range(3):
        result[axis] = (1.0 - share) * base[below, axis] + share * base[above, axis]


@njit(cache=True)
def _advance(system: System, scheme: Scheme, state: State, step: float, base: Array, number: int, work: Work) -> bool:
    """One step, halved as often as needed; False where that does not help."""
    begin, end, outer, u = np.empty(3), np.empty(3), np.empty(3), np.empty(len(state.u))
    done, parts, halvings = 0, 1, 0
    while done < parts:
        short = step / parts
        _outer(base, INSTANTS * (number + done / parts), begin)
        _outer(base, INSTANTS * (number + (done + 1) / parts), end)
        outer[:] = scheme.alpha_f * begin + (1.0 - scheme.alpha_f) * end
        if not foresight.guess(work.trail, u):
            u[:] = state.u + short * state.v
        work.counts[0] += 1
        if _newton(system, scheme, state, short, outer, u, work):
            _accept(system, scheme, state, short, 0.5 * (begin + end), u, work)
            foresight.remember(work.trail, u)
            done += 1
            continue
        foresight.forget(work.trail)
        work.shelf.filled[:] = 0
        if halvings == _HALVINGS:
            return False
        done, parts, halvings = 2 * done, 2 * parts, halvings + 1
        work.counts[1] += 1
    if parts > 1:
        foresight.forget(work.trail)
        work.shelf.filled[:] = 0
    return True


@njit(cache=True)
def begin(system: System, state: State, past: Array, work: Work) -> None:
    """Forces and strains of the initial state; ``past`` (elements, 53) is the viscous time times the strain rate."""
    reaction = _forces(system, state.u, np.finfo(np.float64).tiny, past, work)
    flat = work.forces.reshape(-1)
    for k in range(len(state.u)):
        state.force[k] = flat[system.unknowns[k]]
    state.strains[:] = sampled_strains(system.elements, system.tables, work.whole)
    state.earlier[:] = state.strains
    state.numbers[0] = np.inf
    state.numbers[1] = max(state.numbers[1], reaction)


@njit(cache=True)
def run(
    system: System, scheme: Scheme, state: State, step: float, substeps: int, base: Array, kept: Ints, work: Work,
    displacement: Array, energies: Array,
) -> int:  # fmt: skip
    """Fill ``displacement`` (count, kept) and ``energies`` (count, 3): kinetic, strain, work; returns how many."""
    for sample in range(len(displacement)):
        if sample:
            for part in range(substeps):
                if not _advance(system, scheme, state, step, base, (sample - 1) * substeps + part, work):
                    return sample
        _spread(system, state.u, work.whole)
        flat = work.whole.reshape(-1)
        for k in range(len(kept)):
            displacement[sample, k] = flat[kept[k]]
        _times_mass(system, state.v, work.step)
        energies[sample, 0] = 0.5 * _dot(work.step, state.v)
        e = state.strains
        if scheme.viscous_time == 0.0:
            e = sampled_strains(system.elements, system.tables, work.whole)
        energies[sample, 1] = strain_energy(system.law, system.parameters, system.elements, system.tables, e).sum()
        energies[sample, 2] = state.numbers[2]
    return len(displacement)
