"""The straight edge of a rigid plate that pushes a sheet along a line: frictionless, and free to slide along it."""

import numpy as np
from numpy.typing import NDArray

from fea.tendons import Ramp
from fea.terms import Steady

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

#: Width, over the sheet's thickness, in which contact begins: where an edge rolls from column to column, a narrower one
#: costs ten times the steps and changes no peak by half a percent.
_BLEND = 5e-2
_ITERATIONS = 30


class PlateEdge(Steady):
    """An edge across a sheet, at a fixed height; the plate moves along its normal: a ``fea.terms.Term``.

    Stations of the edge lie on columns of nodes along the sheet.  Every increment begins by looking where each column
    crosses the edge's height; there, until its end, the plate holds it back with the pressure of a stiff spring.  A
    column that ends below the height has slipped off, under the plate, and does not come back.

    Parameters
    ----------
    columns
        Nodes of one face along the sheet (stations, 2 elements + 1), ends and middles of elements in turn.
    shares
        Of the stations in the edge (stations,), summing to what part of the edge is modelled.
    places
        Of the columns' nodes along the sheet, m (stations, 2 elements + 1).
    points
        Reference coordinates of all nodes (N, 3), m.
    stiffness
        Of the whole edge, N/m.
    thickness
        Of the sheet, m.

    Attributes
    ----------
    way
        Of the plate from first touch, m, over time.
    """

    def __init__(
        self, columns: Ints, shares: Array, places: Array, points: Array, stiffness: float, thickness: float
    ) -> None:
        self._columns, self._shares, self._places, self._points = columns, shares, places, points
        self._k, self._w = stiffness, _BLEND * thickness
        self.way = Ramp()
        self._started = self._new = False
        self._normal, self._upwards = np.zeros(3), np.zeros(3)
        self._start = self._height = 0.0
        self._first, self._on = np.zeros(len(columns), dtype=np.int64), np.zeros(len(columns), dtype=bool)
        self._slipped = np.zeros(len(columns), dtype=bool)
        self._values = np.zeros((len(columns), 3))

    def meet(self, x: Array, normal: Array, upwards: Array, point: Array) -> None:
        """Bring the plate up from far until it just touches.

        Parameters
        ----------
        x
            Displacements of all nodes (N, 3), m.
        normal
            Unit vector of the plate's way, at the sheet (3,).
        upwards
            Unit vector in the plate across its edge (3,): the plate lies above, the sheet's free end too.
        point
            Any point at the edge's height (3,), m.
        """
        self._normal, self._upwards, self._height = normal, upwards, float(point @ upwards)
        self._started = self._new = True
        self._on[:] = self._slipped[:] = False
        self._look(x)
        if not self._on.any():
            raise ValueError("the plate's edge lies beyond the tip of the fin: lower its place")
        self._start = float((self._at(x)[self._on] @ normal).min())

    @property
    def slipped_off(self) -> bool:
        """Whether none of the sheet is left before the plate."""
        return self._started and not self._on.any()

    @property
    def cells(self) -> Ints:
        """See ``Term``."""
        return np.take_along_axis(self._columns, self._first[:, None] + np.arange(3), axis=1)

    def prepare(self, x: Array) -> bool:
        """Find where columns cross the edge's height; True when that is in other elements than before."""
        before, on = self._first, self._on
        if self._started:
            self._look(x)
        changed = self._new or not (np.array_equal(before, self._first) and np.array_equal(on, self._on))
        self._new = False
        return changed

    def _look(self, x: Array) -> None:
        heights = (self._points + x[: len(self._points)])[self._columns] @ self._upwards - self._height
        ends = heights[:, ::2]
        crossed = (ends[:, :-1] < 0) & (ends[:, 1:] >= 0)
        self._slipped |= self._on & ~crossed.any(axis=1)
        self._on = crossed.any(axis=1) & ~self._slipped
        first = np.where(self._on, 2 * crossed.argmax(axis=1), self._first)
        low, high = np.zeros(len(first)), np.full(len(first), 2.0)
        inside = np.take_along_axis(heights, first[:, None] + np.arange(3), axis=1)
        for _ in range(_ITERATIONS):
            middle = 0.5 * (low + high)
            below = (inside * _lagrange(middle)).sum(axis=1) < 0
            low, high = np.where(below, middle, low), np.where(below, high, middle)
        self._values = _lagrange(0.5 * (low + high)) * self._on[:, None]
        self._first = first

    def _at(self, x: Array) -> Array:
        """Positions of the stations (stations, 3), m."""
        cells = self.cells
        return np.einsum("mk,mkc->mc", self._values, self._points[cells] + x[cells])

    def _pressed(self, x: Array, t: float) -> tuple[Array, Array, Array]:
        """Force, N, stiffness, N/m, and energy, J, of every station (stations,)."""
        depth = np.maximum(self._start + self.way(t) - self._at(x) @ self._normal, 0.0)
        stiffness = self._k * self._shares * self._on * self._started
        curved = depth < self._w
        force = np.where(curved, depth**2 / (2 * self._w), depth - self._w / 2)
        energy = np.where(curved, depth**3 / (6 * self._w), depth * (depth - self._w) / 2 + self._w**2 / 6)
        return stiffness * force, stiffness * np.where(curved, depth / self._w, 1.0), stiffness * energy

    def pressing(self, x: Array, t: float) -> float:
        """Force of the modelled part of the plate along its way, N."""
        return float(self._pressed(x, t)[0].sum())

    def place(self, x: Array, t: float) -> float:
        """Where along the sheet the force acts, m; NaN where nothing touches."""
        force, cells = self._pressed(x, t)[0], self._first[:, None] + np.arange(3)
        along = (np.take_along_axis(self._places, cells, axis=1) * self._values).sum(axis=1)
        return float(force @ along / force.sum()) if force.sum() > 0 else np.nan

    def force(self, x: Array, t: float) -> Array:
        """See ``Term``."""
        result = np.zeros_like(x)
        shared = -self._pressed(x, t)[0][:, None] * self._values
        np.add.at(result, self.cells, shared[:, :, None] * self._normal)
        return result

    def tangent(self, x: Array, t: float) -> Array:
        """See ``Term``."""
        along = (self._values[:, :, None] * self._normal).reshape(len(self._values), 9)
        return self._pressed(x, t)[1][:, None, None] * along[:, :, None] * along[:, None, :]

    def energy(self, x: Array, t: float) -> float:
        """In the spring of the plate, J."""
        return float(self._pressed(x, t)[2].sum())

    def report(self, x: Array) -> dict[str, float]:
        """How much of the edge is still on the sheet."""
        return {"stations on the sheet": float(self._on.sum())}


def _lagrange(at: Array) -> Array:
    """Parabolas (n, 3) through ends and middle of an element, 0..2, at ``at`` (n,)."""
    return np.stack([(at - 1) * (at - 2) / 2, at * (2 - at), at * (at - 1) / 2], axis=1)
