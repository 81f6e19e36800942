"""Quantities that several fitted models share: the interval of each, and the spread over the models."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from calibrate.at_rest import quantities_at_rest
from calibrate.performers import Performer
from calibrate.spec import Fit
from calibrate.targets import Target, record_of
from fea.model import FeaModel
from lab.records import Scalar
from lab.specimens import Specimen
from prb.model import PrbModel

Array = NDArray[np.float64]
#: Half width of a 95 % interval in standard errors, and the step of differences in those.
_NORMAL, _STEP = 1.96, 0.1


@dataclass(frozen=True)
class Candidate:
    """A finished fit.

    Parameters
    ----------
    name, model, spec
        Of the fit, the model before it, and its specification.
    result
        ``FitResult.to_json()``, or the same read from a file.
    """

    name: str
    model: PrbModel | FeaModel
    spec: Fit
    result: Mapping[str, Any]

    def values(self) -> dict[str, float]:
        """Fitted values by name, SI."""
        return {p["name"]: float(p["value"]) for p in self.result["parameters"]}

    def errors(self) -> Array:
        """Standard errors (p,), SI; infinite where the fit has none."""
        given = [p["standard_error"] for p in self.result["parameters"]]
        return np.array([math.inf if error is None else float(error) for error in given])


@dataclass(frozen=True)
class Spread:
    """A quantity as the candidates have it.

    Parameters
    ----------
    values, half_widths
        By candidate: value, and half the width of its 95 % interval (delta method), SI.
    spread, spread_of_all
        Half the distance between the extreme values of the credible candidates, SI, NaN for fewer than two; and
        of all of them.
    """

    name: str
    unit: str
    long_name: str
    values: Mapping[str, float]
    half_widths: Mapping[str, float]
    spread: float
    spread_of_all: float

    def sentence(self) -> str:
        """What the spread says about the intervals; empty where it says nothing."""
        widths = [w for w in self.half_widths.values() if math.isfinite(w)]
        if not widths or not self.spread > 2.0 * float(np.median(widths)):
            return ""
        ratio = self.spread / max(float(np.median(widths)), 1e-300)
        times = f"{ratio:.0f} times" if ratio < 1e3 else "far"
        return (
            f"{self.name}: the choice of the model moves it by +-{self.spread:.3g} {self.unit}, "
            f"{times} more than the intervals of the fits admit."
        )


def spreads_of(
    candidates: Sequence[Candidate],
    performers: Sequence[Performer],
    specimen: Specimen,
    held_out: Sequence[Target],
    credible: set[str],
) -> list[Spread]:
    """Quantities that all candidates have: at rest, and what they predict for the held-out records."""
    tables = [
        _with_widths(candidate, performer, specimen, held_out)
        for candidate, performer in zip(candidates, performers, strict=True)
    ]
    names = [name for name in tables[0] if all(name in table for table in tables)]
    spreads = []
    for name in names:
        first = tables[0][name][0]
        values = {c.name: table[name][0].value for c, table in zip(candidates, tables, strict=True)}
        widths = {c.name: table[name][1] for c, table in zip(candidates, tables, strict=True)}
        halves = [_half_range([v for k, v in values.items() if k in group]) for group in (credible, set(values))]
        spreads.append(Spread(name, first.unit, first.long_name, values, widths, *halves))
    return spreads


def _half_range(values: Sequence[float]) -> float:
    return (max(values) - min(values)) / 2.0 if len(values) > 1 else float("nan")


def _with_widths(
    candidate: Candidate, performer: Performer, specimen: Specimen, held_out: Sequence[Target]
) -> dict[str, tuple[Scalar, float]]:
    """Every quantity of a candidate and half its 95 % interval by the delta method."""
    values, errors = candidate.values(), candidate.errors()
    ranges = np.array([p["upper"] - p["lower"] for p in candidate.result["parameters"]], dtype=float)
    steps = np.where(np.isfinite(errors), np.minimum(_STEP * errors, 0.01 * ranges), 0.01 * ranges)
    points = [values]
    for name, step, parameter in zip(values, steps, candidate.result["parameters"], strict=True):
        ends = np.clip(values[name] + np.array([step, -step]), float(parameter["lower"]), float(parameter["upper"]))
        points += [{**values, name: float(end)} for end in ends]
    tables = [_quantities(candidate.model, performer, specimen, held_out, point) for point in points]
    correlation = np.array(candidate.result["correlation"], dtype=float)
    found = {}
    for quantity, scalar in tables[0].items():
        column = np.array([table[quantity].value if quantity in table else np.nan for table in tables])
        widths = np.array([points[2 * i + 1][n] - points[2 * i + 2][n] for i, n in enumerate(values)])
        gradient = (column[1::2] - column[2::2]) / np.where(widths > 0.0, widths, np.inf)
        found[quantity] = (scalar, _NORMAL * _spread_of(gradient, errors, ranges, correlation, scalar.value))
    return found


def _spread_of(gradient: Array, errors: Array, ranges: Array, correlation: Array, value: float) -> float:
    """Standard error of a quantity; infinite where a parameter that is not known matters to it."""
    unknown = ~np.isfinite(errors)
    if np.any(np.abs(gradient[unknown]) * ranges[unknown] > 1e-3 * abs(value)):
        return float("inf")
    moved = np.where(unknown, 0.0, gradient * np.where(unknown, 0.0, errors))
    return float(np.sqrt(max(float(moved @ correlation @ moved), 0.0)))


def _quantities(
    model: PrbModel | FeaModel,
    performer: Performer,
    specimen: Specimen,
    held_out: Sequence[Target],
    values: Mapping[str, float],
) -> dict[str, Scalar]:
    found: dict[str, Scalar] = {}
    if isinstance(model, PrbModel):
        found |= quantities_at_rest(model, specimen, {**model.values(specimen), **values})
    requests = [performer.request(t.specimen, t.experiment, values) for t in held_out]
    for target, response in zip(held_out, performer.run(requests), strict=True):
        if response is None:
            continue
        reduced = target.experiment.reduce(record_of(target, response))
        found |= {f"{target.name}: {name}": s for name, s in reduced.items() if math.isfinite(s.value)}
    return found
