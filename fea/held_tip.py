"""Clamped body whose tip face a robot moves as a rigid body, rigidly or through springs."""

import numpy as np
from numpy.typing import NDArray

from fea.linear import make_solver
from fea.newton import Smooth
from fea.parts import Deformable
from fea.rigid_face import RigidFace

Array = NDArray[np.float64]


def axes_of(nodes: NDArray[np.int64]) -> NDArray[np.int64]:
    """Unknowns of ``nodes``, (3 n,)."""
    return (3 * nodes[:, None] + np.arange(3)).ravel()


class HeldTip(Smooth):
    """Equilibrium with the root clamped and the tip on a robot; a ``System`` of ``fea.newton``.

    Unknowns y = (free displacements, sprung pose components).  The robot's pose is s * travel.

    Parameters
    ----------
    body
        Solid with boundaries ``root`` and ``tip``.
    springs
        Stiffness between robot and tip for d and theta (6,), N/m and N m/rad; inf: rigid.
    solver
        Kind of linear solver.
    """

    def __init__(self, body: Deformable, springs: Array, solver: str = "auto") -> None:
        self.body = body
        nodes = body.boundary("tip")
        shares = body.shares("tip")[nodes]
        centre = shares @ body.points[nodes] / shares.sum()
        self.face = RigidFace(nodes, centre, body.points[nodes] - centre)
        self.sprung = np.flatnonzero(np.isfinite(springs))
        self.rigid = np.flatnonzero(~np.isfinite(springs))
        self.springs = springs
        self.travel = np.zeros(6)
        held = np.union1d(axes_of(nodes), axes_of(body.boundary("root")))
        self.free = np.setdiff1d(np.arange(3 * body.nodes), held)
        pattern, self._taken = body.pattern.restrict(self.free)
        self.solver = make_solver(solver, pattern)
        # Reactions are zero at rest: below this force, N, residuals are noise.
        self._floor = 1e-9 * body.material.youngs_modulus * shares.sum()

    @property
    def rest(self) -> Array:
        """Unknowns at rest."""
        return np.zeros(len(self.free) + len(self.sprung))

    def pose(self, state: Array, parameter: float) -> Array:
        """Tip pose (6,), m and rad."""
        pose = parameter * self.travel
        pose[self.sprung] = state[len(self.free) :]
        return pose

    def displacement(self, state: Array, parameter: float) -> Array:
        """Nodal displacements (nodes, 3), m."""
        result = np.zeros((self.body.nodes, 3))
        result.reshape(-1)[self.free] = state[: len(self.free)]
        result[self.face.nodes] = self.face.displacement(self.pose(state, parameter))
        return result

    def wrench(self, state: Array, parameter: float) -> Array:
        """Force and moment about the current tip centre on the tip (6,), N and N m."""
        force = self.body.internal_force(self.displacement(state, parameter))
        return self.face.wrench(self.pose(state, parameter), force[self.face.nodes])

    def residual(self, state: Array, parameter: float) -> tuple[Array, float]:
        """See ``fea.newton.System``."""
        return self._reduce(self.body.internal_force(self.displacement(state, parameter)), state, parameter)

    def _reduce(self, force: Array, state: Array, parameter: float) -> tuple[Array, float]:
        pose, at_tip = self.pose(state, parameter), force[self.face.nodes]
        stretch = (pose - parameter * self.travel)[self.sprung]
        on_pose = self.face.work(pose, at_tip)[self.sprung] + self.springs[self.sprung] * stretch
        right = np.concatenate([force.reshape(-1)[self.free], on_pose])
        return right, max(float(np.linalg.norm(at_tip.sum(axis=0))), float(np.linalg.norm(at_tip)), self._floor)

    def linearise(self, state: Array, parameter: float, step: Array | None = None) -> tuple[Array, float]:
        """See ``fea.newton.System``."""
        pose = self.pose(state, parameter)
        moved = self.displacement(state, parameter)
        last = None if step is None else moved - self.displacement(state - step, parameter)
        force, data = self.body.tangent(moved, step=last)
        self.solver.factorise(data[self._taken])
        moved_nodes = np.zeros((self.body.nodes, 3, 6))
        moved_nodes[self.face.nodes] = self.face.jacobian(pose)
        moves = moved_nodes.reshape(-1, 6)
        pushed = self.body.pattern.times(data, moves)
        self._coupling = pushed[self.free]
        self._on_pose = moves.T @ pushed + self.face.geometric(pose, force[self.face.nodes])
        if len(self.sprung):
            self._response = self.solver.solve(self._coupling[:, self.sprung])
            self._schur = (
                self._on_pose[np.ix_(self.sprung, self.sprung)] + np.diag(self.springs[self.sprung])
                - self._coupling[:, self.sprung].T @ self._response
            )  # fmt: skip
        return self._reduce(force, state, parameter)

    def solve(self, right: Array) -> Array:
        """See ``fea.newton.System``."""
        n = len(self.free)
        inner = self.solver.solve(right[:n])
        if not len(self.sprung):
            return inner
        outer = np.linalg.solve(self._schur, right[n:] - self._coupling[:, self.sprung].T @ inner)
        return np.concatenate([inner - self._response @ outer, outer])

    def advance(self, state: Array, parameter: float, target: float) -> Array:
        """See ``fea.newton.System``."""
        right, _ = self.linearise(state, parameter)
        move = (target - parameter) * self.travel
        pushed = self._coupling[:, self.rigid] @ move[self.rigid]
        on_pose = self._on_pose[np.ix_(self.sprung, self.rigid)] @ move[self.rigid]
        on_pose -= self.springs[self.sprung] * move[self.sprung]
        return self.solve(-right - np.concatenate([pushed, on_pose]))

    def tangent_stiffness(self, state: Array, parameter: float) -> Array:
        """Stiffness of the tip with the inside in equilibrium (6, 6), SI, by six condensed solves."""
        self.linearise(state, parameter)
        return self._on_pose - self._coupling.T @ self.solver.solve(self._coupling)
