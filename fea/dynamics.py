"""Implicit motion of a clamped body: generalised-alpha with a modified Newton method.

    M a_m + c M v_f + f_f = p,   x_f = (1 - alpha_f) x_1 + alpha_f x_0,   a_m likewise by alpha_m

(Chung & Hulbert 1993).  The strain rate of the viscous stress is the second-order backward
difference of the strains themselves; a tangent that follows from it is symmetric.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fea.linear import SingularMatrixError, make_solver
from fea.newton import NotConvergedError, search
from fea.parts import Deformable
from fea.secant import Secant

Array = NDArray[np.float64]


#: Weights of equally spaced values, newest first, that continue a parabola or a cubic.
_EXTRAPOLATE = ((3.0, -3.0, 1.0), (4.0, -6.0, 4.0, -1.0))


def axes_of(nodes: NDArray[np.int64]) -> NDArray[np.int64]:
    """Unknowns of ``nodes``, (3 n,)."""
    return (3 * nodes[:, None] + np.arange(3)).ravel()


class StoppedError(ArithmeticError):
    """The motion could not be continued past ``time`` (s)."""

    def __init__(self, message: str, time: float) -> None:
        super().__init__(message)
        self.time = time


@dataclass(frozen=True)
class Blend:
    """Weights of generalised-alpha for a spectral radius ``rho`` at infinite frequency."""

    rho: float = 0.9

    @property
    def alpha_m(self) -> float:
        """Weight of the old acceleration."""
        return (2 * self.rho - 1) / (self.rho + 1)

    @property
    def alpha_f(self) -> float:
        """Weight of the old force and velocity."""
        return self.rho / (self.rho + 1)

    @property
    def beta(self) -> float:
        """Newmark's beta."""
        return (1 - self.alpha_m + self.alpha_f) ** 2 / 4

    @property
    def gamma(self) -> float:
        """Newmark's gamma."""
        return 0.5 - self.alpha_m + self.alpha_f


@dataclass(frozen=True)
class Motion:
    """One instant: displacement, velocity, acceleration and internal force of the free unknowns (n,), SI.

    ``strains`` (elements, points, 6) here and ``earlier`` by ``step`` s serve the viscous stress;
    ``trail`` holds the displacements of the last equal steps, newest first, for the predictor.
    """

    u: Array
    v: Array
    a: Array
    force: Array
    strains: Array
    earlier: Array
    step: float
    trail: tuple[Array, ...] = ()


class Dynamics:
    """Motion of a body whose root is clamped, under constant nodal forces.

    Parameters
    ----------
    body
        Solid with the boundary ``root``; its material gives both kinds of damping.
    on_boundary
        Masses, kg, spread over named faces.
    load
        Constant nodal forces (nodes, 3), N.
    solver, tolerance, rho
        Linear solver; residual relative to the largest reaction so far; spectral radius.
    """

    max_iterations = 40
    #: A residual that falls slower than this asks for a fresh tangent, which costs some 15 iterations.
    stall = 0.85
    max_splits = 6

    def __init__(
        self, body: Deformable, on_boundary: dict[str, float] | None = None, load: Array | None = None,
        solver: str = "auto", tolerance: float = 1e-6, rho: float = 0.9,
    ) -> None:  # fmt: skip
        self.body, self.tolerance, self.blend = body, tolerance, Blend(rho)
        self.root = body.boundary("root")
        self.free = np.setdiff1d(np.arange(3 * body.nodes), axes_of(self.root))
        pattern, self._taken = body.pattern.restrict(self.free)
        self._mass = body.mass(on_boundary)[self._taken]
        self.mass = pattern.full(self._mass)
        self._load = np.zeros(len(self.free)) if load is None else load.reshape(-1)[self.free]
        self.solver = make_solver(solver, pattern)
        self._factorised_for = 0.0
        self._reaction = 0.0
        self.largest_reaction = 1e-12 * body.material.youngs_modulus * float(body.shares("root").sum())
        self.counts = {"steps": 0, "split_steps": 0, "iterations": 0, "tangents": 0}

    def start(self, u: Array, v: Array) -> Motion:
        """Motion that begins at ``u``, ``v`` with the acceleration of the equation of motion."""
        # E is quadratic in u, so this difference is the exact strain rate, whatever its 1 ms.
        ahead, behind = (self.body.strains(self.nodal(u + sense * v)) for sense in (1e-3, -1e-3))
        past = self.body.material.viscous_time * (ahead - behind) / 2e-3
        force = self._force(u, np.finfo(float).tiny, past)
        # Later residuals are relative to the largest reaction so far: at rest reactions vanish.
        self.largest_reaction = max(self.largest_reaction, self._reaction)
        self.solver.factorise(self._mass)
        self._factorised_for = 0.0
        a = self.solver.solve(self._load - force) - self.body.material.mass_damping * v
        strains = self.body.strains(self.nodal(u))
        return Motion(u, v, a, force, strains, strains, np.inf)

    def nodal(self, free: Array) -> Array:
        """Free unknowns as nodal vectors (nodes, 3)."""
        result = np.zeros((self.body.nodes, 3))
        result.reshape(-1)[self.free] = free
        return result

    def kinetic_energy(self, motion: Motion) -> float:
        """v'Mv/2, J."""
        return float(0.5 * motion.v @ (self.mass @ motion.v))

    def strain_energy(self, motion: Motion) -> float:
        """J."""
        return float(self.body.strain_energy(self.nodal(motion.u)).sum())

    def samples(self, motion: Motion, interval: float, count: int, substeps: int) -> Iterator[Motion]:
        """The motion at 0, interval, ... (``count`` samples), each interval in ``substeps`` equal steps.

        Raises
        ------
        StoppedError
        """
        yield motion
        for sample in range(count - 1):
            for part in range(substeps):
                try:
                    motion = self._advance(motion, interval / substeps, self.max_splits)
                except (NotConvergedError, SingularMatrixError) as error:
                    raise StoppedError(str(error), (sample + part / substeps) * interval) from None
            yield motion

    def _advance(self, motion: Motion, step: float, splits: int) -> Motion:
        try:
            self.counts["steps"] += 1
            return self._step(motion, step)
        except (NotConvergedError, SingularMatrixError):
            self._factorised_for = 0.0
            if not splits:
                raise
        self.counts["split_steps"] += 1
        return self._advance(self._advance(motion, step / 2, splits - 1), step / 2, splits - 1)

    def _step(self, begin: Motion, step: float) -> Motion:
        end = _Step(self, begin, step)
        u, right = end.guess()
        moved, secant, fresh = u - begin.u, Secant(), False
        # At the very first step the reactions may still be zero: the momentum stands in.
        first = 0.0 if np.isfinite(begin.step) else float(np.linalg.norm(self.mass @ begin.v)) / step
        scale = max(self.largest_reaction, first)
        for _ in range(self.max_iterations):
            size = float(np.linalg.norm(right))
            if not np.isfinite(size):
                break
            if size <= self.tolerance * scale:
                self.largest_reaction = max(self.largest_reaction, self._reaction)
                return end.accepted(u)
            if self._factorised_for != step:
                end.linearise(u, moved)
                secant, fresh = Secant(), True
            change = secant.improve(self.solver.solve(-right))
            trial = end.residual(u + change)
            self.counts["iterations"] += 1
            falls = np.linalg.norm(trial) < self.stall * size
            if fresh and not falls:
                length, trial, _ = search(lambda x: (end.residual(x), 1.0), u, change, right, (trial, 1.0))
                change = length * change
            if falls or fresh:
                u, right, moved = u + change, trial, change
            if not falls:
                self._factorised_for = 0.0
            fresh = False
        raise NotConvergedError(f"no equilibrium of forces within {self.max_iterations} iterations")

    def _force(self, u: Array, viscosity: float, past: Array | None) -> Array:
        force = self.body.internal_force(self.nodal(u), viscosity, past)
        self._reaction = float(np.linalg.norm(force[self.root]))
        return force.reshape(-1)[self.free]

    def summary(self) -> dict[str, Any]:
        """What was done, as plain JSON data."""
        return {"method": "generalised-alpha", "rho_inf": self.blend.rho, "tolerance": self.tolerance, **self.counts}


class _Step:
    """Equation of one step, in the displacement at its end."""

    def __init__(self, owner: Dynamics, begin: Motion, step: float) -> None:
        self.owner, self.begin, self.step = owner, begin, step
        material = owner.body.material
        # dE/dt = (c1 E1 - c0 E0 + c_ E_)/step, backward difference on the steps begin.step, step.
        ratio = step / begin.step
        tau = material.viscous_time / step
        self.viscosity = tau * (1 + 2 * ratio) / (1 + ratio)
        self.past = None
        if tau > 0:
            self.past = tau * (ratio**2 / (1 + ratio) * begin.earlier - (1 + ratio) * begin.strains)

    def guess(self) -> tuple[Array, Array]:
        """Best of constant velocity, and of polynomials through the last displacements, and its residual."""
        begin = self.begin
        past = (begin.u, *begin.trail) if begin.step == self.step else (begin.u,)
        known = [weights for weights in _EXTRAPOLATE if len(weights) <= len(past)]
        guesses = [np.tensordot(weights, past[: len(weights)], axes=1) for weights in known]
        if len(guesses) < 2:
            guesses.append(begin.u + self.step * begin.v)
        residuals = [self.residual(u) for u in guesses]
        sizes = [float(np.linalg.norm(r)) if np.isfinite(r).all() else np.inf for r in residuals]
        best = sizes.index(min(sizes))
        return guesses[best], residuals[best]

    def motion(self, u: Array) -> tuple[Array, Array]:
        """Velocity and acceleration at the end (Newmark)."""
        blend, begin, step = self.owner.blend, self.begin, self.step
        a = (u - begin.u - step * begin.v) / (blend.beta * step**2) - (0.5 / blend.beta - 1) * begin.a
        return begin.v + step * ((1 - blend.gamma) * begin.a + blend.gamma * a), a

    def residual(self, u: Array) -> Array:
        """Out-of-balance force (n,), N."""
        owner, begin = self.owner, self.begin
        am, af = owner.blend.alpha_m, owner.blend.alpha_f
        v, a = self.motion(u)
        drag = owner.body.material.mass_damping * ((1 - af) * v + af * begin.v)
        self.force = owner._force(u, self.viscosity, self.past)
        inertia = owner.mass @ ((1 - am) * a + am * begin.a + drag)
        return inertia + (1 - af) * self.force + af * begin.force - owner._load

    def linearise(self, u: Array, moved: Array) -> None:
        """Factorise the derivative of ``residual``."""
        owner, blend = self.owner, self.owner.blend
        _, stiffness = owner.body.tangent(owner.nodal(u), self.viscosity, self.past, owner.nodal(moved))
        inertia = (1 - blend.alpha_m) / (blend.beta * self.step**2)
        inertia += (1 - blend.alpha_f) * blend.gamma / (blend.beta * self.step) * owner.body.material.mass_damping
        owner.solver.factorise(inertia * owner._mass + (1 - blend.alpha_f) * stiffness[owner._taken])
        owner._factorised_for = self.step
        owner.counts["tangents"] += 1

    def accepted(self, u: Array) -> Motion:
        """The motion at the end, after ``residual(u)``."""
        v, a = self.motion(u)
        strains = self.owner.body.strains(self.owner.nodal(u)) if self.past is not None else self.begin.strains
        trail = (self.begin.u, *self.begin.trail)[:3] if self.begin.step == self.step else (self.begin.u,)
        return Motion(u, v, a, self.force, strains, self.begin.strains, self.step, trail)
