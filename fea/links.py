"""From few unknowns to all displacements: prescribed motion, ties, rigid parts.

    x = T p,   p = (free unknowns, prescribed values, nodes carried by rigid poses)

T is the identity except for tied displacements, which are weighted sums of others.  With J = dx/dy,
forces reduce to J'f, stiffness to J'KJ plus the change of J'.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array

from fea.rigid_part import REBASE_AT, RigidPart

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


class ConstraintError(ValueError):
    """Constraints that contradict one another or name what is not there."""


@dataclass
class Builder:
    """Collects constraints on 3 N displacements, then makes ``Links``.

    Parameters
    ----------
    nodes
        Number of nodes N.
    name_of
        Words for a displacement's number, for messages.
    """

    nodes: int
    name_of: Callable[[int], str] = str
    _prescribed: dict[int, tuple[str, Callable[[float], float]]] = field(default_factory=dict)
    _tied: dict[int, tuple[str, Ints, Array]] = field(default_factory=dict)
    _parts: list[tuple[str, RigidPart, dict[int, Callable[[float], float]]]] = field(default_factory=list)

    def prescribe(self, unknowns: Ints, value: Callable[[float], float], by: str) -> None:
        """Displacements whose value, m, is a function of t; the same one may be held twice if both agree."""
        for unknown in unknowns.tolist():
            before = self._prescribed.setdefault(unknown, (by, value))
            if before[1] is not value and any(abs(before[1](t) - value(t)) > 1e-15 for t in (0.0, 0.37, 1.0)):
                raise ConstraintError(f"{self.name_of(unknown)} is prescribed by {before[0]} and differently by {by}")

    def tie(self, unknown: int, others: Ints, weights: Array, by: str) -> None:
        """One displacement as a weighted sum of others."""
        if unknown in self._tied:
            raise ConstraintError(f"{self.name_of(unknown)} is tied by {self._tied[unknown][0]} and again by {by}")
        self._tied[unknown] = (by, others, weights)

    def carry(self, part: RigidPart, held: dict[int, Callable[[float], float]], by: str) -> None:
        """Nodes on a rigid pose; ``held`` gives some of its six numbers as functions of t."""
        self._parts.append((by, part, held))

    def make(self) -> "Links":
        """The map, once everything is said."""
        owner: dict[int, str] = {}
        for by, part, _ in self._parts:
            for unknown in (3 * part.nodes[:, None] + np.arange(3)).ravel().tolist():
                if unknown in owner:
                    raise ConstraintError(f"{self.name_of(unknown)} is carried by {owner[unknown]} and by {by}")
                owner[unknown] = by
        for unknown in [u for u in self._prescribed if u in owner]:
            self._leave_to_rigid_part(unknown)
        for unknown, (by, _, _) in self._tied.items():
            if unknown in owner or unknown in self._prescribed:
                other = owner.get(unknown) or self._prescribed[unknown][0]
                raise ConstraintError(f"{self.name_of(unknown)} is tied by {by} but already held by {other}")
        return Links(self.nodes, self._prescribed, self._ties(), [(p, held) for _, p, held in self._parts])

    def _leave_to_rigid_part(self, unknown: int) -> None:
        """Drop a prescription that the rigid part keeps by itself, such as a plane of symmetry through it."""
        by, value = self._prescribed.pop(unknown)
        node, axis = divmod(unknown, 3)
        name, part, held = next(entry for entry in self._parts if node in entry[1].nodes)
        row = int(np.flatnonzero(part.nodes == node)[0])
        draw = np.random.default_rng(0)
        for t in (0.0, 0.37, 1.0):
            pose = draw.uniform(-1.0, 1.0, 6)
            for number, motion in held.items():
                pose[number] = motion(t)
            if abs(part.displacement(pose)[row, axis] - value(t)) > 1e-12 * (1.0 + np.abs(part.arms).max()):
                raise ConstraintError(
                    f"{self.name_of(unknown)} is prescribed by {by} but carried by the rigid part {name}, which may "
                    "move otherwise: hold or move the rigid part itself"
                )

    def _ties(self) -> csr_array | None:
        """T, chains of ties followed to their ends."""
        if not self._tied:
            return None
        n = 3 * self.nodes
        tied = np.array(sorted(self._tied))
        rows = np.concatenate([np.full(len(self._tied[i][1]), i) for i in tied])
        columns = np.concatenate([self._tied[i][1] for i in tied])
        weights = np.concatenate([self._tied[i][2] for i in tied])
        plain = np.setdiff1d(np.arange(n), tied)
        step = csr_array(coo_array((weights, (rows, columns)), shape=(n, n)))
        keep = csr_array(coo_array((np.ones(len(plain)), (plain, plain)), shape=(n, n)))
        total = keep + step
        for _ in range(8):
            if not total[:, tied].nnz:
                return csr_array(total)
            total = keep + step @ total
            total.eliminate_zeros()
        loop = int(tied[np.flatnonzero(np.diff(total[:, tied].tocsc().indptr))[0]])
        raise ConstraintError(f"ties lead back to where they began: {self.name_of(loop)}")


class Links:
    """Displacements as functions of the unknowns; made by ``Builder``.

    The unknowns y are the free displacements, ascending, then the free pose numbers part by part.
    """

    def __init__(
        self, nodes: int, prescribed: dict[int, tuple[str, Callable[[float], float]]], ties: csr_array | None,
        parts: list[tuple[RigidPart, dict[int, Callable[[float], float]]]],
    ) -> None:  # fmt: skip
        self.size = 3 * nodes
        self.ties = ties
        self.rigid = [part for part, _ in parts]
        self._held = [held for _, held in parts]
        self.prescribed = np.array(sorted(prescribed), dtype=np.int64)
        self._groups = _by_function({i: value for i, (_, value) in prescribed.items()})
        carried = [(3 * p.nodes[:, None] + np.arange(3)).ravel() for p in self.rigid]
        tied = np.zeros(0, dtype=np.int64) if ties is None else np.flatnonzero(ties.diagonal() == 0)
        self.free = np.setdiff1d(np.arange(self.size), np.concatenate([self.prescribed, tied, *carried]))
        self.pose_free = [np.setdiff1d(np.arange(6), sorted(held)) for held in self._held]
        ends = len(self.free) + np.cumsum([0] + [len(f) for f in self.pose_free])
        self._pose_places = [slice(a, b) for a, b in zip(ends[:-1], ends[1:], strict=True)]
        self.unknowns = int(ends[-1])
        #: Displacements that are neither unknowns of their own nor prescribed.
        self.linked = np.setdiff1d(np.arange(self.size), np.concatenate([self.free, self.prescribed]))
        #: Displacements at which something holds or carries: all that are not simply free.
        self.held = np.union1d(self.prescribed, self.linked)

    @property
    def rest(self) -> Array:
        """Unknowns at rest."""
        return np.zeros(self.unknowns)

    def pose_place(self, part: int) -> slice:
        """Where the free pose numbers of a rigid part stand among the unknowns."""
        return self._pose_places[part]

    def pose(self, part: int, y: Array, t: float) -> Array:
        """Pose (6,) of a rigid part, m and rad, from its base."""
        pose = np.zeros(6)
        pose[self.pose_free[part]] = y[self._pose_places[part]]
        for number, value in self._held[part].items():
            pose[number] = value(t)
        return pose

    def displacement(self, y: Array, t: float) -> Array:
        """All displacements (N, 3), m."""
        x = np.zeros(self.size)
        x[self.free] = y[: len(self.free)]
        for unknowns, value in self._groups:
            x[unknowns] = value(t)
        nodal = x.reshape(-1, 3)
        for number, part in enumerate(self.rigid):
            nodal[part.nodes] = part.displacement(self.pose(number, y, t))
        return nodal if self.ties is None else (self.ties @ x).reshape(-1, 3)

    def jacobian(self, y: Array, t: float) -> csr_array:
        """dx/dy, (3 N, unknowns); its structure never changes."""
        rows, columns, values = [self.free], [np.arange(len(self.free))], [np.ones(len(self.free))]
        for number, part in enumerate(self.rigid):
            free = self.pose_free[number]
            block = part.jacobian(self.pose(number, y, t)).reshape(-1, 6)[:, free]
            unknowns = (3 * part.nodes[:, None] + np.arange(3)).ravel()
            rows.append(np.repeat(unknowns, len(free)))
            columns.append(np.tile(np.arange(self.unknowns)[self._pose_places[number]], len(unknowns)))
            values.append(block.ravel())
        place = (np.concatenate(rows), np.concatenate(columns))
        result = csr_array(coo_array((np.concatenate(values), place), shape=(self.size, self.unknowns)))
        return result if self.ties is None else csr_array(self.ties @ result)

    def reduce(self, force: Array, y: Array, t: float) -> Array:
        """J'f (unknowns,) of nodal forces (N, 3), N."""
        f = np.asarray(force.reshape(-1) if self.ties is None else self.ties.T @ force.reshape(-1))
        result = np.empty(self.unknowns)
        result[: len(self.free)] = f[self.free]
        by_node = f.reshape(-1, 3)
        for number, part in enumerate(self.rigid):
            work = np.einsum("nkj,nk->j", part.jacobian(self.pose(number, y, t)), by_node[part.nodes])
            result[self._pose_places[number]] = work[self.pose_free[number]]
        return result

    def geometric(self, force: Array, y: Array, t: float) -> list[tuple[slice, Array]]:
        """Change of J' at constant forces (N, 3): blocks on the free pose numbers of each rigid part."""
        nodal = force if self.ties is None else (self.ties.T @ force.reshape(-1)).reshape(-1, 3)
        result = []
        for number, part in enumerate(self.rigid):
            block = part.geometric(self.pose(number, y, t), nodal[part.nodes])
            free = self.pose_free[number]
            result.append((self._pose_places[number], block[np.ix_(free, free)]))
        return result

    def rebase(self, y: Array, t: float) -> Array | None:
        """The same displacements from new base rotations where a free rotation has grown large; else None."""
        result = None
        for number, part in enumerate(self.rigid):
            pose = self.pose(number, y, t)
            if len(np.intersect1d(self.pose_free[number], [3, 4, 5])) == 3 and np.linalg.norm(pose[3:]) > REBASE_AT:
                part.base = part.turn(pose)
                result = y.copy() if result is None else result
                result[self._pose_places[number]][-3:] = 0.0
        return result


def _by_function(values: dict[int, Callable[[float], float]]) -> list[tuple[Ints, Callable[[float], float]]]:
    """Displacements that share a function, so that it is called once."""
    groups: dict[int, list[int]] = {}
    for unknown, value in values.items():
        groups.setdefault(id(value), []).append(unknown)
    return [(np.array(sorted(found), dtype=np.int64), values[found[0]]) for found in groups.values()]
