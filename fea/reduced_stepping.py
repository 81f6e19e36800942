"""Compiled time steps of ``fea.reduced``: those of ``fea.shell_stepping`` in the few numbers of a reduced model."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fea import foresight, multisecant
from fea.foresight import Trail
from fea.multisecant import DEPTH

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

_PATIENCE, _MOST = 8, 40
_SUMS = {"reassoc", "contract", "nsz"}


class Reduced(NamedTuple):
    """Equations of r numbers q whose modal masses are one.

    Parameters
    ----------
    strains
        Strains (k, m) whose half square is the energy, linear in the m monomials q_i, q_i q_j (i <= j), J^0.5.
    push
        Force (r, 3) for a unit acceleration of the base, without its sign.
    load
        Constant forces (r,).
    """

    strains: Array
    push: Array
    load: Array


class Scheme(NamedTuple):
    """As in ``fea.shell_stepping``."""

    alpha_m: float
    alpha_f: float
    beta: float
    gamma: float
    viscous_time: float
    mass_damping: float
    tolerance: float


class Shelf(NamedTuple):
    """Inverse tangents (kept, r, r), their states (kept, r), ``[filled, next]``."""

    inverses: Array
    states: Array
    count: Ints


@njit(cache=True)
def monomials(q: Array, z: Array) -> None:
    """Fill z (m,) with q_i, then q_i q_j, i <= j."""
    r, place = len(q), len(q)
    for i in range(r):
        z[i] = q[i]
    for i in range(r):
        for j in range(i, r):
            z[place] = q[i] * q[j]
            place += 1


@njit(cache=True)
def _pulled(q: Array, s: Array, result: Array) -> None:
    """(dz/dq)'s (r,)."""
    r, place = len(q), len(q)
    for i in range(r):
        result[i] = s[i]
    for i in range(r):
        total = 0.0
        for j in range(i, r):
            total += s[place] * q[j]
            result[j] += s[place] * q[i]
            place += 1
        result[i] += total


@njit(cache=True)
def _slopes(q: Array, result: Array) -> None:
    """dz/dq (m, r)."""
    r, place = len(q), len(q)
    result[:] = 0.0
    for i in range(r):
        result[i, i] = 1.0
    for i in range(r):
        for j in range(i, r):
            result[place, i] += q[j]
            result[place, j] += q[i]
            place += 1


@njit(cache=True)
def force(model: Reduced, q: Array, viscosity: float, past: Array, z: Array, result: Array) -> None:
    """Elastic and viscous force (r,); leaves the monomials in ``z``."""
    monomials(q, z)
    strain = np.dot(model.strains, (1.0 + viscosity) * z + past)
    _pulled(q, np.dot(strain, model.strains), result)


@njit(cache=True)
def _inverse(model: Reduced, scheme: Scheme, q: Array, viscosity: float, past: Array, pulls: float) -> Array:
    """Inverse of the derivative of the residual (r, r)."""
    r, m = len(q), model.strains.shape[1]
    z, slopes = np.empty(m), np.empty((m, r))
    monomials(q, z)
    _slopes(q, slopes)
    stress = np.dot(np.dot(model.strains, (1.0 + viscosity) * z + past), model.strains)
    b = np.dot(model.strains, slopes)
    tangent = (1.0 + viscosity) * np.dot(b.T, b)
    place = r
    for i in range(r):
        for j in range(i, r):
            tangent[i, j] += stress[place]
            tangent[j, i] += stress[place]
            place += 1
    tangent *= 1.0 - scheme.alpha_f
    for i in range(r):
        tangent[i, i] += pulls
    return np.linalg.inv(tangent)


@njit(cache=True)
def _nearest(shelf: Shelf, q: Array) -> int:
    best, least = -1, np.inf
    for number in range(shelf.count[0]):
        distance = 0.0
        for k in range(len(q)):
            distance += (q[k] - shelf.states[number, k]) ** 2
        if distance < least:
            best, least = number, distance
    return best


@njit(cache=True)
def _newton(
    model: Reduced, scheme: Scheme, shelf: Shelf, known: Array, pulls: float, viscosity: float, past: Array,
    q: Array, z: Array, forces: Array, largest: Array, counts: Ints,
) -> bool:  # fmt: skip
    """Find the end ``q`` of a step from a guess: pulls q + (1 - alpha_f) f(q) = known."""
    r, learnt, chosen = len(q), 0, -1
    steps, answers, right = np.empty((DEPTH + 1, r)), np.empty((DEPTH + 1, r)), np.empty(r)
    for number in range(_MOST):
        force(model, q, viscosity, past, z, forces)
        counts[1] += 1
        size, scale = 0.0, 0.0
        for k in range(r):
            right[k] = known[k] - pulls * q[k] - (1.0 - scheme.alpha_f) * forces[k]
            size += right[k] ** 2
            scale += forces[k] ** 2
        if not np.isfinite(size):
            return False
        size, scale = np.sqrt(size), max(largest[0], np.sqrt(scale))
        if size <= scheme.tolerance * scale:
            largest[0] = scale
            return True
        if chosen < 0:
            chosen = _nearest(shelf, q)
        if chosen < 0 or (number and number % _PATIENCE == 0):
            chosen, learnt = shelf.count[1], 0
            shelf.inverses[chosen] = _inverse(model, scheme, q, viscosity, past, pulls)
            shelf.states[chosen] = q
            shelf.count[0] = max(shelf.count[0], chosen + 1)
            shelf.count[1] = (chosen + 1) % len(shelf.states)
            counts[2] += 1
        step = np.dot(shelf.inverses[chosen], right)
        learnt = multisecant.improve(steps, answers, learnt, step)
        for k in range(r):
            q[k] += step[k]
    return False


@njit(cache=True)
def run(
    model: Reduced, scheme: Scheme, shelf: Shelf, trail: Trail, q: Array, v: Array, a: Array, past: Array,
    step: float, substeps: int, instants: int, base: Array, result: Array, energies: Array, counts: Ints,
) -> int:  # fmt: skip
    """Fill ``result`` (samples, r) and ``energies`` (samples, 2), kinetic and strain; returns how many.

    ``q``, ``v`` are the start and then the end; ``past`` (m,) is the viscous time times the rate of the monomials.
    """
    r, m = len(q), model.strains.shape[1]
    am, af, beta, gamma, drag = scheme.alpha_m, scheme.alpha_f, scheme.beta, scheme.gamma, scheme.mass_damping
    z, earlier, now, forces, old, known, u = (
        np.empty(m), np.empty(m), np.empty(m), np.empty(r), np.empty(r), np.empty(r), np.empty(r)
    )  # fmt: skip
    tiny = np.finfo(np.float64).tiny
    force(model, q, tiny, past, z, old)
    a[:] = model.load - np.dot(model.push, base[0]) - old - drag * v
    earlier[:] = z
    largest = np.array([max(np.sqrt((old**2).sum()), np.sqrt((v**2).sum()) / step)])
    pulls = ((1.0 - am) / step + (1.0 - af) * gamma * drag) / (beta * step)
    tau, ratio = scheme.viscous_time / step, 0.0
    for number in range((len(result) - 1) * substeps + 1):
        if number % substeps == 0:
            sample = number // substeps
            result[sample] = q
            strain = np.dot(model.strains, z)
            energies[sample, 0], energies[sample, 1] = 0.5 * np.dot(v, v), 0.5 * np.dot(strain, strain)
        if number == (len(result) - 1) * substeps:
            break
        first, last = min(instants * number, len(base) - 1), min(instants * (number + 1), len(base) - 1)
        outer = af * base[first] + (1.0 - af) * base[last]
        push = np.dot(model.push, outer)
        for k in range(r):
            a0 = -(q[k] + step * v[k]) / (beta * step**2) - (0.5 / beta - 1.0) * a[k]
            v0 = v[k] + step * ((1.0 - gamma) * a[k] + gamma * a0)
            inertia = (1.0 - am) * a0 + am * a[k] + drag * ((1.0 - af) * v0 + af * v[k])
            known[k] = model.load[k] - push[k] - inertia - af * old[k]
        viscosity = tau * (1.0 + 2.0 * ratio) / (1.0 + ratio)
        past[:] = tau * (ratio**2 / (1.0 + ratio) * earlier - (1.0 + ratio) * z)
        if not foresight.guess(trail, u):
            u[:] = q + step * v + 0.5 * step**2 * a
        if not _newton(model, scheme, shelf, known, pulls, viscosity, past, u, now, forces, largest, counts):
            return number // substeps + 1
        counts[0] += 1
        foresight.remember(trail, u)
        for k in range(r):
            a1 = (u[k] - q[k] - step * v[k]) / (beta * step**2) - (0.5 / beta - 1.0) * a[k]
            v[k] += step * ((1.0 - gamma) * a[k] + gamma * a1)
            a[k], q[k], old[k] = a1, u[k], forces[k]
        earlier[:] = z
        z[:] = now
        ratio = 1.0
    return len(result)
