"""Experiments that would tell more, found by computing what each would add.

At the optimum the information of a record about the parameters is J^T S^-1 J with the derivative J of what its
sensors show and the size S of their errors.  A record that is not there yet has a J as well: the model
computes it.  Added to the information that there is, it says what the standard errors would become.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from calibrate.identify import ENTANGLED
from calibrate.objective import Problem
from calibrate.result import Advice
from calibrate.spec import FORCE_ENTRIES
from calibrate.targets import Target, record_of
from calibrate.uncertainty import Errors, Uncertainty
from lab.experiments import RingDown, StaticStiffness
from lab.records import Record
from lab.specimens import Specimen, TwistedBeam

Array = NDArray[np.float64]
#: Relative standard error below which nothing needs to be told better, and the improvement worth naming.
_WELL_KNOWN, _WORTH_IT = 0.02, 1.5
#: Preference for a load off the axis: it twists the beam outright, where a large oblique deflection does so at
#: second order only, which models get wrong first.
_OUTRIGHT = 1.3
#: Candidates: directions of release, a mass at the tip, how far the weight hangs off the axis where the
#: specimen has no width, and the accuracy taken for a static test, as a share of its largest entry.
_DIRECTIONS = {"along y": 0.0, "along z": math.pi / 2, "along the diagonal of y and z": math.pi / 4}
_TIP_MASS, _ARM, _STATIC_ERROR = 0.010, 0.010, 0.05
#: Standard errors above this count as no knowledge at all.
_NOTHING = 1e3


@dataclass(frozen=True)
class _Candidate:
    words: str
    change: Mapping[str, Any]
    target: Target
    error: Errors


def advise(problem: Problem, unit: Array, known: Uncertainty) -> tuple[Advice, ...]:
    """Experiments that would make the largest relative standard error much smaller, the best one of each sort.

    Nothing is said where every parameter is known well and apart from the others.
    """
    p = problem.parameters
    names, sizes = problem.space.names[:p], problem.space.sizes(unit)
    before = known.standard_errors[:p] / sizes[:p]
    pairs = known.correlation[:p, :p][np.triu_indices(p, 1)]
    well_known = np.all(before <= _WELL_KNOWN) and np.all(np.abs(pairs) < ENTANGLED)
    if well_known or not all(math.isfinite(error.size) for error in known.errors):
        return ()
    there = information(problem, unit, known.errors)
    found = []
    for candidate in _simulated(problem, unit, known):
        added = _added(problem, unit, candidate)
        if added is None:
            continue
        after = errors_of_information(there + added) * problem.space.slope(unit)[:p] / sizes[:p]
        found.append(_advice(candidate, names, before, after))
    found.sort(key=lambda advice: _score(advice.after) / (_OUTRIGHT if "load_place" in advice.change else 1.0))
    sorts: dict[Any, Advice] = {}
    for advice in filter(_helps, found):
        sorts.setdefault("load_place" if "load_place" in advice.change else tuple(advice.change), advice)
    return tuple(sorts.values())


def _helps(advice: Advice) -> bool:
    """Whether the worst parameter gains enough, and ends with a standard error that means something."""
    before, after = advice.before[advice.worst], advice.after[advice.worst]
    return after < 1.0 and not after * _WORTH_IT > before


def information(problem: Problem, unit: Array, errors: Sequence[Errors]) -> Array:
    """Information about the parameters in coordinates of the unit cube, (p, p), nuisances taken out."""
    total = np.zeros((len(unit), len(unit)))
    for block, error, part in zip(problem.blocks, errors, problem.split(problem.derivative(unit)), strict=True):
        factor = float(np.mean(block.factor)) if block.timed else block.share
        size = max(error.size, 1e-12 * (1.0 if not block.timed else float(np.abs(block.reference).max())))
        total += part.T @ part / (factor * size) ** 2 / error.stretch
    p = problem.parameters
    mine, cross, others = total[:p, :p], total[:p, p:], total[p:, p:]
    return np.asarray(mine - cross @ np.linalg.pinv(others, hermitian=True) @ cross.T)


def errors_of_information(matrix: Array) -> Array:
    """Standard errors (p,) of parameters with the information (p, p); infinite where there is none."""
    size = np.sqrt(np.maximum(np.diag(matrix), 0.0))
    safe = np.where(size > 0.0, size, 1.0)
    values, directions = np.linalg.eigh(matrix / np.outer(safe, safe))
    seen = values > 1e-12 * max(float(values[-1]), 1e-300)
    covariance = (directions[:, seen] / values[seen]) @ directions[:, seen].T
    blind = (np.abs(directions[:, ~seen]) > 1e-5).any(axis=1) | (size == 0.0)
    return np.where(blind, np.inf, np.sqrt(np.maximum(np.diag(covariance), 0.0)) / safe)


def _score(errors: Mapping[str, float]) -> float:
    """Largest relative standard error, with ties among those that are unknown broken by the others."""
    values = sorted((min(e, _NOTHING) if not math.isnan(e) else _NOTHING for e in errors.values()), reverse=True)
    return float(sum(value * 1e-3**rank for rank, value in enumerate(values)))


def _advice(candidate: _Candidate, names: Sequence[str], before: Array, after: Array) -> Advice:
    worst = int(np.argmax(np.nan_to_num(before, nan=_NOTHING, posinf=_NOTHING)))
    sentence = (
        f"{candidate.words} would bring the standard error of {names[worst]} "
        f"from {_percent(before[worst])} to {_percent(after[worst])}."
    )
    now, then = (dict(zip(names, values.tolist(), strict=True)) for values in (before, after))
    return Advice(candidate.words, candidate.change, names[worst], now, then, sentence)


def _percent(share: float) -> str:
    return f"{100.0 * share:.2g} %" if share < 10.0 else "no knowledge"


def _simulated(problem: Problem, unit: Array, known: Uncertainty) -> Iterator[_Candidate]:
    """Candidates with the record that the fitted model makes of each."""
    drafts = list(_drafts(problem, known))
    values = dict(zip(problem.free, problem.space.values(unit)[: problem.parameters].tolist(), strict=True))
    requests = [
        problem.performer.request(d.target.specimen, d.target.experiment, {**problem.fixed, **values}) for d in drafts
    ]
    for draft, response in zip(drafts, problem.performer.run(requests), strict=True):
        if response is not None:
            record = record_of(draft.target, dict(response))
            yield replace(draft, target=replace(draft.target, record=record))


def _drafts(problem: Problem, known: Uncertainty) -> Iterator[_Candidate]:
    errors = {problem.blocks[i].target: error for i, error in reversed(list(enumerate(known.errors)))}
    releases = [(i, t) for i, t in enumerate(problem.targets) if isinstance(t.experiment, RingDown)]
    if releases:
        number, like = releases[0]
        yield from _releases(like, [t for _, t in releases], errors[number])
    if not any(isinstance(t.experiment, StaticStiffness) for t in problem.targets):
        first = problem.targets[0]
        error = Errors("static test", _STATIC_ERROR, np.eye(1), 1.0, None, float(len(FORCE_ENTRIES)))
        static = _bare(first, first.specimen, StaticStiffness(increments=2), FORCE_ENTRIES)
        yield _Candidate(
            f"A static stiffness test ({_STATIC_ERROR:.0%} accuracy)", {"kind": "StaticStiffness"}, static, error
        )


def _releases(like: Target, there: Sequence[Target], error: Errors) -> Iterator[_Candidate]:
    experiment = like.experiment
    assert isinstance(experiment, RingDown)
    taken = [t.experiment.direction for t in there if isinstance(t.experiment, RingDown)]
    axial = all(not any(t.experiment.load_place) for t in there if isinstance(t.experiment, RingDown))
    arm = _edge(like.specimen)
    for words, direction in _DIRECTIONS.items():
        change: dict[str, Any] = {"direction": direction}
        # A release and the opposite one say about the same.
        if all(abs(math.sin(direction - other)) > 0.17 for other in taken):
            turned = experiment.model_copy(update=change)
            yield _Candidate(f"A release {words}", change, _bare(like, like.specimen, turned), error)
        # Only the part of the arm that is across the load twists the beam.
        if axial and abs(arm[1] * math.sin(direction) - arm[2] * math.cos(direction)) > 0.3 * math.hypot(*arm):
            change = {**change, "load_place": arm}
            off = experiment.model_copy(update=change)
            place = f"y = {1e3 * arm[1]:.3g} mm, z = {1e3 * arm[2]:.3g} mm"
            yield _Candidate(
                f"An off-axis release {words} (load at {place})", change, _bare(like, like.specimen, off), error
            )
    if isinstance(like.specimen, TwistedBeam):
        mass = like.specimen.tip_mass + _TIP_MASS
        heavy = like.specimen.model_copy(update={"tip_mass": mass})
        words = f"The same release with a tip mass of {1e3 * mass:.3g} g"
        yield _Candidate(words, {"tip_mass": mass}, _bare(like, heavy, experiment), error)


def _edge(specimen: Specimen) -> tuple[float, float, float]:
    """A place on the tip face away from the axis, m: the end of its width where it has one."""
    if hasattr(specimen, "section_angle") and hasattr(specimen, "width"):
        angle, half = float(specimen.section_angle(specimen.length)), specimen.width / 2.0
        return (0.0, round(half * math.cos(angle), 9), round(half * math.sin(angle), 9))
    return (0.0, _ARM, 0.0)


def _bare(like: Target, specimen: Specimen, experiment: Any, quantities: tuple[str, ...] | None = None) -> Target:
    """A target whose record is still to be simulated, with sensors like those of ``like``."""
    record = Record("prb", "model", {}, {})
    nuisances = (
        {} if quantities else {name: replace(c, name=f"candidate: {name}") for name, c in like.nuisances.items()}
    )
    return Target("candidate", specimen, experiment, record, quantities or like.quantities, nuisances=nuisances)


def _added(problem: Problem, unit: Array, candidate: _Candidate) -> Array | None:
    """Information of a candidate's record about the parameters, (p, p); None where it cannot be computed."""
    bounds = {c.name: (c.lower, c.upper) for c in problem.space.coordinates[: problem.parameters]}
    try:
        alone = Problem(problem.performer, [candidate.target], "relative", bounds, problem.fixed)
    except ValueError:
        return None
    point = np.concatenate([unit[: problem.parameters], alone.start()[problem.parameters :]])
    return information(alone, point, [candidate.error] * len(alone.blocks))
