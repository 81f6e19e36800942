"""What a few published peaks say about many numbers: directions that they see, and other sets that are as good."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.objective import Problem
from calibrate.search import latin_hypercube, polish
from calibrate.space import Space

Array = NDArray[np.float64]
#: Candidates from which each further search picks its start, and its steps.
_CANDIDATES, _STEPS = 30, 12
#: Share of the largest singular value below which a direction counts as not seen.
_SEEN = 1e-3


@dataclass(frozen=True)
class Directions:
    """The residual's derivative by its singular values.

    Parameters
    ----------
    sizes
        Change of the residual along each direction across the whole search box, (k,), the largest first.
    directions
        Unit vectors in the unit cube, (k, n).
    seen
        Share of each coordinate that lies in the directions seen, (n,): 1 pinned down, 0 left open.
    """

    sizes: Array
    directions: Array
    seen: Array

    @property
    def rank(self) -> int:
        """Directions that are seen."""
        return int((self.sizes > _SEEN * self.sizes[0]).sum())


def directions_of(derivative: Array) -> Directions:
    """Directions of a derivative (N, n) by the unit cube."""
    _, sizes, rows = np.linalg.svd(derivative, full_matrices=False)
    kept = sizes > _SEEN * sizes[0]
    return Directions(sizes, rows, np.sum(rows[kept] ** 2, axis=0))


def in_words(space: Space, direction: Array, most: int = 5) -> str:
    """A direction as a product of powers, the largest first: numbers of one sign by their logarithms.

    Moving along it by a share t of the box multiplies each number by exp(power * t), or adds share * t of its range.
    """
    order = np.argsort(-np.abs(direction))[:most]
    return ", ".join(f"{space.names[i]} {direction[i]:+.2f}" for i in order if abs(direction[i]) > 0.1)


@dataclass(frozen=True)
class Sets:
    """Sets of numbers that follow the targets equally well.

    Parameters
    ----------
    units
        Points of the unit cube, (sets, n), the best first.
    objectives
        (sets,).
    tried
        Searches that were made for them.
    """

    units: Array
    objectives: Array
    tried: int

    def spread(self) -> Array:
        """Range of each coordinate over the sets as a share of the box, (n,)."""
        return np.asarray(np.ptp(self.units, axis=0))


def sets_as_good(problem: Problem, best: Array, residual: Array, count: int, tolerance: float, seed: int) -> Sets:
    """The set of a search and those that ``count`` further searches end at below ``tolerance``, the best first.

    Every further search starts at the best of some places all over the box and goes on by a few steps of least
    squares; it ends as soon as it can, not at an optimum, since every set below the tolerance is as good.  One that is
    better than the first by chance is led to its optimum.
    """
    random, rough = np.random.default_rng(seed), problem.rough()
    found, sizes = [best], [float(np.linalg.norm(residual))]
    for _ in range(count):
        places = latin_hypercube(_CANDIDATES, len(problem.space), random)
        residuals = rough.residuals(places)
        order = np.argsort(np.nan_to_num(np.linalg.norm(residuals, axis=1), nan=np.inf))
        start, first = places[order[0]], residuals[order[0]]
        if not np.isfinite(first).all():
            continue
        end, left = _descend(rough, start, first, tolerance)
        if float(np.linalg.norm(left)) <= tolerance:
            found.append(end)
            sizes.append(float(np.linalg.norm(left)))
    problem.evaluations = rough.evaluations
    if (here := int(np.argmin(sizes))) > 0:
        found[here], left = polish(problem, found[here], problem.residuals(found[here][None])[0])
        sizes[here] = float(np.linalg.norm(left))
    order = np.argsort(sizes)
    return Sets(np.array(found)[order], np.array(sizes)[order], count)


def _descend(problem: Problem, start: Array, first: Array, tolerance: float) -> tuple[Array, Array]:
    """A few Gauss-Newton steps of least length, each the nearest that the derivative promises; then least squares."""
    unit, residual = start, first
    for _ in range(_STEPS):
        if float(np.linalg.norm(residual)) <= tolerance:
            return unit, residual
        derivative = _forward(problem, unit, residual)
        step = -np.linalg.pinv(derivative, rcond=1e-2) @ residual
        step *= min(1.0, 0.35 / max(float(np.abs(step).max()), 1e-12))
        trials = np.clip(unit + np.outer([1.0, 0.4, 0.1], step), 0.0, 1.0)
        residuals = problem.residuals(trials)
        sizes = np.nan_to_num(np.linalg.norm(residuals, axis=1), nan=np.inf)
        here = int(np.argmin(sizes))
        if sizes[here] >= float(np.linalg.norm(residual)):
            break
        unit, residual = trials[here], residuals[here]
    return polish(problem, unit, residual, largest_count=6)


def _forward(problem: Problem, unit: Array, residual: Array) -> Array:
    """Forward differences (N, n), inwards at the bounds; zero where a run fails."""
    step = np.where(unit > 0.5, -1e-4, 1e-4)
    moved = problem.residuals(unit + np.diag(step))
    return np.asarray(np.nan_to_num((moved - residual) / step[:, None]).T)


def correlated(units: Array, names: Sequence[str], least: float = 0.6) -> list[tuple[str, str, float]]:
    """Pairs of coordinates that make up for one another among sets, with their rank correlation, strongest first."""
    if len(units) < 5:
        return []
    ranks = np.argsort(np.argsort(units, axis=0), axis=0).astype(float)
    with np.errstate(invalid="ignore"):
        table = np.corrcoef(ranks.T)
    pairs = [(names[i], names[j], float(table[i, j])) for i in range(len(names)) for j in range(i)]
    return sorted((p for p in pairs if abs(p[2]) >= least), key=lambda p: -abs(p[2]))
