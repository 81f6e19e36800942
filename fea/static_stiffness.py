"""``StaticStiffness`` by finite elements."""

from collections.abc import Callable
from dataclasses import dataclass, field
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from fea.case import Case
from fea.model import FeaModel
from fea.newton import Branch, DivergedError, History, Options, follow
from fea.parts import Deformable
from fea.pictures import fields
from fea.setting_up import Mesh, how, make_part, said, warm_up
from lab.experiments import StaticStiffness
from lab.records import Channel, Record, channels
from lab.specimens import TwistedBeam

Array = NDArray[np.float64]

_MOTIONS = ("along x", "along y", "along z", "about x", "about y", "about z")


_NUMBERS = ("x", "y", "z", "rx", "ry", "rz")


class HeldTip:
    """A part whose root is clamped and whose tip a robot holds, rigidly or through springs.

    Parameters
    ----------
    part
        With boundaries ``root`` and ``tip``.
    springs
        Stiffness between robot and tip along x, y, z and about them (6,), N/m and N m/rad; inf: rigid.
    solver
        Kind of linear solver.
    """

    def __init__(self, part: Deformable, springs: Array, solver: str = "auto") -> None:
        #: Motion of the robot at s = 1, m and rad, (6,).
        self.travel = np.zeros(6)
        case = Case(part, solver=solver).fix("root")
        tip = case.rigid("tip", "tip")
        for number, name in enumerate(_NUMBERS):
            if np.isinf(springs[number]):
                tip.move(self._along(number), **{name: 1.0})
        tip.spring(np.where(np.isinf(springs), 0.0, springs), lambda s: s * self.travel)
        self.part, self.problem = part, case.problem()

    def _along(self, number: int) -> Callable[[float], float]:
        return lambda s: s * float(self.travel[number])

    def displacement(self, state: Array, parameter: float) -> Array:
        """Of the part's nodes (nodes, 3), m."""
        return self.problem.displacement(state, parameter)[: self.part.nodes]

    def pose(self, state: Array, parameter: float) -> Array:
        """Of the tip (6,), m and rad."""
        return self.problem.links.pose(0, state, parameter)

    def wrench(self, state: Array, parameter: float) -> Array:
        """Force and moment about the tip's current centre that the robot puts on the tip (6,), N and N m."""
        tip = self.problem.links.rigid[0]
        return tip.wrench(self.pose(state, parameter), self.problem.out_of_balance(state, parameter)[tip.nodes])


def tip_stiffness(part: Deformable, solver: str = "auto") -> Array:
    """Stiffness of the tip (6, 6) at rest with the root clamped, N/m, N/rad, N m/m, N m/rad."""
    case = Case(part, solver=solver).fix("root")
    case.rigid("tip", "tip")
    problem = case.problem()
    problem.linearise(problem.rest, 0.0)
    place = problem.links.pose_place(0)
    unit = np.zeros((problem.links.unknowns, 6))
    unit[place] = np.eye(6)
    stiffness = np.linalg.inv(problem.solve(unit)[place])
    return (stiffness + stiffness.T) / 2


@dataclass
class _Sensed:
    """Rows of the record as they come in."""

    leg: list[int] = field(default_factory=list)
    motion: list[Array] = field(default_factory=list)
    pose: list[Array] = field(default_factory=list)
    wrench: list[Array] = field(default_factory=list)
    energy: list[float] = field(default_factory=list)
    states: list[tuple[float, Array]] = field(default_factory=list)

    def read(self, leg: int, held: HeldTip, state: Array, parameter: float) -> None:
        self.leg.append(leg)
        self.motion.append(parameter * held.travel)
        self.pose.append(held.pose(state, parameter))
        self.wrench.append(held.wrench(state, parameter))
        self.energy.append(float(held.part.strain_energy(held.displacement(state, parameter)).sum()))

    def channels(self) -> dict[str, Channel]:
        n, rows = len(self.leg), ("increment", "dof")
        return channels(
            Channel("increment", "1", np.arange(n), ("increment",), "number of the increment"),
            Channel("leg", "1", np.array(self.leg, dtype=np.int64), ("increment",), "number of the leg"),
            Channel("motion", "m, rad", np.reshape(self.motion, (n, 6)), rows, "motion of the robot"),
            Channel("pose", "m, rad", np.reshape(self.pose, (n, 6)), rows, "pose of the tip"),
            Channel("wrench", "N, N*m", np.reshape(self.wrench, (n, 6)), rows,
                    "force, and moment about the tip's current centre, that the rig puts on the tip"),
            Channel("energy", "J", np.array(self.energy), ("increment",), "strain energy"),
        )  # fmt: skip


def perform(specimen: TwistedBeam, experiment: StaticStiffness, model: FeaModel, mesh: Mesh) -> Record:
    """Move the tip along every leg and sense the wrench; see ``fea.perform``."""
    warm_up(model.linear_solver, model.element)
    began = perf_counter()
    # The robot holds the tip itself; what it carries has only mass.
    part = make_part(specimen.model_copy(update={"load_frame": None}), model, mesh)
    springs = np.full(6, np.inf)
    if experiment.rig_stiffness is not None:
        springs[:3] = experiment.rig_stiffness
    held = HeldTip(part, springs, model.linear_solver)
    stiffness = tip_stiffness(part, model.linear_solver)
    history, sensed, reason = History(), _Sensed(), ""
    sensed.states.append((-1.0, np.zeros((part.nodes, 3))))
    for leg, (dof, end) in enumerate(experiment.legs()):
        held.travel[:] = np.eye(6)[dof] * end
        reason = _leg(leg, held, experiment, model, history, sensed)
        if reason:
            break
    seconds = perf_counter() - began
    units = "N/m, N/rad, N*m/m, N*m/rad"
    tangent = Channel("tangent_stiffness", units, stiffness, ("dof", "dof_moved"), "stiffness of the tip at rest")
    return Record(
        **said(specimen, experiment, model),
        channels=sensed.channels() | channels(tangent),
        how=how(part, model, held.problem.linear, seconds, history.summary()),
        status="diverged" if reason else "completed",
        reason=reason,
        fields=fields(part, *map(list, zip(*sensed.states, strict=True))),
    )


def _leg(
    leg: int, held: HeldTip, experiment: StaticStiffness, model: FeaModel, history: History, sensed: _Sensed
) -> str:
    """Move one leg from rest; returns why it stopped, empty when it did not."""
    n = experiment.increments
    branch = Branch.start(held.problem.rest, 1 / n)
    for number in range(1, n + 1):
        # Smaller after a cut-back, never larger: the recorded increments are the longest steps.
        branch.increment = min(branch.increment, 1 / n)
        try:
            state = follow(held.problem, branch, number / n, Options(tolerance=model.tolerance), history)
        except DivergedError as error:
            dof = int(np.argmax(np.abs(held.travel)))
            return (
                f"leg {leg + 1} of {len(experiment.legs())} ({_MOTIONS[dof]} to {held.travel[dof]:g}) stopped at "
                f"{100 * error.reached:.3g} % of its way: {error}"
            )
        sensed.read(leg, held, state, number / n)
    sensed.states.append((float(len(sensed.leg) - 1), held.displacement(state, 1.0)))
    return ""
