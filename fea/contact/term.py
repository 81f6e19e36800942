"""Contact of a surface's points with facets of another one, whatever those are."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fea.contact import kernels
from fea.contact.law import ContactLaw
from fea.surface import Surface

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

#: How far beyond its facet's edge a point keeps the facet, in lengths of the facet.
_BORDER = 0.05
#: Share of the contact force by which the pressure in Coulomb's limit may lag behind.
_LAG = 0.01


@dataclass(frozen=True)
class Memory:
    """What contact points know from before.

    Parameters
    ----------
    shift
        Penetration that is made up for (n,), m; the multiplier of augmented Lagrangians.
    limit
        Largest shear (n,), Pa.
    anchor
        Master facet where slip is measured from (n,); -1 without.
    anchor_at
        Place on it (n, 2).
    slid
        Energy lost in friction, J.
    """

    shift: Array
    limit: Array
    anchor: Ints
    anchor_at: Array
    slid: float = 0.0

    @classmethod
    def blank(cls, points: int) -> "Memory":
        """Nothing has touched yet."""
        return cls(np.zeros(points), np.zeros(points), np.full(points, -1, dtype=np.int64), np.zeros((points, 2)))


@dataclass(frozen=True)
class Touch:
    """Contact points at some displacements: (n,) each, shears and normals (n, 3)."""

    gap: Array
    pressure: Array
    shear: Array
    normal: Array
    energy: float
    force: Array


class FacetContact:
    """Points of a slave surface that may not pass through master facets; base of the contact terms.

    Subclasses fill ``_masters`` and set the pairs.

    Parameters
    ----------
    slave
        Surface whose quadrature points are held back.
    points
        Reference coordinates of all nodes (N, 3), m.
    law
        Stiffness, friction, tolerance.
    kind
        Of the master facets, see ``fea.contact.facets``.
    share
        Factor on all forces: one half where both surfaces are slaves of one another.
    order
        Polynomial order that the quadrature on the slave is exact for.
    """

    def __init__(
        self, slave: Surface, points: Array, law: ContactLaw, kind: int, share: float = 1.0, order: int = 5
    ) -> None:
        self.slave, self.law = slave, law
        self._points, self._kind, self._share = points, kind, share
        self._shapes = slave.shapes(order)
        self._slaves = np.ascontiguousarray(slave.facets, dtype=np.int64)
        self._area = self._areas(points)
        self.scales = law.on(np.sqrt(self._area.sum(axis=1))).each(self._area.shape[1])
        self._masters = np.zeros((0, 3), dtype=np.int64)
        self._set_pairs(np.zeros((0, 2), dtype=np.int64))
        n = self._area.size
        self._memory = self._accepted = Memory.blank(n)
        self._pair, self._at, self._gap = np.full(n, -1, dtype=np.int64), np.full((n, 2), 0.4), np.full(n, np.inf)
        self._t = 0.0

    def _areas(self, positions: Array) -> Array:
        """Area that each point stands for (facets, points), m^2."""
        tangents = np.einsum("qjk,fkc->fqjc", self._shapes.slopes, positions[self._slaves])
        return np.linalg.norm(np.cross(tangents[:, :, 0], tangents[:, :, 1]), axis=2) * self._shapes.weights

    @property
    def areas(self) -> Array:
        """Undeformed area that each contact point stands for (n,), m^2."""
        return self._area.ravel()

    def _set_pairs(self, pairs: Ints) -> None:
        """Pairs (m, 2) of slave and master facets, ordered by slave."""
        self._pairs = pairs
        self._starts = np.searchsorted(pairs[:, 0], np.arange(len(self._slaves) + 1)).astype(np.int64)
        self._master_of = np.ascontiguousarray(pairs[:, 1])

    @property
    def cells(self) -> Ints:
        """See ``Term``."""
        return np.concatenate([self._slaves[self._pairs[:, 0]], self._coupled[self._pairs[:, 1]]], axis=1)

    @property
    def _coupled(self) -> Ints:
        """Those nodes of the masters that are unknowns."""
        return self._masters

    def _positions(self, x: Array, t: float) -> Array:
        """Where all nodes are, and behind them those that only this term knows.

        Nodes that a case has got since are of no concern here.
        """
        return self._points + x[: len(self._points)]

    def _locate(self, positions: Array) -> None:
        kernels.locate(
            self._kind, positions, self._masters, self._slaves, self._shapes.values, self._starts, self._master_of,
            _BORDER, self._pair, self._at, self._gap,
        )  # fmt: skip

    @property
    def _touching(self) -> tuple[Any, ...]:
        """What the kernels of force and tangent share after ``positions``."""
        m = self._memory
        return (
            self._masters, self._slaves, self._shapes.values, self._share * self._area, self._master_of,
            self._pair, self._at, self._gap, self.scales.penalty, self.scales.width, m.shift,
            m.limit, m.anchor, m.anchor_at,
        )  # fmt: skip

    def touch(self, x: Array, t: float) -> Touch:
        """Gaps, pressures and shears per undeformed area at the contact points."""
        positions = self._positions(x, t)
        self._locate(positions)
        n = len(self._gap)
        force, normal, pressure, shear = np.zeros_like(positions), np.zeros((n, 3)), np.empty(n), np.empty((n, 3))
        everything: Any = (self._kind, positions, *self._touching, force, normal, pressure, shear)
        energy = kernels.forces(*everything)
        nodal = np.zeros_like(x)
        nodal[: len(self._points)] = force[: len(self._points)]
        return Touch(self._gap.copy(), pressure, shear, normal, energy, nodal)

    def prepare(self, x: Array) -> bool:
        """See ``Term``."""
        return False

    def force(self, x: Array, t: float) -> Array:
        """See ``Term``."""
        self._t = t
        return self.touch(x, t).force

    def tangent(self, x: Array, t: float) -> Array:
        """See ``Term``."""
        self._t = t
        positions = self._positions(x, t)
        self._locate(positions)
        size = 3 * (self._slaves.shape[1] + self._coupled.shape[1])
        result = np.zeros((len(self._pairs), size, size))
        everything: Any = (self._kind, positions, *self._touching, result)
        kernels.tangents(*everything)
        return result

    def energy(self, x: Array, t: float) -> float:
        """Energy in penalty and elastic slip, J; its slope is the force while the multipliers stay."""
        return self.touch(x, t).energy

    def augment(self, x: Array) -> bool:
        """New multipliers where the surfaces overlap or gape too far under pressure, or friction lags behind."""
        now = self.touch(x, self._t)
        pressed = now.pressure > 0
        settled = bool((np.abs(now.gap[pressed]) <= self.scales.allowed[pressed]).all())
        if not settled:
            self._memory = replace(self._memory, shift=np.maximum(self._memory.shift - now.gap, 0.0))
        return self._augment_friction(now) or not settled

    def _augment_friction(self, now: Touch) -> bool:
        if self.law.friction == 0.0:
            return False
        limit, weights = self.law.friction * now.pressure, self.areas
        lag = np.abs(limit - self._memory.limit) @ weights
        fresh = (now.pressure > 0) & (self._memory.anchor < 0)
        if lag <= _LAG * (limit @ weights):
            return False
        anchor, anchor_at = self._memory.anchor.copy(), self._memory.anchor_at.copy()
        anchor[fresh], anchor_at[fresh] = self._master_of[self._pair[fresh]], self._at[fresh]
        self._memory = replace(self._memory, limit=limit, anchor=anchor, anchor_at=anchor_at)
        return True

    def accept(self, x: Array) -> None:
        """See ``Term``."""
        if self.law.friction > 0.0:
            self._drag(x)
        self._accepted = self._memory

    def _drag(self, x: Array) -> None:
        """Anchors follow points that slide, and are given up by points that have lost touch."""
        now = self.touch(x, self._t)
        memory = self._memory
        anchor, anchor_at = memory.anchor.copy(), memory.anchor_at.copy()
        anchor[now.pressure <= 0] = -1
        fresh = (now.pressure > 0) & (anchor < 0)
        anchor[fresh], anchor_at[fresh] = self._master_of[self._pair[fresh]], self._at[fresh]
        held = np.flatnonzero((now.pressure > 0) & (memory.anchor >= 0) & (memory.limit > 0))
        slip, start = kernels.slips(
            self._kind, self._positions(x, self._t), self._masters, self._slaves, self._shapes.values,
            self._master_of, self._pair, self._at, memory.anchor, memory.anchor_at, held,
        )  # fmt: skip
        free = 2 * memory.limit[held] / self.scales.penalty[held]
        sliding = slip > free
        moved, left = held[sliding], (free / np.maximum(slip, free))[sliding]
        anchor[moved] = self._master_of[self._pair[moved]]
        anchor_at[moved] = self._at[moved] + left[:, None] * (start[sliding] - self._at[moved])
        lost = ((slip - free) * memory.limit[held] * self._share * self.areas[held])[sliding]
        self._memory = replace(memory, anchor=anchor, anchor_at=anchor_at, slid=memory.slid + float(lost.sum()))

    def reject(self) -> None:
        """See ``Term``."""
        self._memory = self._accepted

    def report(self, x: Array) -> dict[str, float]:
        """Forces on the slave, the extremes over its points, and energy lost in friction."""
        now = self.touch(x, self._t)
        weights = self._share * self.areas
        pull = weights @ (now.pressure[:, None] * now.normal - now.shear)
        shrunk = self._area / self._areas(self._positions(x, self._t))
        return {
            "force x [N]": float(pull[0]), "force y [N]": float(pull[1]), "force z [N]": float(pull[2]),
            "normal force [N]": float(weights @ now.pressure),
            "largest pressure [Pa]": float((now.pressure * shrunk.ravel()).max(initial=0.0)),
            "largest penetration [m]": max(0.0, -float(now.gap.min(initial=0.0))),
            "smallest gap [m]": float(now.gap.min(initial=np.inf)),
            "active points": float(np.count_nonzero(now.pressure)),
            "friction loss [J]": self._memory.slid,
        }  # fmt: skip

    def fields(self, x: Array) -> dict[str, Array]:
        """Contact pressure per area now (N,), Pa, and gap (N,), m, NaN where nothing is opposite."""
        now = self.touch(x, self._t)
        shrunk = self._area / self._areas(self._positions(x, self._t))
        opposite = np.isfinite(now.gap)
        return {
            "contact pressure [Pa]": self._at_nodes(now.pressure * shrunk.ravel(), np.ones_like(opposite)),
            "gap [m]": self._at_nodes(now.gap, opposite),
        }

    def _at_nodes(self, field: Array, there: NDArray[np.bool_]) -> Array:
        """Means over the points around every node (N,), weighted by the squares of the shape functions."""
        share = self._area[:, :, None] * self._shapes.values**2 * there.reshape(self._area.shape)[:, :, None]
        total = np.where(there, field, 0.0).reshape(self._area.shape)[:, :, None] * share
        nodes = np.broadcast_to(self._slaves[:, None, :], share.shape).ravel()
        weight = np.bincount(nodes, share.ravel(), len(self._points))
        with np.errstate(invalid="ignore"):
            return np.bincount(nodes, total.ravel(), len(self._points)) / weight
