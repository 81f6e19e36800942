"""A row of pressurised chambers on the inside of a shell, without a mesh of its own."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fea import shell_geometry as geometry
from fea.chamber_layer import DEPTHS, Fibres, Layer, Work
from fea.shell import Shell
from fea.terms import Steady

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

#: Points per direction of an element, and smaller ones for each of them that tell how much of it lies in the row.
_POINTS, _FINER = 4, 8
#: The tops meet their images across this axis; width of the contact's blend over the height.
_AXIS, _BLEND = 1, 0.02
#: Shear modulus of the walls over Young's: of what keeps its volume.
_SHEAR = 1.0 / 3.0


@dataclass(frozen=True)
class Walls:
    """What chambers are made of.

    Parameters
    ----------
    modulus
        Young's modulus E, Pa.
    top
        Thickness of the tops t1, m.
    taut
        Share of the tops' stiffness across the chambers: 1 where they stretch, 0 where they bulge instead.
    along
        Share of the stiffness of tops and side walls along the tube: 1 where they stretch, less where they fold.
    touching
        Width of a chamber over the distance of neighbours at the tops: the stretch below which they touch.
    sides
        Volume of the walls between the chambers, m^3.
    """

    modulus: float
    top: float
    taut: float
    along: float
    touching: float
    sides: float


class ChamberRow(Steady):
    """A layer of chambers under the bottom of a shell that is blown up: a ``fea.terms.Term``.

    Their side walls are taken to stand on the shell, along its directors, and to keep their height: the layer between
    the bottom b and the tops b - h d follows the shell.  The pressure p works on the volume V of the cavities; tops
    stretch across the chambers, and push where neighbours touch; tops and side walls stretch along them:

        W = -p (V - V0) + sum of k (s^2 + 2/s - 3) / 6 over all fibres + integral of G t1 g^2 / 2 over the tops

    with the fibres' stretch s and the shear g of the tops, against which chambers are closed boxes.

    The tops may not pass the plane y = 0, beyond which are their mirror images: they press by E f(-y) / h, with the
    smoothed f of ``fea.contact.law``, so that they give way by a thirtieth of h under a thirtieth of E.  What is left
    out: that side walls bulge, lean and bend, and the end walls.

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
    walls
        Stiffness.
    across
        Unit vectors (n, 3) across the chambers at places (n, 3), m.
    pressure
        p, Pa, as a function of t.

    Attributes
    ----------
    layer_volume
        Volume of the layer at rest, of which the cavities are a part, m^3.
    """

    def __init__(
        self, part: Shell, inside: Callable[[Array], NDArray[np.bool_]], height: float, cavity: float,
        walls: Walls, across: Callable[[Array], Array], pressure: Callable[[float], float],
    ) -> None:  # fmt: skip
        self._h, self._walls, self._pressure = height, walls, pressure
        places, weights = np.polynomial.legendre.leggauss(_POINTS)
        self._shapes = geometry.quad9(geometry.grid(places, places))
        shares = _covered(part, inside, weights)
        elements = np.flatnonzero(shares.any(axis=1))
        spots = self._shapes[0] @ part.mid[part.surface_cells[elements]]
        self._cells = part.cells[elements]
        self._weights = np.outer(weights, weights).ravel() * shares[elements]
        self._rest = part.points[self._cells]
        self._makes = _field_shapes(*self._shapes)
        self._places = np.stack([np.kron(self._shapes[0], [1.0, 0.0]), self._makes[:, 2]], axis=1)
        rows, columns = (by @ part.mid[part.surface_cells[elements]] for by in self._shapes[1:])
        # How r and s change over a metre across, and along.
        frame = np.stack([rows, columns, np.cross(rows, columns)], axis=-1)
        sideways = across(spots.reshape(-1, 3)).reshape(spots.shape)
        onwards = np.cross(frame[..., 2], sideways)
        onwards /= np.linalg.norm(onwards, axis=2, keepdims=True)
        ways = [np.asarray(np.linalg.solve(frame, way[..., None])[..., :2, 0]) for way in (sideways, onwards)]
        # Cavities fill that share of the layer, and side walls that one.
        whole = self._swept(self._rest)
        self._fill, self.layer_volume = cavity / whole, whole
        self._area = self._areas(height)
        self._string(*ways)

    def _string(self, across: Array, along: Array) -> None:
        """Tops and side walls as fibres."""
        walls, h = self._walls, self._h
        stiff = walls.modulus * walls.top
        upright = walls.along * walls.modulus * walls.sides / self.layer_volume * h / 2
        self._across, self._along = self._strung(across, h, stiff), self._strung(along, h, walls.along * stiff)
        self._fibres = [
            self._strung(across, h, walls.taut * stiff),
            self._strung(across, h, stiff, walls.touching),
            self._along,
            *(self._strung(along, h * depth, upright) for depth in DEPTHS),
        ]

    def _areas(self, depth: float) -> Array:
        """Of the layer at rest, of every point at a depth (elements, points), m^2."""
        a, b = np.moveaxis(self._layer(self._rest).slopes(depth), 2, 0)
        return np.asarray(np.linalg.norm(np.cross(a, b), axis=2) * self._weights)

    def _strung(self, ways: Array, depth: float, stiffness: float, touching: float | None = None) -> Fibres:
        """Fibres of a ``stiffness`` per area, N/m."""
        tangent = np.einsum("eqk,eqki->eqi", ways, self._layer(self._rest).slopes(depth))
        return Fibres(ways, depth, np.linalg.norm(tangent, axis=2), stiffness * self._areas(depth), touching)

    @property
    def cells(self) -> Ints:
        """See ``Term``."""
        return self._cells

    def _now(self, x: Array) -> Array:
        return self._rest + x[self._cells]

    def _layer(self, ends: Array) -> Layer:
        """The layer with nodes at ``ends`` (elements, 18, 3)."""
        return Layer(np.einsum("qfn,eni->eqfi", self._makes, ends, optimize=True), self._h)

    def _swept(self, ends: Array) -> float:
        """Volume of the layer, m^3."""
        return self._layer(ends).volume(self._weights).energy

    def _worked(self, layer: Layer, t: float, second: bool = False) -> Work:
        """Energy but for a constant, and its derivatives by the fields, without meeting tops."""
        work = layer.volume(-self._pressure(t) * self._fill * self._weights, second)
        for fibres in self._fibres:
            work.add(layer.stretch(fibres, second))
        work.add(layer.shear(self._across, self._along, _SHEAR, second))
        return layer.carried(work)

    def _tops(self, layer: Layer, ends: Array) -> tuple[Array, Array, Array]:
        """Places of the tops along the axis, and their derivatives, see ``Layer.height_of_tops``."""
        floor = np.einsum("qn,eni->eqi", self._shapes[0], ends[:, ::2])
        return layer.height_of_tops(floor[..., _AXIS], _AXIS)

    def _met(self, layer: Layer, ends: Array, second: bool = False) -> tuple[float, Array, Array | None]:
        """Energy of tops that meet their images, and its derivatives by b and D: (..., 2, 3), (..., 2, 3, 2, 3)."""
        place, by, bent = self._tops(layer, ends)
        depth, blend = np.maximum(-place, 0.0), _BLEND * self._h
        low, penalty = np.minimum(depth, blend), self._area * self._walls.modulus / self._h
        over = depth - low
        energy = penalty * (low**3 / (6 * blend) + over * blend / 2 + over**2 / 2)
        push, slope = penalty * (low**2 / (2 * blend) + over), penalty * low / blend
        way = np.stack([np.broadcast_to(np.eye(3)[_AXIS], by.shape), by], axis=2)
        first, matrix = -push[..., None, None] * way, None
        if second:
            matrix = np.einsum("eq,eqfi,eqgj->eqfigj", slope, way, way, optimize=True)
            matrix[:, :, 1, :, 1, :] -= push[..., None, None] * bent
        return float(energy.sum()), first, matrix

    def force(self, x: Array, t: float) -> Array:
        """See ``Term``."""
        ends, result = self._now(x), np.zeros_like(x)
        layer = self._layer(ends)
        onto = np.einsum("qfn,eqfi->eni", self._makes, self._worked(layer, t).first, optimize=True)
        onto += np.einsum("qfn,eqfi->eni", self._places, self._met(layer, ends)[1], optimize=True)
        np.add.at(result, self._cells, onto)
        return result

    def tangent(self, x: Array, t: float) -> Array:
        """See ``Term``."""
        ends = self._now(x)
        layer = self._layer(ends)
        work, met = self._worked(layer, t, second=True).second, self._met(layer, ends, second=True)[2]
        assert work is not None
        assert met is not None
        return _on_nodes(work, self._makes) + _on_nodes(met, self._places)

    def energy(self, x: Array, t: float) -> float:
        """Stretch of the walls and meeting tops less the work of the pressure, J."""
        ends = self._now(x)
        layer = self._layer(ends)
        at_rest = self._pressure(t) * self._fill * self.layer_volume
        return self._worked(layer, t).energy + at_rest + self._met(layer, ends)[0]

    def report(self, x: Array) -> dict[str, float]:
        """Force of meeting tops, and how far they have passed the plane."""
        ends = self._now(x)
        layer = self._layer(ends)
        return {
            "force of meeting tops [N]": -float(self._met(layer, ends)[1][:, :, 0, _AXIS].sum()),
            "lowest top [m]": float(self._tops(layer, ends)[0][self._weights > 0].min()),
        }

    def growth(self, x: Array) -> float:
        """Volume of the cavities over that at rest."""
        return self._swept(self._now(x)) / self.layer_volume


def _covered(part: Shell, inside: Callable[[Array], NDArray[np.bool_]], weights: Array) -> Array:
    """Share of what every point stands for that lies inside (elements, points): edges run across elements."""
    starts = np.concatenate([[-1.0], -1.0 + np.cumsum(weights)[:-1]])
    steps = (np.arange(_FINER) + 0.5) / _FINER
    finer = (starts[:, None] + weights[:, None] * steps).ravel()
    spots = geometry.quad9(geometry.grid(finer, finer))[0] @ part.mid[part.surface_cells]
    chosen = inside(spots.reshape(-1, 3)).reshape(-1, _POINTS, _FINER, _POINTS, _FINER)
    return np.asarray(chosen.mean(axis=(2, 4)).reshape(-1, _POINTS**2))


def _field_shapes(values: Array, by_r: Array, by_s: Array) -> Array:
    """Fields of ``fea.chamber_layer`` at the points by the nodes, bottom and top in turn (points, 5, 18)."""
    result = np.zeros((len(values), 5, 9, 2))
    result[:, 0, :, 0], result[:, 1, :, 0] = by_r, by_s
    for number, shapes in enumerate((values, by_r, by_s), 2):
        result[:, number, :, 0], result[:, number, :, 1] = -shapes, shapes
    return result.reshape(len(values), 5, 18)


def _on_nodes(second: Array, makes: Array) -> Array:
    """Matrices (elements, 54, 54) of second derivatives (elements, points, fields, 3, fields, 3)."""
    count, points, fields = second.shape[:3]
    half = np.einsum("eqfigj,qgn->eqfinj", second, makes, optimize=True).reshape(count, points * fields, -1)
    return np.asarray((makes.reshape(points * fields, 18).T @ half).reshape(count, 54, 54))
