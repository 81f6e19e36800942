"""Motion of a case in time: generalised-alpha on displacements, with rigid parts, ties and contact.

    J'[M a_m + c M v_f + f_f - p_f] = 0,   x_f = (1 - alpha_f) x_1 + alpha_f x_0,   a_m likewise by alpha_m

(Chung & Hulbert 1993).  Newmark's formulas act on the displacements x of all nodes, so that the mass is
constant whatever turns; rigid parts carry point masses with their mass and inertia.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import block_diag, csr_array, diags_array
from scipy.sparse.linalg import lsqr

from fea.case import Case
from fea.dynamics import Blend
from fea.linear import SingularMatrixError, make_solver
from fea.newton import Increment, NotConvergedError, Options, settle
from fea.problem import Problem, Viscous
from fea.run import Run
from fea.terms import Steady
from fea.viscosity import ViscousHistory

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Instant:
    """Unknowns y, and displacement, velocity, acceleration and out-of-balance static force of all nodes (N, 3), SI.

    ``rebased``: rotations count from here, so that earlier unknowns do not continue into these.
    """

    t: float
    y: Array
    x: Array
    v: Array
    a: Array
    force: Array
    rebased: bool = False


class PointMasses(Steady):
    """A ``Term`` without force: room in the equations for masses on nodes.

    Parameters
    ----------
    nodes, masses
        (n,), and kg (n,).
    """

    def __init__(self, nodes: NDArray[np.int64], masses: Array) -> None:
        self.cells, self.matrices = nodes[:, None], masses[:, None, None] * np.eye(3)

    def force(self, x: Array, t: float) -> Array:
        """See ``Term``."""
        return np.zeros_like(x)

    def tangent(self, x: Array, t: float) -> Array:
        """See ``Term``."""
        return np.zeros_like(self.matrices)

    def report(self, x: Array) -> dict[str, float]:
        """See ``Term``."""
        return {}


class Motion:
    """Time stepping of a problem; a ``System`` of ``fea.newton`` for the step that is being made.

    Parameters
    ----------
    case
        What moves; t is the time, s, and ramps are functions of it.
    rho
        Spectral radius at infinite frequency: 1 damps nothing, 0 all that the step cannot resolve.
    base
        Acceleration (3,), m/s^2, of the frame that displacements are measured in, as a function of t.
    """

    def __init__(self, case: Case, rho: float = 0.9, base: Callable[[float], Sequence[float]] | None = None) -> None:
        self.problem: Problem = case.problem()
        self.points = PointMasses(
            np.concatenate([nodes for nodes, _ in case.masses] or [np.zeros(0, dtype=np.int64)]),
            np.concatenate([masses for _, masses in case.masses] or [np.zeros(0)]),
        )
        self.problem = replace(self.problem, terms=[*self.problem.terms, self.points])
        self.blend, self.base = Blend(rho), base
        self._part_mass = [part.mass() for part in case.parts]
        lumps = np.bincount(self.points.cells[:, 0], self.points.matrices[:, 0, 0], len(case.points))
        blocks = [part.pattern.full(m) for part, m in zip(case.parts, self._part_mass, strict=True)]
        blocks += [csr_array((3 * (len(case.points) - case.nodes),) * 2)]
        self.mass = csr_array(block_diag(blocks, format="csr")) + diags_array(np.repeat(lumps.astype(np.float64), 3))
        self._drag = [part.material.mass_damping for part in case.parts]
        drag = np.concatenate([np.full(3 * p.nodes, p.material.mass_damping) for p in case.parts])
        self._drag_x = np.concatenate([drag, np.zeros(self.mass.shape[0] - len(drag))])
        self._viscous: list[ViscousHistory] = []
        self._scale = self.problem.residual(self.problem.rest, 0.0)[1]
        self._begin: Instant
        self._step = 0.0
        self._factorised_for = 0.0
        self.noise = 0.0

    def start(self, y: Array, velocity: Array | None = None, t: float = 0.0) -> Instant:
        """The instant that a motion begins with: accelerations from the equation of motion.

        Parameters
        ----------
        y
            Unknowns.
        velocity
            Of all nodes (N, 3), m/s; of prescribed ones their prescription counts.
        t
            s.
        """
        problem, links = self.problem, self.problem.links
        x = problem.displacement(y, t)
        strains = [part.strains(x[place]) for part, place in zip(problem.parts, problem.places, strict=True)]
        histories = zip(problem.parts, strains, strict=True)
        self._viscous = [ViscousHistory.begin(part.material, strain) for part, strain in histories]
        # What is prescribed moves by its own functions of time; all else rides on the rate of the unknowns.
        small, jacobian = 1e-5, links.jacobian(y, t)
        ahead, behind = (links.displacement(y, t + s) for s in (small, -small))
        own, a = (ahead - behind) / (2 * small), (ahead - 2 * x + behind) / small**2
        rate = np.zeros_like(y) if velocity is None else lsqr(jacobian, (velocity - own).ravel(), 0.0, 1e-14, 1e-14)[0]
        v = own + (jacobian @ rate).reshape(-1, 3)
        # Rigid parts that turn accelerate their points towards the axis.
        far = 1e-4 / (float(np.abs(rate).max(initial=0.0)) or 1.0)
        ahead, behind = (links.displacement(y + s * rate, t) for s in (far, -far))
        a += (ahead - 2 * x + behind) / far**2
        force = self._static_force(y, t)
        right = -force - (self.mass @ (a.ravel() + self._drag_x * v.ravel())).reshape(-1, 3)
        linear = make_solver(problem.solver, problem.reduction.pattern)
        linear.factorise(self._reduced_mass(y, t))
        a += (jacobian @ linear.solve(links.reduce(right, y, t))).reshape(-1, 3)
        self._scale = max(self._scale, float(np.linalg.norm(force)))
        return Instant(t, y, x, v, a, force)

    def matrices(self, y: Array, t: float) -> tuple[Array, Array]:
        """Stiffness and mass at a state, on ``problem.reduction.pattern``, N/m and kg."""
        problem = self.problem
        problem.prepare(y, t)
        _, stiffness = problem.stiffness(y, t)
        return stiffness, self._reduced_mass(y, t)

    def _reduced_mass(self, y: Array, t: float) -> Array:
        problem = self.problem
        matrices = [np.zeros((*term.cells.shape[:1], *(3 * term.cells.shape[1],) * 2)) for term in problem.terms]
        matrices[-1] = self.points.matrices
        jacobian = problem.links.jacobian(y, t) if len(problem.links.linked) else None
        return problem.reduction.reduce(self._part_mass, matrices, jacobian)

    def _static_force(self, y: Array, t: float) -> Array:
        return self.problem.internal(self.problem.displacement(y, t), t) - self.loads(t)

    def loads(self, t: float) -> Array:
        """Dead nodal forces (N, 3), N, with the inertia of an accelerated frame."""
        external = self.problem.external(t)
        if self.base is None:
            return external
        push = np.broadcast_to(np.asarray(self.base(t), dtype=float), external.shape)
        return external - (self.mass @ push.ravel()).reshape(-1, 3)

    def step(self, begin: Instant, size: float, guess: Array, options: Options) -> Instant:
        """The instant ``size`` s later.

        Raises
        ------
        NotConvergedError, SingularMatrixError
        """
        problem, target = self.problem, begin.t + size
        self._begin, self._step = begin, size
        coefficients = [history.coefficients(size) for history in self._viscous]
        problem.viscous = Viscous([c[0] for c in coefficients], [c[1] for c in coefficients])
        y = self._settled(begin, guess, target, options)
        x, (v, a) = problem.displacement(y, target), self._motion(y, target)
        force = self._static_force(y, target)
        self._scale = max(self._scale, float(np.linalg.norm(force)))
        self._viscous = [
            history.accept(part.strains(x[place]), size) if history.active else history
            for history, part, place in zip(self._viscous, problem.parts, problem.places, strict=True)
        ]
        rebased = problem.accept(y, target)
        return Instant(target, y if rebased is None else rebased, x, v, a, force, rebased is not None)

    def _settled(self, begin: Instant, guess: Array, target: float, options: Options) -> Array:
        """Unknowns at the end of the step: with kept tangents where the options allow, else with new ones."""
        problem, renewed = self.problem, replace(options, keep_below=0.0)
        fresh = problem.prepare(begin.y, begin.t) or self._factorised_for != self._step
        for attempt in (renewed,) if fresh or not options.keep_below else (options, renewed):
            try:
                return settle(self, begin.y, guess, target, attempt, Increment(target))
            except (NotConvergedError, SingularMatrixError):
                problem.reject()
                self._factorised_for = 0.0
                if attempt is renewed:
                    raise
        raise AssertionError("one attempt always renews")

    def _motion(self, y: Array, t: float) -> tuple[Array, Array]:
        """Velocity and acceleration of all nodes at the end of the step (Newmark)."""
        blend, begin, h = self.blend, self._begin, self._step
        x = self.problem.displacement(y, t)
        a = (x - begin.x - h * begin.v) / (blend.beta * h**2) - (0.5 / blend.beta - 1) * begin.a
        return begin.v + h * ((1 - blend.gamma) * begin.a + blend.gamma * a), a

    def _inertia(self, y: Array, t: float) -> Array:
        """Share of the out-of-balance forces (N, 3), N, that is not the static force at the end of the step."""
        blend, begin = self.blend, self._begin
        v, a = self._motion(y, t)
        am, af = blend.alpha_m, blend.alpha_f
        drag = self._drag_x * ((1 - af) * v + af * begin.v).ravel()
        inertia = self.mass @ (((1 - am) * a + am * begin.a).ravel() + drag)
        return inertia.reshape(-1, 3) + af * begin.force

    def residual(self, state: Array, parameter: float) -> tuple[Array, float]:
        """See ``fea.newton.System``."""
        return self._balance(state, parameter, self._static_force(state, parameter), self._inertia(state, parameter))

    def _balance(self, state: Array, parameter: float, static: Array, inertia: Array) -> tuple[Array, float]:
        stiff = 1 - self.blend.alpha_f
        right = self.problem.links.reduce(inertia + stiff * static, state, parameter)
        for pull, place in self.problem.pose_forces(state, parameter):
            right[place] -= stiff * pull
        # Free bodies have no reactions: inertia stands in.  Only accepted steps raise the scale for good.
        size = float(np.linalg.norm(inertia))
        return right, max(self._scale, size if np.isfinite(size) else 0.0)

    def linearise(self, state: Array, parameter: float, step: Array | None = None) -> tuple[Array, float]:
        """See ``fea.newton.System``."""
        blend, h, problem = self.blend, self._step, self.problem
        internal, data, matrices = problem.pieces(state, parameter, step)
        static, rest = internal - self.loads(parameter), self._inertia(state, parameter)
        inertia = (1 - blend.alpha_m) / (blend.beta * h**2)
        slope = (1 - blend.alpha_f) * blend.gamma / (blend.beta * h)
        stiff = 1 - blend.alpha_f
        masses = [(inertia + slope * c) * m for m, c in zip(self._part_mass, self._drag, strict=True)]
        whole = [stiff * k + m for k, m in zip(data, masses, strict=True)]
        small = [stiff * m for m in matrices]
        small[-1] = inertia * self.points.matrices
        problem.factorise(problem.assemble(whole, small, rest + stiff * static, state, parameter))
        self._factorised_for = h
        return self._balance(state, parameter, static, rest)

    def solve(self, right: Array) -> Array:
        """See ``fea.newton.System``."""
        return self.problem.solve(right)

    def advance(self, state: Array, parameter: float, target: float, renew: bool = True) -> Array:
        """See ``fea.newton.System``; steps bring their own guess, so that none is made here."""
        return np.zeros_like(state)

    def prepare(self, state: Array, parameter: float) -> bool:
        """See ``fea.newton.System``."""
        return False

    def augment(self, state: Array, parameter: float) -> bool:
        """See ``fea.newton.System``."""
        return self.problem.augment(state, parameter)

    def accept(self, state: Array, parameter: float) -> Array | None:
        """See ``fea.newton.System``."""

    def reject(self) -> None:
        """See ``fea.newton.System``."""

    def balance(self, instant: Instant) -> Array:
        """What supports must add at an instant (N, 3), N: inertia and drag with the static out-of-balance force."""
        inertia = self.mass @ (instant.a.ravel() + self._drag_x * instant.v.ravel())
        return inertia.reshape(-1, 3) + instant.force

    def kinetic_energy(self, instant: Instant) -> float:
        """v'Mv/2, J."""
        return float(0.5 * instant.v.ravel() @ (self.mass @ instant.v.ravel()))


def transient(
    case: Case, duration: float, step: float, start: Run | None = None, velocity: Array | None = None,
    base: Callable[[float], Sequence[float]] | None = None, rho: float = 0.9, record_every: int = 1,
    options: Options | None = None,
) -> Run:  # fmt: skip
    """Follow the motion of a case for ``duration`` s in steps of ``step`` s.

    Parameters
    ----------
    case
        Ramps of its loads and prescribed motions are functions of time, s.
    start
        Static run with the same constraints whose last state is the start; None starts at rest.
    velocity
        Of all nodes at the start (N, 3), m/s.
    base
        Acceleration (3,), m/s^2, of the frame as a function of time: displacements are then relative to it.
    rho
        Spectral radius of generalised-alpha, 0 to 1.
    record_every
        Steps between recorded instants.
    options
        Tolerances and limits of Newton's method.

    Returns
    -------
    Run
        t is the time, s; ``kinetic`` the kinetic energy.  ``diverged`` with all instants so far where a
        step failed even when cut to 1/64.
    """
    began = perf_counter()
    options = options or Options(tolerance=1e-6, keep_below=np.inf, stall=0.5, max_iterations=25)
    motion = Motion(case, rho, base)
    run = Run(case, motion.problem)
    now = motion.start(motion.problem.rest if start is None else start.state(), velocity)
    run.add(now.t, now.y, motion.balance(now), now.v, motion.kinetic_energy(now), motion.loads(now.t))
    steps, before = max(round(duration / step), 1), [now]
    counts = {"steps": 0, "cut_steps": 0}
    for number in range(1, steps + 1):
        try:
            now = _stride(motion, before, duration / steps, options, counts, 6)
        except (NotConvergedError, SingularMatrixError) as error:
            run.status, run.reason = "diverged", f"the motion stopped at {now.t:.6g} s of {duration:g} s: {error}"
            break
        if number % record_every == 0 or number == steps:
            run.add(now.t, now.y, motion.balance(now), now.v, motion.kinetic_energy(now), motion.loads(now.t))
        run.reached = number / steps
    run.history, run.wall_time = counts, perf_counter() - began
    return run


def _stride(
    motion: Motion, before: list[Instant], size: float, options: Options, counts: dict[str, int], cuts: int
) -> Instant:
    """One step, halved where it fails; ``before`` holds the last instants, newest last."""
    counts["steps"] += 1
    try:
        now = motion.step(before[-1], size, _guess(motion, before, size), options)
    except (NotConvergedError, SingularMatrixError):
        if not cuts:
            raise
        counts["cut_steps"] += 1
        for _ in range(2):
            now = _stride(motion, before, size / 2, options, counts, cuts - 1)
        return now
    before[:] = [now] if now.rebased else [*before[-2:], now]
    return now


def _guess(motion: Motion, before: list[Instant], size: float) -> Array:
    """Unknowns at the end of the step by their last values and, of free displacements, velocity."""
    now, links = before[-1], motion.problem.links
    times = np.diff([instant.t for instant in before])
    if len(before) == 3 and np.allclose(times, size):
        return 3 * now.y - 3 * before[-2].y + before[-3].y
    guess, count = now.y.copy(), len(links.free)
    guess[:count] += size * now.v.reshape(-1)[links.free]
    if len(before) > 1:
        guess[count:] += (now.y - before[-2].y)[count:] * size / (now.t - before[-2].t)
    return guess
