"""What a solution of a case leaves behind: increments in equilibrium, read by name."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from fea.problem import Problem

if TYPE_CHECKING:
    from fea.case import Case, Where

Array = NDArray[np.float64]


@dataclass(frozen=True)
class _Instant:
    """What the work between two increments needs."""

    x: Array
    forces: Array
    loads: Array
    wrenches: Array
    turns: list[Array]
    springs: float


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
    status: Literal["completed", "diverged"] = "completed"
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
    _contact: list[dict[str, Array]] = field(default_factory=list)
    _work: list[float] = field(default_factory=list)
    _negative: list[int] = field(default_factory=list)

    _last: "_Instant | None" = None

    def __post_init__(self) -> None:
        links = self.problem.links
        self._references = [int(part.nodes[0]) for part in links.rigid]
        self._held = np.unique(links.held // 3)

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
    def work(self) -> Array:
        """Work of loads, moments, rigs and supports since the start (increments,), J, by the trapezoidal rule.

        The energy balance: it is what ``energy`` and ``kinetic`` gained and what damping, friction and
        follower pressure took; in a static run without these the difference is that of the rule.
        """
        return np.array(self._work)

    @property
    def negative_eigenvalues(self) -> NDArray[np.int64]:
        """Of the last tangent of every increment, (increments,): not 0 where the state is unstable under its loads.

        A limit point or a bifurcation lies before the first that is not 0.  Near such a point the count may be
        one increment late; -1 where it is not known.
        """
        return np.array(self._negative, dtype=np.int64)

    @property
    def notes(self) -> list[str]:
        """What a reader should know before trusting the run."""
        unstable = self.t[self.negative_eigenvalues > 0]
        words = "states are unstable under their loads: a limit point or a bifurcation was passed"
        said = [f"from t = {unstable[0]:.6g} on, {len(unstable)} {words}"] if len(unstable) else []
        return said + list(self.history.get("notes", []))

    @property
    def kinetic(self) -> Array:
        """Kinetic energy of every recorded instant of a motion, (increments,), J."""
        return np.array(self._kinetic)

    @property
    def reports(self) -> list[dict[str, float]]:
        """What contact and other terms report at every increment, by name with unit."""
        return self._reports

    def add(
        self, t: float, y: Array, reactions: Array | None = None, velocity: Array | None = None, kinetic: float = 0.0,
        loads: Array | None = None,
    ) -> None:  # fmt: skip
        """Take over an equilibrium; of a motion also the forces (N, 3), N, of supports and loads, inertia included."""
        problem, links = self.problem, self.problem.links
        x = problem.displacement(y, t)
        forces = problem.out_of_balance(y, t) if reactions is None else reactions
        poses = [links.pose(number, y, t) for number in range(len(links.rigid))]
        wrenches = [part.wrench(pose, forces[part.nodes]) for part, pose in zip(links.rigid, poses, strict=True)]
        self._wrenches.append(np.reshape(wrenches, (len(links.rigid), 6)))
        turns = [part.turn(pose) for part, pose in zip(links.rigid, poses, strict=True)]
        pushed = problem.external(t) if loads is None else loads
        springs = problem.spring_energy(y, t)
        self._add_work(_Instant(x, forces.reshape(-1), pushed, self._wrenches[-1], turns, springs))
        self._t.append(t)
        self._states.append(y)
        self._fields.append(x)
        self._reactions.append(forces[self._held])
        self._energies.append(problem.energy(y, t))
        if velocity is not None:
            self._velocities.append(velocity)
            self._kinetic.append(kinetic)
        report: dict[str, float] = {}
        for number, term in enumerate(problem.terms):
            report |= {f"{name}, term {number}": float(v) for name, v in term.report(x).items() if np.ndim(v) == 0}
        self._reports.append(report)
        self._contact.append(_contact_fields(problem, x))
        count = problem.linear.negative_pivots if velocity is None else None
        self._negative.append(-1 if count is None else count)

    def _add_work(self, now: "_Instant") -> None:
        """Mean forces of the last two increments times what their points moved by."""
        before, self._last = self._last, now
        if before is None:
            self._work.append(0.0)
            return
        prescribed = self.problem.links.prescribed
        held = (before.forces + now.forces)[prescribed] / 2
        work = float(np.vdot((before.loads + now.loads) / 2, now.x - before.x))
        work += float(held @ (now.x - before.x).reshape(-1)[prescribed]) + now.springs - before.springs
        for number, (old, new) in enumerate(zip(before.turns, now.turns, strict=True)):
            moved = now.x[self._references[number]] - before.x[self._references[number]]
            turned = Rotation.from_matrix(new @ old.T).as_rotvec()
            work += float((before.wrenches + now.wrenches)[number] / 2 @ np.concatenate([moved, turned]))
        self._work.append(self._work[-1] + work)

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


def _contact_fields(problem: Problem, x: Array) -> dict[str, Array]:
    """Contact pressure and gap of all terms that have them, (N,) each; NaN where nothing is near."""
    result: dict[str, Array] = {}
    for term in problem.terms:
        for name, values in getattr(term, "fields", lambda _: {})(x).items():
            whole = np.full(len(x), np.nan)
            whole[: len(values)] = values
            before = result.get(name, whole)
            result[name] = np.where(np.isnan(before), whole, before)
    return result
