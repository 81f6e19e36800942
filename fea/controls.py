"""Path following where loads cannot lead: displacement control and arc length, as systems of their own.

Both make the load parameter t an unknown and add one equation.  With K a = -r and K b = -dr/dt, one
factorisation and two solutions give the step (a + dt b, dt).
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fea.newton import NotConvergedError
from fea.problem import Problem

#: Turn of the path within one increment, rad, above which it may have been cut short; below this length it is a kink.
LARGEST_TURN, KINK = 0.3, 1e-3

Array = NDArray[np.float64]


class _Bordered(ABC):
    """A problem with its load parameter as last unknown; leaves give the extra equation."""

    noise = 0.0

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self._by_load = np.zeros(problem.links.unknowns)
        #: Forces that a gap of 1 counts as, so that one tolerance serves all equations.
        self._weight = 0.0

    @abstractmethod
    def row(self) -> tuple[Array, float]:
        """Derivative of the extra equation by y and t."""

    @abstractmethod
    def gap(self, state: Array, parameter: float) -> float:
        """Extra equation's residual."""

    def residual(self, state: Array, parameter: float) -> tuple[Array, float]:
        """See ``fea.newton.System``."""
        right, scale = self.problem.residual(state[:-1], state[-1])
        return np.append(right, (self._weight or scale) * self.gap(state, parameter)), scale

    def linearise(self, state: Array, parameter: float, step: Array | None = None) -> tuple[Array, float]:
        """See ``fea.newton.System``."""
        y, t = state[:-1], float(state[-1])
        right, scale = self.problem.linearise(y, t, None if step is None else step[:-1])
        self.noise = self.problem.noise
        self._by_load = self.problem.solve(-self.problem.rate(y, t, t + 1.0))
        self._weight = scale
        return np.append(right, scale * self.gap(state, parameter)), scale

    def solve(self, right: Array) -> Array:
        """See ``fea.newton.System``."""
        by_y, by_t = self.row()
        inner = self.problem.solve(right[:-1])
        change = (right[-1] / self._weight - by_y @ inner) / (by_y @ self._by_load + by_t)
        return np.append(inner + change * self._by_load, change)

    def prepare(self, state: Array, parameter: float) -> bool:
        """See ``fea.newton.System``."""
        return self.problem.prepare(state[:-1], state[-1])

    def augment(self, state: Array, parameter: float) -> bool:
        """See ``fea.newton.System``."""
        return self.problem.augment(state[:-1], state[-1])

    def accept(self, state: Array, parameter: float) -> Array | None:
        """See ``fea.newton.System``."""
        rebased = self.problem.accept(state[:-1], float(state[-1]))
        return None if rebased is None else np.append(rebased, state[-1])

    def reject(self) -> None:
        """See ``fea.newton.System``."""
        self.problem.reject()


class DisplacementControl(_Bordered):
    """Load parameter such that a weighted sum of unknowns goes through s * travel.

    Parameters
    ----------
    problem
        Its loads are to be proportional to t.
    weights
        Of the unknowns (n,); their sum c.y is steered.
    travel
        Value of c.y at s = 1, m.
    """

    def __init__(self, problem: Problem, weights: Array, travel: float) -> None:
        super().__init__(problem)
        self.weights, self.travel = weights / travel, travel

    def row(self) -> tuple[Array, float]:
        """See ``_Bordered``."""
        return self.weights, 0.0

    def gap(self, state: Array, parameter: float) -> float:
        """See ``_Bordered``."""
        return float(self.weights @ state[:-1]) - parameter

    def advance(self, state: Array, parameter: float, target: float, renew: bool = True) -> Array:
        """See ``fea.newton.System``."""
        right, _ = self.linearise(state, parameter) if renew else self.residual(state, parameter)
        right[-1] -= (target - parameter) * self._weight
        return self.solve(-right)


@dataclass
class _Tangent:
    """Where the last increment ended (state), at which arc length, and the unit direction onwards."""

    state: Array
    at: float
    direction: Array


class ArcLength(_Bordered):
    """The path's own length as parameter, through limit points and snap-backs (Riks; normal plane).

    Lengths are measured in unknowns and t, scaled so that the linear answer to t = ``load`` has the length 1
    in either share.

    Parameters
    ----------
    problem
        Its loads are to be proportional to t.
    state, t
        Equilibrium that the path starts from.
    load
        Load factor of the order that is of interest; negative to begin with falling t.
    """

    def __init__(self, problem: Problem, state: Array, t: float, load: float = 1.0) -> None:
        super().__init__(problem)
        #: Lengths that count as 1: of unknowns (their linear answer from rest; 1 where there is none) and of t.
        self.unit = (float(np.linalg.norm(self._answer(problem.rest, 0.0))) or 1.0) * abs(load)
        self.load = abs(load)
        by_load = self._answer(state, t)
        #: Angle, rad, of the last increment's chord with the path before it or behind it, whichever is larger.
        self.turn = 0.0
        start = np.append(state, t)
        self._tangent = _Tangent(start, 0.0, self._unit(np.append(by_load, 1.0) * np.sign(load)))

    def _answer(self, state: Array, t: float) -> Array:
        self.problem.linearise(state, t)
        return self.problem.solve(-self.problem.rate(state, t, t + 1.0))

    def _unit(self, change: Array) -> Array:
        return change / np.sqrt(self._dot(change, change))

    def _dot(self, a: Array, b: Array) -> float:
        return float(a[:-1] @ b[:-1]) / self.unit**2 + float(a[-1] * b[-1]) / self.load**2

    def row(self) -> tuple[Array, float]:
        """See ``_Bordered``."""
        direction = self._tangent.direction
        return direction[:-1] / self.unit**2, float(direction[-1]) / self.load**2

    def gap(self, state: Array, parameter: float) -> float:
        """See ``_Bordered``."""
        return self._dot(self._tangent.direction, state - self._tangent.state) - (parameter - self._tangent.at)

    def advance(self, state: Array, parameter: float, target: float, renew: bool = True) -> Array:
        """See ``fea.newton.System``."""
        if renew:
            self.linearise(state, parameter)
        onwards = self._unit(np.append(self._by_load, 1.0))
        if self._dot(onwards, self._tangent.direction) < 0:
            onwards = -onwards
        self._tangent = _Tangent(state, parameter, onwards)
        return (target - parameter) * onwards

    def augment(self, state: Array, parameter: float) -> bool:
        """See ``fea.newton.System``; an increment that turns too far is refused: a loop may lie in between."""
        if super().augment(state, parameter):
            return True
        chord, onwards = self._unit(state - self._tangent.state), self._unit(np.append(self._by_load, 1.0))
        cosine = min(self._dot(chord, self._tangent.direction), abs(self._dot(chord, onwards)))
        self.turn = float(np.arccos(np.clip(cosine, -1.0, 1.0)))
        if self.turn > LARGEST_TURN and parameter - self._tangent.at > KINK:
            raise NotConvergedError(f"the path turns by {np.rad2deg(self.turn):.0f} degrees within one increment")
        return False

    def accept(self, state: Array, parameter: float) -> Array | None:
        """See ``fea.newton.System``."""
        chord = self._unit(state - self._tangent.state)
        rebased = super().accept(state, parameter)
        if rebased is not None:
            # Rotations start from zero again: their share of the direction cannot be kept.
            chord = self._unit(np.where(rebased == state, chord, 0.0))
        self._tangent = _Tangent(state if rebased is None else rebased, parameter, chord)
        return rebased
