"""Contact between deformable surfaces, and of a surface with itself."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fea.contact.facets import KINDS
from fea.contact.law import ContactLaw
from fea.contact.search import NearPairs, facet_sizes, neighbours
from fea.contact.term import FacetContact
from fea.newton import NotConvergedError
from fea.surface import Surface

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


class _OnePass(FacetContact):
    """Points of a slave surface that may not pass through a master surface.

    The gap is measured along the normal of the master, which makes the foot the closest point: gap and foot
    then vary together, and the tangent is symmetric.
    """

    def __init__(
        self, slave: Surface, master: Surface, points: Array, law: ContactLaw, share: float, order: int, near: NearPairs
    ) -> None:
        super().__init__(slave, points, law, KINDS[master.shape], share, order)
        self._masters = np.ascontiguousarray(master.facets, dtype=np.int64)
        self._near = near
        self._size = float(facet_sizes(master, points).mean()) if len(master.facets) else 0.0
        self._start = np.zeros_like(points)
        self._reach = self._margin = 0.0
        self._stretch = 1.0
        self.prepare(self._start)

    def prepare(self, x: Array) -> bool:
        """See ``Term``.

        Pairs are needed that may touch while both sides move as far as in the last increment, or four times
        the reach.  Some more are taken when not all are there, so that the same ones serve several increments.
        """
        x = x[: len(self._points)]
        moved = 2 * float(np.abs(x - self._start).max(initial=0.0))
        self._start = x.copy()
        self._reach = self._stretch * float(np.clip(moved, self._near.reach, 4 * self._near.reach))
        self._margin = self._stretch * float(np.clip(moved / self._size, 0.15, 1.0))
        self._pair[:] = -1
        found, needed = self._search(x)
        before = _keys(self._pairs)
        if np.isin(_keys(found[needed]), before).all() and len(before) <= 2 * len(found) + 100:
            return False
        self._set_pairs(found)
        return not np.array_equal(_keys(found), before)

    def _search(self, x: Array) -> tuple[Ints, NDArray[np.bool_]]:
        positions = self._positions(x, 0.0)
        return self._near.find(
            positions, self._kind, self._masters, self._slaves, self._shapes, self._reach, self._margin
        )

    def augment(self, x: Array) -> bool:
        """See ``Term``; an increment in which points went through unseen is given up and tried with a longer reach."""
        moved = 2 * float(np.abs(x[: len(self._points)] - self._start).max(initial=0.0))
        if moved > min(self._reach, self._margin * self._size) and self._missed(x):
            self._stretch *= 2.0
            raise NotConvergedError("surfaces met where none was looked for at the start of the increment")
        return super().augment(x)

    def _missed(self, x: Array) -> bool:
        """Whether points touch facets that they are not paired with."""
        positions = self._positions(x, 0.0)
        found, touching = self._near.find(positions, self._kind, self._masters, self._slaves, self._shapes, 0.0, 0.0)
        return not np.isin(_keys(found[touching]), _keys(self._pairs)).all()

    def accept(self, x: Array) -> None:
        """See ``Term``."""
        self._stretch = 1.0
        super().accept(x)


def _keys(pairs: Ints) -> Ints:
    return pairs[:, 0] << 32 | pairs[:, 1]


class SurfaceContact:
    """Two surfaces that may not pass through one another, or one that may not pass through itself.

    Quadrature points of one surface, the slave, are held back by the other, the master.  In two passes each
    is slave and master with half the force, and the result does not depend on which comes first.  The
    surfaces are those of the material: a wall has its thickness.  A ``fea.terms.Term``.

    Points of a quadrature rule do not integrate exactly over the edges of facets that do not fit to theirs:
    a uniform pressure passes with errors of some per cent in the stress beside such edges, fewer with two
    passes, with a higher ``order``, and with finer facets.  The resultant is exact.

    Parameters
    ----------
    slave, master
        Surfaces with outward normals; the same twice for contact with itself.
    points
        Reference coordinates of all nodes (N, 3), m.
    law
        Stiffness, friction, tolerance.
    two_passes
        False: only the slave's points are held back, at half the cost; choose the finer or the softer surface.
    reach
        Gap, m, below which contact is thought of at the start of an increment; None: twice the thickness of
        the wall, or the size of a solid's facets.
    depth
        Overlap, m, beyond which a point at the start of an increment is taken to be on the other side of
        something, not inside it; below the thickness of a wall; None: half of that, or of a solid's facets.
    facing
        Contact needs normals with a cosine below the negative of this.
    rings
        Facets that share a node are neighbours and do not touch; how many times neighbours of neighbours count.
    order
        Polynomial order that the quadrature on the slave is exact for; None: 5 on walls, 9 on solids.
    """

    def __init__(
        self, slave: Surface, master: Surface, points: Array, law: ContactLaw, two_passes: bool = True,
        reach: float | None = None, depth: float | None = None, facing: float = 0.2, rings: int = 1,
        order: int | None = None,
    ) -> None:  # fmt: skip
        self.law = law
        length = float(law.on(facet_sizes(slave, points)).length.mean())
        reach, depth = 2 * length if reach is None else reach, 0.5 * length if depth is None else depth
        itself = slave is master or np.array_equal(slave.facets, master.facets)
        if itself and not two_passes:
            raise ValueError("contact of a surface with itself has two passes")
        ways = [(slave, master)] if itself or not two_passes else [(slave, master), (master, slave)]
        order = order or (9 if law.thickness is None else 5)
        self.passes = tuple(
            _OnePass(
                one, other, points, law, 0.5 if two_passes else 1.0, order,
                NearPairs(facing, depth, reach, neighbours(one, other, len(points), rings)),
            )
            for one, other in ways
        )  # fmt: skip

    @property
    def cells(self) -> Ints:
        """See ``Term``."""
        return np.concatenate([p.cells for p in self.passes])

    def prepare(self, x: Array) -> bool:
        """See ``Term``."""
        changed = [p.prepare(x) for p in self.passes]
        return any(changed)

    def force(self, x: Array, t: float) -> Array:
        """See ``Term``."""
        return sum((p.force(x, t) for p in self.passes[1:]), self.passes[0].force(x, t))

    def tangent(self, x: Array, t: float) -> Array:
        """See ``Term``."""
        return np.concatenate([p.tangent(x, t) for p in self.passes])

    def energy(self, x: Array, t: float) -> float:
        """See ``FacetContact.energy``."""
        return sum(p.energy(x, t) for p in self.passes)

    def augment(self, x: Array) -> bool:
        """See ``FacetContact.augment``."""
        changed = [p.augment(x) for p in self.passes]
        return any(changed)

    def accept(self, x: Array) -> None:
        """See ``Term``."""
        for p in self.passes:
            p.accept(x)

    def reject(self) -> None:
        """See ``Term``."""
        for p in self.passes:
            p.reject()

    def report(self, x: Array) -> dict[str, float]:
        """As ``FacetContact.report``; forces on the first surface, which balance in contact with itself."""
        reports = [p.report(x) for p in self.passes]
        result = dict(reports[0])
        if len(reports) == 2:
            for name in result:
                result[name] = _JOIN[name.split(" [")[0].split(" ")[0]](reports[0][name], reports[1][name])
        return result

    def fields(self, x: Array) -> dict[str, Array]:
        """As ``FacetContact.fields``, on the slaves; on both surfaces with two passes."""
        fields = [p.fields(x) for p in self.passes]
        if len(fields) == 1:
            return fields[0]
        return {name: np.where(np.isnan(fields[0][name]), fields[1][name], fields[0][name]) for name in fields[0]}


#: How two passes make one report, by the first word: what the second's slaves feel, the first's masters give.
_JOIN: dict[str, Callable[[float, float], Any]] = {
    "force": lambda a, b: a - b,
    "normal": lambda a, b: a + b,
    "largest": max,
    "smallest": min,
    "active": lambda a, b: a + b,
    "friction": lambda a, b: a + b,
}
