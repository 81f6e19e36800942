"""A fit from its specification to its result."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from calibrate.advice import advise
from calibrate.bootstrap import bootstrap
from calibrate.identify import profile_sentences, sentences
from calibrate.objective import UNITS, Objective, Problem
from calibrate.performers import Performer, performer_of
from calibrate.profile import Profile, profile
from calibrate.result import Advice, FitResult, FittedParameter, TargetResult, Use
from calibrate.search import Found, find
from calibrate.spec import Fit, Search
from calibrate.targets import Target, target
from calibrate.uncertainty import Uncertainty, leaves_trace, uncertainty
from fea.model import FeaModel
from lab.measures import TRACKING_ERROR_DEFINITION, tracking_error, tracking_rms
from prb.model import PrbModel

__all__ = ["Fitted", "fit", "fit_performer", "optimum", "score", "target"]

Array = NDArray[np.float64]
#: Candidates among which the nuisances of a held-out record are looked for.
_HELD_OUT_SEARCH = Search(method="least-squares", starts=12, polished=2)


@dataclass(frozen=True)
class Fitted:
    """An optimum with what follows from it.

    Parameters
    ----------
    problem
        With its coordinates: parameters, then nuisances.
    found
        The optimum.
    derivative
        Of the residual there, (N, n).
    known
        Its uncertainty.
    """

    problem: Problem
    found: Found
    derivative: Array
    known: Uncertainty

    def values(self) -> dict[str, float]:
        """Every coordinate by name, SI."""
        values = self.problem.space.values(self.found.unit) if len(self.problem.space) else np.empty(0)
        return dict(zip(self.problem.space.names, values.tolist(), strict=True))


def fit(
    spec: Fit, model: PrbModel | FeaModel, used: Sequence[Target], held_out: Sequence[Target] = (), threads: int = 1
) -> FitResult:
    """Fit free numbers of ``model`` to all ``used`` targets jointly, and score it on all targets.

    Numbers that are not free keep the model's values.  The same seed gives the same result.

    Parameters
    ----------
    threads
        Threads (processes for FEA) that share the runs; they do not change the result.

    Raises
    ------
    ValueError
        In one line, for targets, free numbers or bounds that do not fit the model.
    """
    return fit_performer(spec, performer_of(model, threads), used, held_out)


def fit_performer(
    spec: Fit, performer: Performer, used: Sequence[Target], held_out: Sequence[Target] = ()
) -> FitResult:
    """``fit`` for anything that performs."""
    begin = perf_counter()
    fitted = optimum(Problem(performer, used, spec.objective, spec.free), spec.search)
    problem, known = fitted.problem, fitted.known
    numbers = list(_numbers(fitted))
    parameters, nuisances = numbers[: problem.parameters], numbers[problem.parameters :]
    values = {p.name: p.value for p in parameters}
    shared = {n.name: n.value for n in nuisances}
    targets = [*in_sample(fitted), *(score(performer, t, values, shared) for t in held_out)]
    profiles, again, advice = _further(fitted, spec)
    notes = (
        *_search_notes(fitted, spec),
        *sentences(problem, fitted.found.unit, parameters, known),
        *profile_sentences(profiles, parameters),
        *(a.sentence for a in advice),
        TRACKING_ERROR_DEFINITION,
    )
    p = problem.parameters
    return FitResult(
        kind=spec.kind,
        parameters=tuple(parameters),
        correlation=tuple(map(tuple, known.correlation[:p, :p].tolist())),
        objective=fitted.found.objective,
        objective_unit=UNITS[spec.objective],
        tracking_error=_joint_tracking_error(fitted),
        condition=known.condition,
        history=fitted.found.history,
        evaluations=problem.evaluations,
        seed=spec.search.seed,
        wall_time_s=perf_counter() - begin,
        used=tuple(t.name for t in used),
        notes=notes,
        targets=tuple(targets),
        nuisances=tuple(nuisances),
        profiles=profiles,
        bootstrap=again,
        advice=advice,
    )


def optimum(problem: Problem, search: Search) -> Fitted:
    """Optimum of a problem and its uncertainty."""
    found = find(problem, search)
    derivative = problem.derivative(found.unit)
    if len(problem.space) and not leaves_trace(derivative).all():
        # Any value would do: the nominal one is a better guess than where the search happened to stop.
        unit = np.where(leaves_trace(derivative), found.unit, problem.start())
        residual = problem.residuals(unit[None])[0]
        if np.linalg.norm(residual) <= (1.0 + 1e-6) * found.objective:
            found, derivative = replace(found, unit=unit, residual=residual), problem.derivative(unit)
    return Fitted(problem, found, derivative, uncertainty(problem, found.unit, found.residual, derivative))


def _further(fitted: Fitted, spec: Fit) -> tuple[tuple[Profile, ...], Any, tuple[Advice, ...]]:
    """Profiles, bootstrap and advice, as far as the specification asks for them."""
    problem, unit, derivative, known = fitted.problem, fitted.found.unit, fitted.derivative, fitted.known
    profiles: tuple[Profile, ...] = ()
    if spec.profile:
        residual = fitted.found.residual
        every = range(problem.parameters)
        profiles = tuple(profile(problem, unit, residual, derivative, known, which) for which in every)
    again = bootstrap(problem, unit, derivative, known, spec.bootstrap, spec.search.seed) if spec.bootstrap else None
    advice = advise(problem, unit, known) if spec.advice and problem.performer.cheap else ()
    return profiles, again, advice


def _numbers(fitted: Fitted) -> Iterator[FittedParameter]:
    known = fitted.known
    for i, (coordinate, value) in enumerate(
        zip(fitted.problem.space.coordinates, fitted.values().values(), strict=True)
    ):
        low, high = known.intervals[i].tolist()
        yield FittedParameter(
            coordinate.name, coordinate.unit, coordinate.lower, coordinate.upper, value,
            float(known.standard_errors[i]), (low, high),
        )  # fmt: skip


def _search_notes(fitted: Fitted, spec: Fit) -> Iterator[str]:
    if fitted.found.agreed:
        return
    if spec.search.method == "least-squares":
        yield "Only one of the polished starts ended at the best optimum: more starts may find a better one."
    else:
        yield f"The global search used all its {spec.search.generations} generations before its candidates agreed."


def in_sample(fitted: Fitted) -> list[TargetResult]:
    """How the optimum follows the targets of its problem."""
    problem = fitted.problem
    predictions = [part[0] for part in problem.predictions(fitted.found.unit[None])]
    values = fitted.values()
    return [_scored(problem, i, predictions, values, "in sample") for i in range(len(problem.targets))]


def score(
    performer: Performer, held_out: Target, values: Mapping[str, float], nuisances: Mapping[str, float] | None = None
) -> TargetResult:
    """How a model with the given numbers (SI) follows a record that it has not seen.

    Sensor nuisances of the record itself are fitted to it, since they are no property of the model.

    Parameters
    ----------
    nuisances
        Those that the fit has found; the record keeps what it shares with the used ones.
    """
    known = nuisances or {}
    objective: Objective = "rms" if held_out.quantities == ("markers",) else "relative"
    held = {c.name: known[c.name] for c in held_out.searched.values() if c.name in known}
    problem = Problem(performer, [held_out], objective, {}, values, held)
    try:
        found = find(problem, _HELD_OUT_SEARCH)
    except ValueError:
        return TargetResult(
            held_out.name, "held out", float("nan"), float("nan"), note="the model could not perform it"
        )
    space = problem.space.values(found.unit) if len(problem.space) else np.empty(0)
    numbers = {**held, **dict(zip(problem.space.names, space.tolist(), strict=True))}
    predictions = [part[0] for part in problem.predictions(found.unit[None])]
    result = _scored(problem, 0, predictions, numbers, "held out")
    refitted = [name for name, c in held_out.nuisances.items() if c.name not in held]
    if not refitted:
        return result
    names = ", ".join(refitted)
    return replace(result, note=f"{names} of this record fitted to it, nothing else.")


def _scored(
    problem: Problem, number: int, predictions: Sequence[Array], values: Mapping[str, float], use: Use
) -> TargetResult:
    this = problem.targets[number]
    nuisances: dict[str, Any] = {name: values[c.name] for name, c in this.searched.items()}
    errors, rms, entries = [], float("nan"), {}
    for block, prediction in zip(problem.blocks, predictions, strict=True):
        if block.target != number:
            continue
        difference, offset = block.difference(prediction)
        if not block.timed:
            misfits = (difference / block.scale)[:, 0]
            entries = dict(zip(this.scalars(), misfits.tolist(), strict=True))
            errors.append(float(np.sqrt(np.mean(misfits**2))))
            continue
        # What the sensors did is taken out of both sides: the error is one of displacements from rest.
        gain = nuisances.get("gain", 1.0)
        truth, model = (block.reference - offset) / gain, prediction / gain
        errors.append(tracking_error(model, truth))
        if block.quantity == "markers":
            rms = tracking_rms(model.reshape(len(model), -1, 3), truth.reshape(len(truth), -1, 3))
            if block.offset is not None:
                nuisances["offset"] = offset.reshape(-1, 3).tolist()
    return TargetResult(this.name, use, float(np.sqrt(np.mean(np.square(errors)))), rms, entries, nuisances)


def _joint_tracking_error(fitted: Fitted) -> float:
    """Tracking error over the markers of all used records; NaN without markers."""
    problem, values = fitted.problem, fitted.values()
    predictions = problem.predictions(fitted.found.unit[None])
    models, truths = [], []
    for block, (prediction,) in zip(problem.blocks, predictions, strict=True):
        if block.quantity == "markers":
            _, offset = block.difference(prediction)
            searched = problem.targets[block.target].searched
            gain = values[searched["gain"].name] if "gain" in searched else 1.0
            models.append(prediction.ravel() / gain)
            truths.append((block.reference - offset).ravel() / gain)
    return tracking_error(np.concatenate(models), np.concatenate(truths)) if models else float("nan")
