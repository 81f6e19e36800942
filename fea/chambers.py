"""A row of pressurised chambers on the inside of a shell, without a mesh of its own."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from fea import shell_geometry as geometry
from fea.shell import Shell
from fea.terms import Steady

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

#: Points per direction of an element, beside which the row's edges may end, and step of differences, m.
_POINTS, _STEP = 4, 1e-7


class ChamberRow(Steady):
    """A layer of chambers under the bottom of a shell that is blown up: a ``fea.terms.Term``.

    Their side walls are taken to stand on the shell, along its directors, and to keep their height: the layer between
    the bottom b and the tops b - h d follows the shell.  The pressure p works on the volume V of the cavities, and the
    tops stretch around like membranes of the stiffness k = E t1:

        W = -p (V - V0) + integral of k/2 ((|T|^2 / |T0|^2 - 1) / 2)^2 over the tops

    with the tops' tangent T across the chambers.  What is left out: that side walls bulge and lean, and bend.

    Parameters
    ----------
    part
        The shell.
    inside
        Whether places (n, 3), m, of its middle surface at rest lie in the row.
    height
        h, m.
    cavity
        Volume of the cavities V0, m^3.
    stiffness
        k, N/m.
    across
        Unit vectors (n, 3) across the chambers at places (n, 3), m.
    pressure
        p, Pa, as a function of t.
    """

    def __init__(
        self, part: Shell, inside: Callable[[Array], NDArray[np.bool_]], height: float, cavity: float,
        stiffness: float, across: Callable[[Array], Array], pressure: Callable[[float], float],
    ) -> None:  # fmt: skip
        self._h, self._k, self._pressure = height, stiffness, pressure
        places, weights = np.polynomial.legendre.leggauss(_POINTS)
        self._shapes = geometry.quad9(geometry.grid(places, places))
        spots = self._shapes[0] @ part.mid[part.surface_cells]
        chosen = inside(spots.reshape(-1, 3)).reshape(spots.shape[:2])
        elements = np.flatnonzero(chosen.any(axis=1))
        self._cells = part.cells[elements]
        self._weights = np.outer(weights, weights).ravel() * chosen[elements]
        self._rest = part.points[self._cells].reshape(-1, 9, 2, 3)
        rows, columns = (by @ part.mid[part.surface_cells[elements]] for by in self._shapes[1:])
        # How r and s change over a metre across.
        frame = np.stack([rows, columns, np.cross(rows, columns)], axis=-1)
        turned = across(spots[elements].reshape(-1, 3)).reshape(*spots[elements].shape)
        self._ways = np.linalg.solve(frame, turned[..., None])[..., :2, 0]
        # Cavities fill that share of the layer, and tops what they have to.
        self._fill = 1.0
        top = self._tops(self._rest)
        self._length, self._area = np.linalg.norm(top[0], axis=2), np.linalg.norm(top[1], axis=2) * self._weights
        self._volume = self._swept(self._rest)
        self._fill = cavity / self._volume

    @property
    def cells(self) -> Ints:
        """See ``Term``."""
        return self._cells

    def _now(self, x: Array) -> Array:
        return self._rest + x[self._cells].reshape(self._rest.shape)

    def _fields(self, ends: Array) -> tuple[Array, ...]:
        """Bottom's slopes b_r, b_s and directors' D, D_r, D_s (elements, points, 3) of nodes (elements, 9, 2, 3)."""
        bottom, along = ends[:, :, 0], ends[:, :, 1] - ends[:, :, 0]
        values, by_r, by_s = self._shapes
        return by_r @ bottom, by_s @ bottom, values @ along, by_r @ along, by_s @ along

    def _tops(self, ends: Array) -> tuple[Array, Array]:
        """Tangent across the tops, and their area vector (elements, points, 3)."""
        rows, columns, director, *slopes = self._fields(ends)
        size = np.linalg.norm(director, axis=2, keepdims=True)
        d = director / size
        a, b = (
            v - self._h * (w - d * (w * d).sum(axis=2, keepdims=True)) / size
            for v, w in zip((rows, columns), slopes, strict=True)
        )
        return a * self._ways[..., :1] + b * self._ways[..., 1:], np.cross(a, b)

    def _swept(self, ends: Array) -> float:
        """Volume of the layer, m^3."""
        return self._worked(ends, 1.0, 0.0)[0]

    def _worked(self, ends: Array, pressing: float, stretching: float) -> tuple[float, Array]:
        """pressing V + stretching U and its derivative by the nodes (elements, 9, 2, 3); U at k = 1."""
        rows, columns, director, by_r, by_s = self._fields(ends)
        size = np.linalg.norm(director, axis=2, keepdims=True)
        d = director / size

        def dot(u: Array, v: Array) -> Array:
            return np.asarray((u * v).sum(axis=2, keepdims=True))

        turn = [(w - d * dot(w, d)) / size for w in (by_r, by_s)]
        total, on = 0.0, {name: np.zeros_like(d) for name in ("r", "s", "d", "dr", "ds")}
        gauss = 0.5 * self._h * (1 + np.array([-1, 1]) / np.sqrt(3))
        for depth, weight, kind in ((gauss[0], self._h / 2, 0), (gauss[1], self._h / 2, 0), (self._h, 1.0, 1)):
            a, b = rows - depth * turn[0], columns - depth * turn[1]
            if kind == 0:
                w = (pressing * weight * self._weights)[..., None]
                total += float((w * dot(np.cross(a, b), d)).sum())
                on_a, on_b = w * np.cross(b, d), w * np.cross(d, a)
                on["d"] += w * np.cross(a, b)
            else:
                along = a * self._ways[..., :1] + b * self._ways[..., 1:]
                strain = 0.5 * (dot(along, along) / self._length[..., None] ** 2 - 1.0)
                w = (stretching * self._area)[..., None]
                total += float((0.5 * w * strain**2).sum())
                pull = w * strain * along / self._length[..., None] ** 2
                on_a, on_b = pull * self._ways[..., :1], pull * self._ways[..., 1:]
            on["r"] += on_a
            on["s"] += on_b
            on["dr"] -= depth * on_a
            on["ds"] -= depth * on_b
        onto = {}
        for name, slope, turned in (("dr", by_r, turn[0]), ("ds", by_s, turn[1])):
            g = on[name]
            onto[name] = (g - d * dot(g, d)) / size
            on["d"] -= (g * dot(d, slope) + slope * dot(g, d)) / size
            onto[name + "0"] = -dot(g, turned) * d / size
        onto["d"] = (on["d"] - d * dot(on["d"], d)) / size + onto.pop("dr0") + onto.pop("ds0")
        values, dr, ds = self._shapes
        bottom = dr.T @ on["r"] + ds.T @ on["s"]
        along = values.T @ onto["d"] + dr.T @ onto["dr"] + ds.T @ onto["ds"]
        return total, np.stack([bottom - along, along], axis=2)

    def _factors(self, t: float) -> tuple[float, float]:
        return -self._pressure(t) * self._fill, self._k

    def force(self, x: Array, t: float) -> Array:
        """See ``Term``."""
        result = np.zeros_like(x)
        np.add.at(result, self._cells, self._worked(self._now(x), *self._factors(t))[1].reshape(-1, 18, 3))
        return result

    def tangent(self, x: Array, t: float) -> Array:
        """Central differences of the force, made symmetric."""
        ends, factors = self._now(x), self._factors(t)
        result = np.empty((len(ends), 54, 54))
        for unknown in range(54):
            sides = []
            for step in (_STEP, -_STEP):
                near = ends.reshape(-1, 54).copy()
                near[:, unknown] += step
                sides.append(self._worked(near.reshape(ends.shape), *factors)[1].reshape(-1, 54))
            result[:, :, unknown] = (sides[0] - sides[1]) / (2 * _STEP)
        return 0.5 * (result + result.swapaxes(1, 2))

    def energy(self, x: Array, t: float) -> float:
        """Stretch of the tops less the work of the pressure, J."""
        pressing, stretching = self._factors(t)
        return self._worked(self._now(x), pressing, stretching)[0] - pressing * self._volume

    def growth(self, x: Array) -> float:
        """Volume of the cavities over that at rest."""
        return self._swept(self._now(x)) / self._volume
