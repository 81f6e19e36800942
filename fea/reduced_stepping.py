"""Compiled time steps of ``fea.reduced``: those of ``fea.shell_stepping`` in the few numbers of a reduced model."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fea import foresight
from fea.foresight import Trail
from fea.shell_stepping import Scheme

Array = NDArray[np.float64]

_MOST = 30


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
def _tangent(model: Reduced, q: Array, viscosity: float, past: Array, z: Array, slopes: Array) -> Array:
    """Derivative (r, r) of ``force``."""
    r = len(q)
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
    return tangent


@njit(cache=True)
def _newton(
    model: Reduced, scheme: Scheme, known: Array, pulls: float, viscosity: float, past: Array,
    q: Array, z: Array, slopes: Array, forces: Array, largest: Array,
) -> bool:  # fmt: skip
    """Find the end ``q`` of a step from a guess: pulls q + (1 - alpha_f) f(q) = known."""
    share = 1.0 - scheme.alpha_f
    for _ in range(_MOST):
        force(model, q, viscosity, past, z, forces)
        right = known - pulls * q - share * forces
        size, scale = np.sqrt(np.dot(right, right)), max(largest[0], np.sqrt(np.dot(forces, forces)))
        if not np.isfinite(size):
            return False
        if size <= scheme.tolerance * scale:
            largest[0] = scale
            return True
        tangent = share * _tangent(model, q, viscosity, past, z, slopes)
        for k in range(len(q)):
            tangent[k, k] += pulls
        q += np.linalg.solve(tangent, right)
    return False


@njit(cache=True)
def run(
    model: Reduced, scheme: Scheme, trail: Trail, q: Array, v: Array, a: Array, past: Array,
    step: float, substeps: int, instants: int, base: Array, result: Array, energies: Array,
) -> int:  # fmt: skip
    """Fill ``result`` (samples, r) and ``energies`` (samples, 2), kinetic and strain; returns how many.

    ``q``, ``v`` are the start and then the end; ``past`` (m,) is the viscous time times the rate of the monomials.
    """
    r, m = len(q), model.strains.shape[1]
    am, af, beta, gamma, drag = scheme.alpha_m, scheme.alpha_f, scheme.beta, scheme.gamma, scheme.mass_damping
    z, earlier, now, slopes = np.empty(m), np.empty(m), np.empty(m), np.empty((m, r))
    forces, old, known, u = np.empty(r), np.empty(r), np.empty(r), np.empty(r)
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
        if not _newton(model, scheme, known, pulls, viscosity, past, u, now, slopes, forces, largest):
            return number // substeps + 1
        foresight.remember(trail, u)
        for k in range(r):
            a1 = (u[k] - q[k] - step * v[k]) / (beta * step**2) - (0.5 / beta - 1.0) * a[k]
            v[k] += step * ((1.0 - gamma) * a[k] + gamma * a1)
            a[k], q[k], old[k] = a1, u[k], forces[k]
        earlier[:] = z
        z[:] = now
        ratio = 1.0
    return len(result)
