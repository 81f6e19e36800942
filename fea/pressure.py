"""Pressure and tractions on surfaces."""

from collections.abc import Callable

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fea.surface import Surface
from fea.terms import Steady

Array = NDArray[np.float64]


def _at_once(t: float) -> float:
    return t


class Pressure(Steady):
    """Uniform pressure on a surface, against its outward normal: a ``fea.terms.Term``.

    A follower pressure turns and grows with the surface.  Its tangent is symmetrised.  That is exact where
    the pressure has a potential: on closed surfaces, and where the edge of the surface is held or lies and
    stays in a plane, as on planes of symmetry.  Elsewhere Newton's method only converges more slowly; the
    force is exact always.

    Parameters
    ----------
    surface
        Where it acts.
    points
        Reference coordinates of all nodes (N, 3), m.
    pressure
        Pa; negative pulls.
    follower
        False keeps the nodal forces of the undeformed surface.
    ramp
        Factor as a function of t; t itself by default.
    order
        Polynomial order that the quadrature is exact for.
    """

    def __init__(
        self, surface: Surface, points: Array, pressure: float, follower: bool = True,
        ramp: Callable[[float], float] = _at_once, order: int = 5,
    ) -> None:  # fmt: skip
        self.surface, self.pressure, self.follower, self.ramp = surface, pressure, follower, ramp
        self._points = points
        self._shapes = surface.shapes(order)
        self._t = 0.0
        everywhere, nowhere = surface.facets, surface.facets[:0]
        self._cells = np.ascontiguousarray(everywhere if follower else nowhere, dtype=np.int64)
        self._dead = self._forces(points)

    @property
    def cells(self) -> NDArray[np.int64]:
        """See ``Term``."""
        return self._cells

    def _forces(self, positions: Array) -> Array:
        """Nodal forces (N, 3), m^2, of a unit pressure, with the sign of internal forces."""
        return _force(self._facets, positions, self._shapes.values, self._shapes.slopes, self._shapes.weights)

    @property
    def _facets(self) -> NDArray[np.int64]:
        return np.ascontiguousarray(self.surface.facets, dtype=np.int64)

    def force(self, x: Array, t: float) -> Array:
        """See ``Term``."""
        self._t = t
        return self.pressure * self.ramp(t) * (self._forces(self._points + x) if self.follower else self._dead)

    def tangent(self, x: Array, t: float) -> Array:
        """See ``Term``."""
        shapes = self._shapes
        unit = _tangent(self._cells, self._points + x, shapes.values, shapes.slopes, shapes.weights)
        return self.pressure * self.ramp(t) * unit

    def energy(self, x: Array, t: float) -> float:
        """Pressure times the volume that the surface has swept outwards, J: -p V of the room it fills."""
        if not self.follower:
            return self.pressure * self.ramp(t) * float(np.sum(self._dead * x))
        return self.pressure * self.ramp(t) * self._swept(x)

    def _swept(self, x: Array) -> float:
        """Volume, m^3, between the surface and where it came from: quadratic along the way, so two stations do."""
        stations = 0.5 + np.array([-0.5, 0.5]) / np.sqrt(3.0)
        return sum(float(np.sum(self._forces(self._points + station * x) * x)) for station in stations) / 2

    def report(self, x: Array) -> dict[str, float]:
        """Pressure at the last t, and the volume swept outwards."""
        return {"pressure [Pa]": self.pressure * self.ramp(self._t), "swept volume [m^3]": self._swept(x)}


def traction(surface: Surface, points: Array, vector: Array, order: int = 5) -> Array:
    """Dead nodal forces (N, 3), N, of a force per undeformed area.

    Parameters
    ----------
    surface
        Where it acts.
    points
        Reference coordinates of all nodes (N, 3), m.
    vector
        Traction (3,), Pa.
    order
        Polynomial order that the quadrature is exact for.
    """
    return surface.areas(points, order)[:, None] * np.asarray(vector, dtype=float)


@njit(cache=True)
def _force(facets: NDArray[np.int64], positions: Array, values: Array, slopes: Array, weights: Array) -> Array:
    result = np.zeros_like(positions)
    a, b = np.empty(3), np.empty(3)
    for f in range(len(facets)):
        for q in range(len(weights)):
            a[:], b[:] = 0.0, 0.0
            for n in range(facets.shape[1]):
                for i in range(3):
                    a[i] += slopes[q, 0, n] * positions[facets[f, n], i]
                    b[i] += slopes[q, 1, n] * positions[facets[f, n], i]
            for n in range(facets.shape[1]):
                weight, node = weights[q] * values[q, n], facets[f, n]
                result[node, 0] += weight * (a[1] * b[2] - a[2] * b[1])
                result[node, 1] += weight * (a[2] * b[0] - a[0] * b[2])
                result[node, 2] += weight * (a[0] * b[1] - a[1] * b[0])
    return result


@njit(cache=True)
def _tangent(facets: NDArray[np.int64], positions: Array, values: Array, slopes: Array, weights: Array) -> Array:
    """d(x_r x x_s) = dx_r x x_s + x_r x dx_s, weighted, and its transpose, halved."""
    k = facets.shape[1]
    result = np.zeros((len(facets), 3 * k, 3 * k))
    a, b, c = np.empty(3), np.empty(3), np.empty(3)
    for f in range(len(facets)):
        for q in range(len(weights)):
            a[:], b[:] = 0.0, 0.0
            for n in range(k):
                for i in range(3):
                    a[i] += slopes[q, 0, n] * positions[facets[f, n], i]
                    b[i] += slopes[q, 1, n] * positions[facets[f, n], i]
            for m in range(k):
                for i in range(3):
                    c[i] = slopes[q, 1, m] * a[i] - slopes[q, 0, m] * b[i]
                for n in range(k):
                    weight = 0.5 * weights[q] * values[q, n]
                    for i in range(3):
                        j, l = (i + 1) % 3, (i + 2) % 3  # noqa: E741
                        # The matrix of c x: entry (i, j) is -c_l, entry (i, l) is +c_j.
                        result[f, 3 * n + i, 3 * m + j] -= weight * c[l]
                        result[f, 3 * m + j, 3 * n + i] -= weight * c[l]
                        result[f, 3 * n + i, 3 * m + l] += weight * c[j]
                        result[f, 3 * m + l, 3 * n + i] += weight * c[j]
    return result
