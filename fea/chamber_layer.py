"""A layer under a shell's bottom, point by point: volume, stretch and meeting tops, with both derivatives.

Fields at a point are the bottom's slopes b_r, b_s and D, D_r, D_s, the vector to the upper face with its slopes,
stacked (elements, points, 5, 3).  The director d = D / |D| has the slopes d_r, d_s, and at the depth z the layer has

    a = b_r - z d_r,   b = b_s - z d_s,   volume per area and depth (a x b) . d

Everything is first worked out in b_r, b_s, d, d_r, d_s, and then carried over to the fields.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Points through the layer over its height: the volume is of the second degree in the depth.
DEPTHS = 0.5 * (1.0 + np.array([-1.0, 1.0]) / np.sqrt(3.0))
#: Sign of permutations.
_SIGNS = np.zeros((3, 3, 3))
_SIGNS[[0, 1, 2], [1, 2, 0], [2, 0, 1]] = 1.0
_SIGNS[[0, 2, 1], [2, 1, 0], [1, 0, 2]] = -1.0


@dataclass
class Work:
    """An energy, J, and its derivatives by five vectors at every point, as far as they were asked for.

    Attributes
    ----------
    first
        (elements, points, 5, 3).
    second
        (elements, points, 5, 3, 5, 3).
    """

    energy: float
    first: Array
    second: Array | None = None

    def add(self, other: "Work") -> None:
        """Add another one."""
        self.energy += other.energy
        self.first += other.first
        if self.second is not None and other.second is not None:
            self.second += other.second


@dataclass(frozen=True)
class Fibres:
    """Fibres of one direction at one depth, as of neo-Hookean rubber: W = k (s^2 + 2/s - 3) / 6 at the stretch s.

    It grows without bound towards s = 0, so that no layer is crushed to nothing.

    Parameters
    ----------
    ways
        Their direction as shares of a and b (elements, points, 2), 1/m.
    depth
        m.
    length
        Of that vector at rest (elements, points).
    stiffness
        k, what Young's modulus times their volume is at a point (elements, points), J.
    touching
        Fibres that only push, from this stretch down, and count s from there; None: they pull as well.
    """

    ways: Array
    depth: float
    length: Array
    stiffness: Array
    touching: float | None = None


@dataclass(frozen=True)
class Layer:
    """A layer at given fields (elements, points, 5, 3).

    Parameters
    ----------
    height
        h, m.
    """

    fields: Array
    height: float

    @cached_property
    def _size(self) -> Array:
        return np.asarray(np.linalg.norm(self.fields[:, :, 2], axis=2))

    @cached_property
    def inner(self) -> Array:
        """b_r, b_s, d, d_r, d_s in the place of the fields."""
        result = self.fields.copy()
        result[:, :, 2] /= self._size[..., None]
        for slope in (3, 4):
            result[:, :, slope] = self._across(self.fields[:, :, slope]) / self._size[..., None]
        return result

    def _along(self, vector: Array) -> Array:
        director = self.fields[:, :, 2] / self._size[..., None]
        return np.asarray((vector * director).sum(axis=2))

    def _across(self, vector: Array) -> Array:
        """What is left of vectors (elements, points, 3) without their share along d."""
        director = self.fields[:, :, 2] / self._size[..., None]
        return np.asarray(vector - self._along(vector)[..., None] * director)

    def slopes(self, depth: float) -> Array:
        """a and b at a depth, m (elements, points, 2, 3)."""
        inner = self.inner
        return np.asarray(inner[:, :, :2] - depth * inner[:, :, 3:])

    def volume(self, factors: Array, second: bool = False) -> Work:
        """Volume times ``factors`` (elements, points) of the points' areas."""
        director = self.inner[:, :, 2]
        shape = self.fields.shape
        total, first = 0.0, np.zeros(shape)
        matrix = np.zeros((*shape, 5, 3)) if second else None
        for depth in self.height * DEPTHS:
            w = (0.5 * self.height * factors)[..., None]
            a, b = np.moveaxis(self.slopes(depth), 2, 0)
            normal = w * np.cross(a, b)
            on = (w * np.cross(b, director), w * np.cross(director, a))
            total += float((normal * director).sum())
            first[:, :, 2] += normal
            for side in (0, 1):
                first[:, :, side] += on[side]
                first[:, :, 3 + side] -= depth * on[side]
            if matrix is None:
                continue
            _add(matrix, _turning(w * director), {0: 1.0, 3: -depth}, {1: 1.0, 4: -depth})
            _add(matrix, -_turning(w * b), {0: 1.0, 3: -depth}, {2: 1.0})
            _add(matrix, _turning(w * a), {1: 1.0, 4: -depth}, {2: 1.0})
        return Work(total, first, matrix)

    def stretch(self, fibres: "Fibres", second: bool = False) -> Work:
        """Energy of fibres."""
        ways, depth, length, k = fibres.ways, fibres.depth, fibres.length, fibres.stiffness
        tangent = np.einsum("eqk,eqki->eqi", ways, self.slopes(depth))
        if fibres.touching is not None:
            length = fibres.touching * length
            k = np.where((tangent**2).sum(axis=2) < length**2, k, 0.0)
        square = (tangent**2).sum(axis=2) / length**2
        energy = (square + 2.0 / np.sqrt(square) - 3.0) / 6.0
        by = k * (1.0 - square**-1.5) / (3.0 * length**2)
        factors = np.stack([ways[..., 0], ways[..., 1], 0.0 * by, *(-depth * np.moveaxis(ways, 2, 0))], 2)
        first = factors[..., None] * (by[..., None] * tangent)[:, :, None]
        matrix = None
        if second:
            bends = k * square**-2.5 / length**4
            inner = bends[..., None, None] * tangent[..., :, None] * tangent[..., None, :]
            inner += by[..., None, None] * np.eye(3)
            matrix = np.einsum("eqf,eqij,eqg->eqfigj", factors, inner, factors, optimize=True)
        return Work(float((k * energy).sum()), first, matrix)

    def shear(self, one: "Fibres", other: "Fibres", modulus: float, second: bool = False) -> Work:
        """Energy G g^2 / 2 of the shear g between two families at one depth; ``modulus`` is G over Young's."""
        factors, vectors = [], []
        for fibres in (one, other):
            scaled = fibres.ways / fibres.length[..., None]
            vectors.append(np.einsum("eqk,eqki->eqi", scaled, self.slopes(fibres.depth)))
            nothing = np.zeros_like(fibres.length)
            factors.append(
                np.stack([*np.moveaxis(scaled, 2, 0), nothing, *(-fibres.depth * np.moveaxis(scaled, 2, 0))], 2)
            )
        shear, k = (vectors[0] * vectors[1]).sum(axis=2), modulus * other.stiffness
        by = factors[0][..., None] * vectors[1][:, :, None] + factors[1][..., None] * vectors[0][:, :, None]
        first, matrix = (k * shear)[..., None, None] * by, None
        if second:
            matrix = np.einsum("eq,eqfi,eqgj->eqfigj", k, by, by, optimize=True)
            mixed = np.einsum("eq,eqf,eqg,ij->eqfigj", k * shear, *factors, np.eye(3), optimize=True)
            matrix += mixed + np.moveaxis(mixed, (2, 3), (4, 5))
        return Work(float((0.5 * k * shear**2).sum()), first, matrix)

    def carried(self, work: Work) -> Work:
        """The same derivatives by the fields instead of b_r, b_s, d, d_r, d_s."""
        slopes = self._by_fields
        first = np.einsum("eqfi,eqfigj->eqgj", work.first, slopes)
        if work.second is None:
            return Work(work.energy, first)
        shape = work.second.shape
        flat, turned = work.second.reshape(*shape[:2], 15, 15), slopes.reshape(*shape[:2], 15, 15)
        matrix = (np.swapaxes(turned, -1, -2) @ flat @ turned).reshape(shape)
        self._add_curvature(matrix, work.first)
        return Work(work.energy, first, matrix)

    @cached_property
    def _plane(self) -> Array:
        """Projection across d (elements, points, 3, 3)."""
        director = self.inner[:, :, 2]
        return np.asarray(np.eye(3) - director[..., :, None] * director[..., None, :])

    @property
    def _by_fields(self) -> Array:
        """Derivative of b_r, b_s, d, d_r, d_s by the fields (elements, points, 5, 3, 5, 3)."""
        size, director, plane = self._size[..., None, None], self.inner[:, :, 2], self._plane
        result = np.zeros((*self.fields.shape, 5, 3))
        for same in (0, 1):
            result[:, :, same, :, same, :] = np.eye(3)
        for number in (2, 3, 4):
            result[:, :, number, :, number, :] = plane / size
        for number in (3, 4):
            slope = self.fields[:, :, number]
            along, across = self._along(slope)[..., None, None], self._across(slope)
            result[:, :, number, :, 2, :] = -(along * plane + _both(director, across)) / size**2
        return result

    def _bent(self, force: Array) -> Array:
        """force . second derivative of d by D, of vectors (elements, points, 3)."""
        director, along = self.inner[:, :, 2], self._along(force)[..., None, None]
        bent = along * self._plane + _both(self._across(force), director)
        return np.asarray(-bent / self._size[..., None, None] ** 2)

    def height_of_tops(self, floor: Array, axis: int) -> tuple[Array, Array, Array]:
        """Places of the tops along an ``axis``, m (elements, points), over a ``floor`` at those heights.

        And their first and second derivatives by D, (elements, points, 3) and (elements, points, 3, 3).
        """
        onwards = np.broadcast_to(-self.height * np.eye(3)[axis], self.fields[:, :, 2].shape)
        place = floor - self.height * self.inner[:, :, 2, axis]
        return place, self._across(onwards) / self._size[..., None], self._bent(onwards)

    def _add_curvature(self, matrix: Array, on: Array) -> None:
        """Second derivatives of d, d_r and d_s by the fields, times the derivatives ``on`` them."""
        size, director, plane = self._size[..., None, None], self.inner[:, :, 2], self._plane
        matrix[:, :, 2, :, 2, :] += self._bent(on[:, :, 2])
        for number in (3, 4):
            force, slope = on[:, :, number], self.fields[:, :, number]
            mixed = self._bent(force)
            matrix[:, :, 2, :, number, :] += mixed
            matrix[:, :, number, :, 2, :] += mixed
            f, w = self._along(force)[..., None, None], self._along(slope)[..., None, None]
            force, slope = self._across(force), self._across(slope)
            work = (force * slope).sum(axis=2)[..., None, None]
            matrix[:, :, 2, :, 2, :] += (
                2.0 * work * director[..., :, None] * director[..., None, :]
                + 2.0 * w * _both(force, director)
                + 2.0 * f * _both(slope, director)
                + (2.0 * f * w - work) * plane
                - _both(force, slope)
            ) / size**3


def _both(u: Array, v: Array) -> Array:
    """u v' + v u' of vectors (elements, points, 3)."""
    outer = u[..., :, None] * v[..., None, :]
    return np.asarray(outer + np.swapaxes(outer, -1, -2))


def _turning(v: Array) -> Array:
    """Matrices M with x . M y = (x x y) . v of vectors (elements, points, 3)."""
    return np.asarray(np.einsum("ijk,eqk->eqij", _SIGNS, v))


def _add(matrix: Array, block: Array, rows: dict[int, float], columns: dict[int, float]) -> None:
    """Add a block, with factors, where ``rows`` and ``columns`` of the five vectors meet, on both sides."""
    for row, by in rows.items():
        for column, times in columns.items():
            matrix[:, :, row, :, column, :] += by * times * block
            matrix[:, :, column, :, row, :] += by * times * np.swapaxes(block, -1, -2)
