"""What the records can and cannot tell, in plain sentences."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from calibrate.objective import Problem
from calibrate.profile import Profile
from calibrate.result import FittedParameter
from calibrate.uncertainty import Uncertainty

Array = NDArray[np.float64]
#: Closeness to a bound that counts as reached, as a share of the range.
AT_BOUND = 1e-3
#: Correlation from which on two numbers are called hard to separate.
ENTANGLED = 0.95
#: Share of a coordinate in a blind direction from which on it is named.
_NAMED = 0.05

MODEL_ERROR = (
    "Standard errors and intervals follow from the residual; errors of the model that bend the fit without showing in "
    "the residual are not inside: compare topologies to see those."
)


def sentences(
    problem: Problem, unit: Array, parameters: Sequence[FittedParameter], known: Uncertainty
) -> Iterator[str]:
    """What to know about the numbers of a fit."""
    yield from _bounds_reached(problem, unit)
    yield from _blind_directions(problem, known)
    for parameter in parameters:
        if not parameter.identified:
            yield _not_identified(parameter)
    yield from _entangled(problem, known, parameters)
    yield from (sentence for error in known.errors if (sentence := error.sentence()))
    yield MODEL_ERROR


def _bounds_reached(problem: Problem, unit: Array) -> Iterator[str]:
    for place, coordinate in zip(unit, problem.space.coordinates, strict=True):
        if not AT_BOUND < place < 1.0 - AT_BOUND:
            side = "lower" if place <= AT_BOUND else "upper"
            bound = coordinate.show(coordinate.lower if side == "lower" else coordinate.upper)
            yield f"{coordinate.name} ended at its {side} bound ({bound}): the true optimum may lie beyond it."


def _not_identified(parameter: FittedParameter) -> str:
    share = 100.0 * parameter.standard_error / abs(parameter.value) if parameter.value else np.inf
    if np.isnan(share):
        why = "there are too few samples for a standard error"
    else:
        why = f"its standard error is {share:.0f} %" if np.isfinite(share) else "they leave it free"
    return f"{parameter.name} is not identified by these records: {why}."


def _blind_directions(problem: Problem, known: Uncertainty) -> Iterator[str]:
    names = np.array(problem.space.names)
    for direction in known.blind:
        mine = names[np.abs(direction) > _NAMED]
        if len(mine) == 1:
            yield f"{mine[0]} does not show in these records at all: its value is a guess."
        elif len(mine):
            yield f"These records cannot separate {_listed(mine)}: only a combination of them shows."


def _entangled(problem: Problem, known: Uncertainty, parameters: Sequence[FittedParameter]) -> Iterator[str]:
    names, seen = problem.space.names, np.isfinite(known.standard_errors)
    pinned = {p.name for p in parameters if p.identified} | set(names[problem.parameters :])
    close = (np.abs(known.correlation) >= ENTANGLED) & np.outer(seen, seen)
    for group in _groups(close):
        mine = [names[i] for i in group]
        sizes = np.abs(known.correlation[np.ix_(group, group)])[np.triu_indices(len(group), 1)]
        value = known.correlation[group[0], group[1]] if len(group) == 2 else sizes.max()
        pair = f"{_listed(mine)} (correlation {'' if len(group) == 2 else 'up to '}{value:.3f})"
        if set(mine) <= pinned:
            yield f"These records hardly separate {pair}, though each has a small standard error."
        else:
            yield f"These records cannot separate {pair}."


def _groups(close: NDArray[np.bool_]) -> list[list[int]]:
    """Sets of two and more that hang together, from a symmetric relation (n, n)."""
    from scipy.sparse.csgraph import connected_components

    count, labels = connected_components(close, directed=False)
    groups = [np.flatnonzero(labels == label).tolist() for label in range(count)]
    return [group for group in groups if len(group) > 1]


def _listed(names: Sequence[str]) -> str:
    return f"{', '.join(names[:-1])} from {names[-1]}"


def profile_sentences(profiles: Sequence[Profile], parameters: Sequence[FittedParameter]) -> Iterator[str]:
    """Where the profile likelihood says other things than the standard error."""
    # No profiles at all where they were not asked for.
    for profile, parameter in zip(profiles, parameters, strict=False):
        if profile.open_sides:
            sides = " and ".join(profile.open_sides)
            yield (
                f"The profile of {profile.name} is open towards its {sides} bound: "
                "the records allow every value up to there."
            )
            continue
        low, high = (abs(end - parameter.value) for end in profile.interval)
        if max(low, high) > 1.5 * min(low, high):
            yield (
                f"The profile of {profile.name} is lopsided: trust its interval "
                f"({profile.interval[0]:.4g} to {profile.interval[1]:.4g} {profile.unit}), not the standard error."
            )
