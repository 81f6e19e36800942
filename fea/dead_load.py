"""Clamped body under nodal forces that keep their direction."""

import numpy as np
from numpy.typing import NDArray

from fea.held_tip import axes_of
from fea.linear import make_solver
from fea.newton import Smooth
from fea.parts import Deformable

Array = NDArray[np.float64]


class DeadLoad(Smooth):
    """Equilibrium under s * load with the root clamped; a ``System`` of ``fea.newton``.

    Parameters
    ----------
    body
        Solid with the boundary ``root``.
    load
        Nodal forces at s = 1, (nodes, 3), N.
    solver
        Kind of linear solver.
    """

    def __init__(self, body: Deformable, load: Array, solver: str = "auto") -> None:
        self.body = body
        self.root = body.boundary("root")
        self.free = np.setdiff1d(np.arange(3 * body.nodes), axes_of(self.root))
        self._load = load.reshape(-1)[self.free]
        pattern, self._taken = body.pattern.restrict(self.free)
        self.solver = make_solver(solver, pattern)
        self._floor = 1e-12 * body.material.youngs_modulus * float(body.shares("root").sum())

    @property
    def rest(self) -> Array:
        """Unknowns at rest."""
        return np.zeros(len(self.free))

    def displacement(self, state: Array) -> Array:
        """Nodal displacements (nodes, 3), m."""
        result = np.zeros((self.body.nodes, 3))
        result.reshape(-1)[self.free] = state
        return result

    def residual(self, state: Array, parameter: float) -> tuple[Array, float]:
        """See ``fea.newton.System``."""
        return self._reduce(self.body.internal_force(self.displacement(state)), parameter)

    def _reduce(self, force: Array, parameter: float) -> tuple[Array, float]:
        reaction = float(np.linalg.norm(force[self.root]))
        applied = parameter * float(np.linalg.norm(self._load))
        return force.reshape(-1)[self.free] - parameter * self._load, max(reaction, applied, self._floor)

    def linearise(self, state: Array, parameter: float, step: Array | None = None) -> tuple[Array, float]:
        """See ``fea.newton.System``."""
        last = None if step is None else self.displacement(step)
        force, data = self.body.tangent(self.displacement(state), step=last)
        self.solver.factorise(data[self._taken])
        return self._reduce(force, parameter)

    def solve(self, right: Array) -> Array:
        """See ``fea.newton.System``."""
        return self.solver.solve(right)

    def advance(self, state: Array, parameter: float, target: float) -> Array:
        """See ``fea.newton.System``."""
        right, _ = self.linearise(state, parameter)
        return self.solve((target - parameter) * self._load - right)
