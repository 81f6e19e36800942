"""Natural vibrations and linear buckling of a case."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fea.case import Case
from fea.modes import buckling, natural_modes
from fea.motion import Motion
from fea.problem import Problem
from fea.run import Run
from fea.support import require_support

Array = NDArray[np.float64]

#: Displacement at which buckling measures the change of the stiffness, as a share of the size of the case.
_SMALL = 1e-6


@dataclass(frozen=True)
class Vibrations:
    """Natural vibrations, slowest first.

    Parameters
    ----------
    frequencies
        (modes,), Hz; 0 for rigid motions, negative where the state is unstable.
    shapes
        Displacements of all nodes (modes, N, 3), of unit modal mass, m/sqrt(kg m^2).
    missed
        Modes that the count of negative pivots finds below the highest, but not among these; None: not counted.
    """

    frequencies: Array
    shapes: Array
    missed: int | None


@dataclass(frozen=True)
class Buckling:
    """Linear buckling: factors on the loads (modes,), smallest first, and shapes (modes, N, 3), largest 1 m."""

    factors: Array
    shapes: Array


def vibrations(case: Case, count: int, at: Run | None = None) -> Vibrations:
    """Natural vibrations about rest, or about the last state of a static run (prestressed).

    Parameters
    ----------
    case
        Its damping is left out.
    count
        How many modes; of a free body the first six are rigid motions.
    at
        Run of the same case.
    """
    motion = Motion(case)
    problem = motion.problem
    y, t = (problem.rest, 0.0) if at is None else (at.state(), float(at.t[-1]))
    stiffness, mass = motion.matrices(y, t)
    found = natural_modes(problem.reduction.pattern, stiffness, mass, count, solver=case.solver)
    return Vibrations(found.frequencies, _shapes(problem, found.shapes, y, t), found.missed)


def linear_buckling(case: Case, count: int = 1) -> Buckling:
    """Factors on the case's loads (at t = 1) at which the state at rest first buckles, by the linear theory.

    A start for what comes after: scale a shape to a small imperfection, or trace the path with a small side load.

    Parameters
    ----------
    case
        Its loads are to be proportional to t.
    count
        How many factors.

    Raises
    ------
    ValueError
        When no positive factor exists.
    """
    problem = case.problem()
    require_support(case, problem)
    rest = problem.rest
    _, stiffness = problem.stiffness(rest, 0.0)
    answer = problem.advance(rest, 0.0, 1.0)
    largest = float(np.abs(problem.links.jacobian(rest, 0.0) @ answer).max())
    if not largest > 0.0:
        raise ValueError("the case has no load that could buckle it")
    small = _SMALL * float(np.ptp(case.points, axis=0).max()) / largest
    ends = [problem.stiffness(rest + sense * answer, sense)[1] for sense in (small, -small)]
    geometric = (ends[0] - ends[1]) / (2 * small)
    found = buckling(problem.reduction.pattern, stiffness, geometric, count, case.solver)
    return Buckling(found.factors, _shapes(problem, found.shapes, rest, 0.0))


def _shapes(problem: Problem, shapes: Array, y: Array, t: float) -> Array:
    """Shapes of the unknowns (modes, n) as displacements of all nodes (modes, N, 3)."""
    moved = problem.links.jacobian(y, t) @ shapes.T
    return np.ascontiguousarray(moved.T).reshape(len(shapes), -1, 3)
