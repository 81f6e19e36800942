"""Fits at every design of a sweep, the parametric model learned from them, and how well it predicts."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from time import perf_counter
from typing import Any

import numpy as np

from calibrate.fitting import Fitted, in_sample, optimum, score
from calibrate.objective import Problem
from calibrate.parametric import Curve, ParametricModel, design_of, learn
from calibrate.performers import Performer, performer_of
from calibrate.result import IDENTIFIED, TargetResult, plain
from calibrate.search import Found, polish
from calibrate.spec import ParametricFit
from calibrate.targets import Target
from calibrate.uncertainty import uncertainty
from lab.measures import TRACKING_ERROR_DEFINITION
from lab.specimens import Specimen
from prb.model import PrbModel

#: An optimum next to that of the neighbouring design is taken unless another is better by more than this share.
_NEIGHBOURLY = 0.01


@dataclass(frozen=True)
class DesignScore:
    """A design whose records, or whose fit, the model was not given.

    Parameters
    ----------
    design
        SI.
    parameters
        Predicted over fitted value less one; without those that the design's own records do not pin down.
    error, own_error
        Tracking error of the predicted model on the design's records, and of the design's own fit.
    inside
        Whether the design lies among the others.
    """

    design: Mapping[str, float]
    parameters: Mapping[str, float]
    error: float
    own_error: float
    inside: bool


@dataclass(frozen=True)
class ParametricResult:
    """A parametric model with its scores, as plain data.

    Parameters
    ----------
    left_out
        Every design, predicted from all others.
    targets
        Records of further designs that were held out.
    """

    model: ParametricModel
    left_out: tuple[DesignScore, ...]
    targets: tuple[TargetResult, ...]
    evaluations: int
    seed: int
    wall_time_s: float
    used: tuple[str, ...]
    notes: tuple[str, ...]
    kind: str = "parametric"
    fits: tuple[Mapping[str, Any], ...] = field(default=())

    def to_json(self) -> dict[str, Any]:
        """Plain JSON data; null stands for NaN and infinity."""
        rest = {key: value for key, value in vars(self).items() if key != "model"}
        lists = {
            "left_out": [asdict(s) for s in self.left_out],
            "targets": [asdict(t) for t in self.targets],
        }
        return plain({**rest, **lists, "model": self.model.to_json(), "parameters": []})


def fit_parametric(
    spec: ParametricFit, model: PrbModel, used: Sequence[Target], held_out: Sequence[Target] = (), threads: int = 1
) -> ParametricResult:
    """Fit the free parameters at every design among ``used`` and learn them as functions of the design.

    Raises
    ------
    ValueError
        In one line, for designs or parameters that do not fit.
    """
    return learn_from(spec, performer_of(model, threads), model.topology.name, used, held_out)


def learn_from(
    spec: ParametricFit, performer: Performer, topology: str, used: Sequence[Target], held_out: Sequence[Target] = ()
) -> ParametricResult:
    """``fit_parametric`` for anything that performs."""
    begin = perf_counter()
    groups = _by_design(used, spec.design)
    specimens = [group[0].specimen for group in groups]
    fitted = _fits(spec, performer, groups)
    curves = [_curve(spec, fitted, number, name) for number, name in enumerate(spec.free)]
    found = learn(topology, spec.design, specimens, curves)
    left_out = tuple(_left_out(performer, found, i, group, fitted[i]) for i, group in enumerate(groups))
    targets = []
    for target in held_out:
        prediction = found.predict(target.specimen)
        scored = score(performer, target, dict(prediction.values))
        note = "; ".join(part for part in (scored.note, *prediction.warnings) if part)
        targets.append(TargetResult(**{**vars(scored), "note": note}))
    return ParametricResult(
        found, left_out, tuple(targets), sum(f.problem.evaluations for f in fitted), spec.search.seed,
        perf_counter() - begin, tuple(t.name for t in used), tuple(_notes(found, left_out, specimens)),
        fits=tuple(_summary(specimen, spec, one) for specimen, one in zip(specimens, fitted, strict=True)),
    )  # fmt: skip


def _by_design(used: Sequence[Target], design: Sequence[str]) -> list[list[Target]]:
    """Targets of each design, in the order of the designs."""
    groups: dict[tuple[float, ...], list[Target]] = {}
    for target in used:
        groups.setdefault(design_of(target.specimen, design), []).append(target)
    return [groups[point] for point in sorted(groups)]


def _fits(spec: ParametricFit, performer: Performer, groups: Sequence[Sequence[Target]]) -> list[Fitted]:
    """A fit of each design; where two optima are as good, that which continues the one before."""
    fits: list[Fitted] = []
    for group in groups:
        one = optimum(Problem(performer, group, spec.objective, spec.free), spec.search)
        if fits:
            one = _neighbourly(one, fits[-1])
        fits.append(one)
    return fits


def _neighbourly(one: Fitted, before: Fitted) -> Fitted:
    problem = one.problem
    p = problem.parameters
    start = one.found.unit.copy()
    start[:p] = problem.space.place(_padded(before, len(problem.space)))[:p]
    first = problem.residuals(start[None])[0]
    if not np.isfinite(first).all():
        return one
    unit, residual = polish(problem, start, first)
    if np.linalg.norm(residual) > (1.0 + _NEIGHBOURLY) * one.found.objective:
        return one
    found = Found(unit, residual, one.found.history, one.found.agreed)
    derivative = problem.derivative(unit)
    return Fitted(problem, found, derivative, uncertainty(problem, unit, residual, derivative))


def _padded(fitted: Fitted, count: int) -> np.ndarray:
    """Values of a fit's parameters, with anything for the nuisances of another."""
    values = np.zeros(count)
    values[: fitted.problem.parameters] = list(fitted.values().values())[: fitted.problem.parameters]
    return values


def _curve(spec: ParametricFit, fitted: Sequence[Fitted], number: int, name: str) -> Curve:
    values = [fit.values()[name] for fit in fitted]
    errors = [float(fit.known.standard_errors[number]) for fit in fitted]
    coordinates = [fit.problem.space.coordinates[number] for fit in fitted]
    known = tuple(bool(e <= IDENTIFIED * abs(v)) for v, e in zip(values, errors, strict=True))
    low, high = min(c.lower for c in coordinates), max(c.upper for c in coordinates)
    return Curve(name, coordinates[0].unit, tuple(values), tuple(errors), known, low, high, spec.symmetry.get(name))


def _left_out(
    performer: Performer, model: ParametricModel, number: int, group: Sequence[Target], own: Fitted
) -> DesignScore:
    specimen, fewer = group[0].specimen, model.without(number)
    predicted = dict(fewer.predict(specimen).values)
    off = {
        curve.name: predicted[curve.name] / curve.values[number] - 1.0
        for curve in model.curves
        if curve.known[number] and curve.values[number]
    }
    errors = [score(performer, target, predicted).error for target in group]
    owned = [result.error for result in in_sample(own)]
    design = dict(zip(model.design, model.points[number], strict=True))
    return DesignScore(design, off, _pooled(errors), _pooled(owned), fewer.is_inside(specimen))


def _pooled(errors: Sequence[float]) -> float:
    return float(np.sqrt(np.mean(np.square(errors))))


def _summary(specimen: Specimen, spec: ParametricFit, fitted: Fitted) -> dict[str, Any]:
    values = fitted.values()
    errors = dict(zip(fitted.problem.space.names, fitted.known.standard_errors.tolist(), strict=True))
    return {
        "design": dict(zip(spec.design, design_of(specimen, spec.design), strict=True)),
        "values": {name: values[name] for name in spec.free},
        "standard_errors": {name: errors[name] for name in spec.free},
        "objective": fitted.found.objective,
    }


def _notes(model: ParametricModel, left_out: Sequence[DesignScore], specimens: Sequence[Specimen]) -> list[str]:
    notes = []
    for curve in model.curves:
        missing = [i for i, known in enumerate(curve.known) if not known]
        if missing:
            places = ", ".join(", ".join(f"{v:.4g}" for v in model.points[i]) for i in missing)
            notes.append(
                f"{curve.name} is not identified at {len(missing)} of {len(curve.known)} designs "
                f"({', '.join(model.design)} = {places}, SI): left out there."
            )
    inner = [s for s in left_out if s.inside and np.isfinite(s.error)]
    if inner:
        mean, own = _pooled([s.error for s in inner]), _pooled([s.own_error for s in inner])
        notes.append(
            f"Designs left out, predicted from the others: tracking error {mean:.2%} over the {len(inner)} that lie "
            f"among them; their own fits have {own:.2%}."
        )
    return [*notes, TRACKING_ERROR_DEFINITION]
