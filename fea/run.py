"""What a solution of a case leaves behind: increments in equilibrium, read by name."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fea.problem import Problem

if TYPE_CHECKING:
    from fea.case import Case, Where

Array = NDArray[np.float64]


@dataclass(repr=False)
class Run:
    """Increments of a solution, the state at rest first.

    Attributes
    ----------
    status
        ``completed``, or ``diverged``: then every increment up to there is kept, ``reached`` says how
        far it came (0 to 1) and ``reason`` why no further.
    """

    case: "Case"
    problem: Problem
    status: str = "completed"
    reason: str = ""
    reached: float = 0.0
    history: dict[str, Any] = field(default_factory=dict)
    wall_time: float = 0.0
    _t: list[float] = field(default_factory=list)
    _states: list[Array] = field(default_factory=list)
    _fields: list[Array] = field(default_factory=list)
    _reactions: list[Array] = field(default_factory=list)
    _wrenches: list[Array] = field(default_factory=list)
    _energies: list[float] = field(default_factory=list)
    _reports: list[dict[str, float]] = field(default_factory=list)
    _velocities: list[Array] = field(default_factory=list)
    _kinetic: list[float] = field(default_factory=list)

    def __post_init__(self) -> None:
        links = self.problem.links
        self._held = np.union1d(links.prescribed, links.linked) // 3
        self._held = np.unique(self._held)

    @property
    def completed(self) -> bool:
        """Whether the end was reached."""
        return self.status == "completed"

    @property
    def t(self) -> Array:
        """Parameter (load factor, or time in s) of every increment, (increments,)."""
        return np.array(self._t)

    @property
    def energy(self) -> Array:
        """Strain energy, with that of springs and contact, (increments,), J."""
        return np.array(self._energies)

    @property
    def kinetic(self) -> Array:
        """Kinetic energy of every recorded instant of a motion, (increments,), J."""
        return np.array(self._kinetic)

    @property
    def reports(self) -> list[dict[str, float]]:
        """What contact and other terms report at every increment, by name with unit."""
        return self._reports

    def add(
        self, t: float, y: Array, reactions: Array | None = None, velocity: Array | None = None, kinetic: float = 0.0
    ) -> None:
        """Take over an equilibrium, or an instant of a motion: then ``reactions`` (N, 3) hold inertia, N."""
        problem = self.problem
        x = problem.displacement(y, t)
        forces = problem.out_of_balance(y, t) if reactions is None else reactions
        self._t.append(t)
        self._states.append(y)
        self._fields.append(x)
        self._reactions.append(forces[self._held])
        links = problem.links
        wrenches = [p.wrench(links.pose(i, y, t), forces[p.nodes]) for i, p in enumerate(links.rigid)]
        self._wrenches.append(np.reshape(wrenches, (len(links.rigid), 6)))
        self._energies.append(problem.energy(y, t))
        if velocity is not None:
            self._velocities.append(velocity)
            self._kinetic.append(kinetic)
        self._reports.append(
            {
                f"{name}, term {number}": float(value)
                for number, term in enumerate(problem.terms)
                for name, value in term.report(x).items()
                if np.ndim(value) == 0
            }
        )

    def state(self, increment: int = -1) -> Array:
        """Unknowns at an increment."""
        return self._states[increment]

    def field(self, increment: int = -1) -> Array:
        """Displacements of all nodes (N, 3), m."""
        return self._fields[increment]

    def displacement(self, where: "Where") -> Array:
        """Mean displacement (increments, 3), m, of a watched name, a rigid part or other nodes."""
        nodes = self._nodes(where)
        return np.array([x[nodes].mean(axis=0) for x in self._fields])

    def velocity(self, where: "Where") -> Array:
        """Mean velocity (increments, 3), m/s, in a motion."""
        nodes = self._nodes(where)
        return np.array([v[nodes].mean(axis=0) for v in self._velocities])

    def reaction(self, where: "Where") -> Array:
        """Force (increments, 3), N, that supports put on nodes; on a rigid part, the force on its reference point."""
        if isinstance(where, str) and where in self.case.rigids:
            return self.wrench(where)[:, :3]
        inside = np.isin(self._held, self._nodes(where))
        return np.array([forces[inside].sum(axis=0) for forces in self._reactions])

    def wrench(self, rigid: str) -> Array:
        """Force, N, and moment about the moved reference point, N m, that hold a rigid part, (increments, 6)."""
        return np.array(self._wrenches)[:, self.case.rigids[rigid].number]

    def _nodes(self, where: "Where") -> NDArray[np.int64]:
        if isinstance(where, str) and where in self.case.watched:
            return self.case.watched[where]
        return self.case.select(where)
