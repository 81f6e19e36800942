"""Equations of equilibrium of parts, links, loads and terms: a ``System`` of ``fea.newton``."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from fea.linear import LinearSolver, make_solver
from fea.links import Links
from fea.pattern import Pattern
from fea.reduction import Reduction
from fea.surface import Surface
from fea.terms import Term
from fea.viscosity import ViscousHistory
from lab.materials import Material

Array = NDArray[np.float64]
Ramp = Callable[[float], float]


class Part(Protocol):
    """A deformable body whose unknowns are displacements of nodes: ``fea.body.Body``, ``fea.shell.Shell``."""

    @property
    def material(self) -> Material:
        """Law and constants."""

    @property
    def mesh(self) -> Any:
        """scikit-fem's mesh with named boundaries."""

    @property
    def cells(self) -> NDArray[np.int64]:
        """Nodes of every element (elements, k)."""

    @property
    def kind(self) -> str:
        """What a person calls the element."""

    @property
    def points(self) -> Array:
        """Reference coordinates (n, 3), m."""

    @property
    def nodes(self) -> int:
        """Number of nodes."""

    @property
    def pattern(self) -> Pattern:
        """Sparsity of tangent and mass."""

    def boundary(self, name: str) -> NDArray[np.int64]:
        """Nodes of a named boundary, ascending."""

    def shares(self, name: str) -> Array:
        """Area that every node carries of a named boundary (n,), m^2."""

    def surface(self, name: str) -> Surface:
        """Oriented facets of a named surface."""

    def mass(self, on_boundary: dict[str, float] | None = None) -> Array:
        """Consistent mass on ``pattern``, kg."""

    def internal_force(self, displacement: Array, viscosity: float = 0.0, past: Array | None = None) -> Array:
        """Nodal forces (n, 3), N."""

    def tangent(
        self, displacement: Array, viscosity: float = 0.0, past: Array | None = None, step: Array | None = None
    ) -> tuple[Array, Array]:
        """Forces and their derivative on ``pattern``."""

    def strains(self, displacement: Array) -> Array:
        """Strains that damping works on."""

    def strain_energy(self, displacement: Array) -> Array:
        """Of every element, J."""

    @property
    def volumes(self) -> Array:
        """Of every element (elements,), m^3."""

    def stresses(self, displacement: Array) -> Array:
        """Cauchy stresses (elements, points, 6), Pa, Voigt order 11, 22, 33, 12, 13, 23."""

    def picture(self) -> tuple[Array, NDArray[np.int64], int, Callable[[Array], Array]]:
        """Points (m, 3), m, cells in VTK's order, VTK's cell type, and how nodal fields come to the points."""


@dataclass(frozen=True)
class Load:
    """Dead nodal forces (N, 3), N, times a ramp in t."""

    forces: Array
    ramp: Ramp


@dataclass(frozen=True)
class Moment:
    """Moment (3,), N m, on a rigid part; ``follows``: its axis turns with the part."""

    part: int
    moment: Array
    ramp: Ramp
    follows: bool = False


@dataclass(frozen=True)
class PoseSpring:
    """Springs (6,), N/m and N m/rad, between the pose of a rigid part and a rig that moves as ``rig``(t) (6,)."""

    part: int
    stiffness: Array
    rig: Callable[[float], Array]


@dataclass
class Viscous:
    """What a time integrator puts into the parts' stress: S(E) + C0 : (viscosity E + past), part by part."""

    viscosity: list[float]
    past: list[Array | None]


@dataclass(repr=False)
class Problem:
    """Equilibrium in the unknowns y of ``links`` at the parameter t.

    Parameters
    ----------
    parts
        Their nodes follow one another; carried nodes of rigid parts come last.
    points
        Reference coordinates of all nodes (N, 3), m.
    links, loads, moments, springs, terms
        What holds, pushes and touches.
    solver
        Kind of linear solver.
    seconds
        Time, s, that t = 1 stands for in the viscous stress of slow motions; 0 leaves viscosity out.
    """

    parts: Sequence[Part]
    points: Array
    links: Links
    loads: Sequence[Load] = ()
    moments: Sequence[Moment] = ()
    springs: Sequence[PoseSpring] = ()
    terms: Sequence[Term] = ()
    solver: str = "auto"
    viscous: Viscous | None = None
    seconds: float = 0.0
    noise: float = field(default=0.0, init=False)
    linear: LinearSolver = field(init=False)

    def __post_init__(self) -> None:
        ends = np.cumsum([0] + [part.nodes for part in self.parts])
        self.places = [slice(a, b) for a, b in zip(ends[:-1], ends[1:], strict=True)]
        size = float(np.ptp(self.points[: ends[-1]], axis=0).max())
        self._length = float(np.ptp(self.points, axis=0).max())
        stiffest = max(part.material.youngs_modulus for part in self.parts)
        # Below this, forces, N, are nothing at all: it keeps unloaded cases from dividing by zero.
        self._floor = 1e-30 * stiffest * size**2
        for term in self.terms:
            term.prepare(np.zeros_like(self.points))
        at_rest = [part.strains(np.zeros((part.nodes, 3))) for part in self.parts] if self.seconds else []
        self._histories = [ViscousHistory.begin(p.material, e) for p, e in zip(self.parts, at_rest, strict=False)]
        self._accepted_at = 0.0
        self._skew: list[tuple[slice, Array]] = []
        self._rows = np.zeros(0, dtype=np.int64)
        self._reduce_anew()

    def pass_time(self, y: Array, t: float, seconds: float) -> None:
        """From ``y`` at ``t`` on, where all has been still for ever, ``seconds`` s go by while t grows by 1."""
        x, self.seconds, self._accepted_at = self.displacement(y, t), seconds, t
        self._histories = [ViscousHistory.begin(p.material, p.strains(x[place])) for p, place in self._placed]

    @property
    def _placed(self) -> list[tuple[Part, slice]]:
        return list(zip(self.parts, self.places, strict=True))

    def _reduce_anew(self) -> None:
        patterns = [part.pattern for part in self.parts]
        self.reduction = Reduction(self.links, patterns, [term.cells for term in self.terms])
        self.linear = make_solver(self.solver, self.reduction.pattern)

    @property
    def rest(self) -> Array:
        """Unknowns at rest."""
        return self.links.rest

    def displacement(self, y: Array, t: float) -> Array:
        """Displacements of all nodes (N, 3), m."""
        return self.links.displacement(y, t)

    def internal(self, x: Array, t: float) -> Array:
        """Forces of parts and terms at displacements x (N, 3), N."""
        force = np.zeros_like(x)
        for number, (part, place) in enumerate(self._placed):
            force[place] = part.internal_force(x[place], *self._past(number, t))
        for term in self.terms:
            force += term.force(x, t)
        return force

    def _past(self, part: int, t: float) -> tuple[float, Array | None]:
        if self.viscous is not None:
            return self.viscous.viscosity[part], self.viscous.past[part]
        if not self._histories:
            return 0.0, None
        history, step = self._histories[part], self.seconds * (t - self._accepted_at)
        if step > 0.0:
            return history.coefficients(step)
        return history.at_rate((history.strains - history.earlier) / history.step)

    def external(self, t: float) -> Array:
        """Dead nodal forces (N, 3), N."""
        force = np.zeros_like(self.points)
        for load in self.loads:
            force += load.ramp(t) * load.forces
        return force

    def out_of_balance(self, y: Array, t: float) -> Array:
        """Forces (N, 3), N, that parts and terms resist with, less the loads: reactions where something holds."""
        return self.internal(self.displacement(y, t), t) - self.external(t)

    def residual(self, y: Array, t: float) -> tuple[Array, float]:
        """See ``fea.newton.System``."""
        return self._balance(self.internal(self.displacement(y, t), t), y, t)

    def _balance(self, internal: Array, y: Array, t: float) -> tuple[Array, float]:
        external = self.external(t)
        right = self.links.reduce(internal - external, y, t)
        scale = max(float(np.linalg.norm(external)), self._floor)
        scale = max(scale, float(np.linalg.norm((internal - external).reshape(-1)[self.links.held])))
        for pull, place in self.pose_forces(y, t):
            right[place] -= pull
            scale = max(scale, float(np.linalg.norm(pull)) / self._length)
        return right, scale

    def pose_forces(self, y: Array, t: float) -> list[tuple[Array, slice]]:
        """Generalised forces on the free pose numbers of rigid parts, by moments and springs."""
        result = []
        for load in self.moments:
            pull = np.zeros(6)
            pose = self.links.pose(load.part, y, t)
            pull[3:] = self.links.rigid[load.part].moment(pose, load.ramp(t) * load.moment, load.follows)[0]
            result.append((pull[self.links.pose_free[load.part]], self.links.pose_place(load.part)))
        for spring in self.springs:
            pull = spring.stiffness * (spring.rig(t) - self.links.pose(spring.part, y, t))
            result.append((pull[self.links.pose_free[spring.part]], self.links.pose_place(spring.part)))
        return result

    def _pose_blocks(self, y: Array, t: float) -> list[tuple[slice, Array]]:
        """Stiffness on the free pose numbers; moments have parts that are not symmetric."""
        result = []
        for load in self.moments:
            slope = np.zeros((6, 6))
            pose = self.links.pose(load.part, y, t)
            slope[3:, 3:] = self.links.rigid[load.part].moment(pose, load.ramp(t) * load.moment, load.follows)[1]
            free = self.links.pose_free[load.part]
            result.append((self.links.pose_place(load.part), -slope[np.ix_(free, free)]))
        for spring in self.springs:
            free = self.links.pose_free[spring.part]
            result.append((self.links.pose_place(spring.part), np.diag(spring.stiffness[free])))
        return result

    def pieces(self, y: Array, t: float, step: Array | None = None) -> tuple[Array, list[Array], list[Array]]:
        """Internal forces (N, 3), N, tangents on the parts' patterns, and matrices of the terms."""
        x = self.displacement(y, t)
        last = None if step is None else x - self.displacement(y - step, t)
        force, data = np.zeros_like(x), []
        for number, (part, place) in enumerate(self._placed):
            moved = None if last is None else last[place]
            force[place], values = part.tangent(x[place], *self._past(number, t), moved)
            data.append(values)
        matrices = []
        for term in self.terms:
            force += term.force(x, t)
            matrices.append(term.tangent(x, t))
        return force, data, matrices

    def assemble(self, data: list[Array], matrices: list[Array], forces: Array, y: Array, t: float) -> Array:
        """Values on ``reduction.pattern`` of all matrices, and of the change of J under ``forces`` (N, 3), N."""
        jacobian = self.links.jacobian(y, t) if len(self.links.linked) else None
        own = self._pose_blocks(y, t)
        self._skew = [(place, (block - block.T) / 2) for place, block in own]
        blocks = self.links.geometric(forces, y, t) + [(place, (block + block.T) / 2) for place, block in own]
        return self.reduction.reduce(data, matrices, jacobian, blocks)

    def factorise(self, data: Array) -> None:
        """Factorise values on ``reduction.pattern``, and prepare for what is not symmetric in moments (Woodbury)."""
        self.linear.factorise(data)
        skew = [(place, block) for place, block in self._skew if np.abs(block).any()]
        self._rows = np.concatenate([np.arange(self.links.unknowns)[place] for place, _ in skew] or [np.zeros(0, int)])
        if len(self._rows):
            self._block = block_diag(*(block for _, block in skew))
            unit = np.zeros((self.links.unknowns, len(self._rows)))
            unit[self._rows, np.arange(len(self._rows))] = 1.0
            self._response = np.reshape(self.linear.solve(unit), unit.shape)
            self._inner = np.eye(len(self._rows)) + self._block @ self._response[self._rows]

    def stiffness(self, y: Array, t: float, step: Array | None = None) -> tuple[Array, Array]:
        """Internal forces (N, 3), N, and the tangent on ``reduction.pattern``."""
        force, data, matrices = self.pieces(y, t, step)
        return force, self.assemble(data, matrices, force - self.external(t), y, t)

    def linearise(self, y: Array, t: float, step: Array | None = None) -> tuple[Array, float]:
        """See ``fea.newton.System``."""
        force, data = self.stiffness(y, t, step)
        self.factorise(data)
        largest = float(np.abs(data).max(initial=0.0))
        self.noise = 10 * np.finfo(float).eps * largest * float(np.linalg.norm(y))
        return self._balance(force, y, t)

    def solve(self, right: Array) -> Array:
        """See ``fea.newton.System``."""
        result = self.linear.solve(right)
        if len(self._rows):
            result = result - self._response @ np.linalg.solve(self._inner, self._block @ result[self._rows])
        return result

    def rate(self, y: Array, t: float, target: float) -> Array:
        """Change of the residual with t at fixed y, from t towards ``target``: ramps may have kinks."""
        small = 1e-6 * (target - t)
        return (self.residual(y, t + small)[0] - self.residual(y, t)[0]) / small

    def advance(self, y: Array, t: float, target: float, renew: bool = True) -> Array:
        """See ``fea.newton.System``."""
        if self._histories:
            # Viscous stress belongs to the whole increment: it has no derivative at its start.
            return self.solve(-self.linearise(y, target)[0])
        right, _ = self.linearise(y, t) if renew else self.residual(y, t)
        return self.solve(-right - (target - t) * self.rate(y, t, target))

    def prepare(self, y: Array, t: float) -> bool:
        """Let terms look where they are; True when they couple other nodes, so that the tangent must be made anew."""
        x = self.displacement(y, t)
        changed = [term.prepare(x) for term in self.terms]
        if any(changed):
            self._reduce_anew()
        return any(changed)

    def augment(self, y: Array, t: float) -> bool:
        """Whether a term has changed its multipliers, so that equilibrium must be found again."""
        x = self.displacement(y, t)
        changed = [term.augment(x) for term in self.terms]
        return any(changed)

    def accept(self, y: Array, t: float) -> Array | None:
        """Take over the end of an increment; other unknowns for the same state where they were rebased."""
        x = self.displacement(y, t)
        for term in self.terms:
            term.accept(x)
        if self._histories:
            step, strains = self.seconds * (t - self._accepted_at), [p.strains(x[i]) for p, i in self._placed]
            self._histories = [h.accept(e, step) for h, e in zip(self._histories, strains, strict=True)]
            self._accepted_at = t
        return self.links.rebase(y, t)

    def reject(self) -> None:
        """Go back to the last accepted increment."""
        for term in self.terms:
            term.reject()

    def energy(self, y: Array, t: float) -> float:
        """Strain energy of the parts and stored energy of terms and springs, J."""
        x = self.displacement(y, t)
        total = sum(float(p.strain_energy(x[place]).sum()) for p, place in self._placed)
        return total + sum(term.energy(x, t) for term in self.terms) + self.spring_energy(y, t)

    def spring_energy(self, y: Array, t: float) -> float:
        """Energy in the springs of rigid parts, J."""
        stretches = [(s.stiffness, s.rig(t) - self.links.pose(s.part, y, t)) for s in self.springs]
        return float(sum(0.5 * stiffness @ stretch**2 for stiffness, stretch in stretches))
