"""Fit of kind ``parametric``: a model's parameters as functions of the design."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from calibrate.parametric_fit import ParametricResult, fit_parametric
from calibrate.spec import ParametricFit
from lab.fields import number_at, with_numbers
from lab.fields import shown as field_shown
from lab.records import Record
from lab.specimens import Specimen
from pipeline.plan import Plan
from pipeline.stages.fit import model_of, targets_of
from pipeline.study import PrbPerformer
from results.tables import shown

#: Places at which curves are sampled for figures.
_PLACES = 61


def parametric(plan: Plan, name: str, records: Mapping[str, Record], threads: int) -> dict[str, Any]:
    """Curves of the parameters, with their scores on designs left out."""
    spec, model = plan.study.fits[name], model_of(plan, name)
    assert isinstance(spec, ParametricFit)
    if not isinstance(model, PrbPerformer):
        raise ValueError(f"fit {name}: parameters over designs are those of a PRB model, not of {model.kind}")
    used, held_out = targets_of(plan, name, records)
    found = fit_parametric(spec, model, used, held_out, threads)
    specimen = used[0].specimen
    tables = [_curves(found, specimen), _left_out(found, specimen)]
    return {**found.to_json(), "tables": tables, "sampled": _sampled(found, specimen)}


def _sampled(found: ParametricResult, specimen: Specimen) -> dict[str, Any] | None:
    """The curves over the range of a single design variable, for figures; None for several."""
    if len(found.model.design) > 1:
        return None
    (name,) = found.model.design
    ends = [point[0] for point in found.model.points]
    places = np.linspace(min(ends), max(ends), _PLACES)
    rows = [found.model.predict(with_numbers(specimen, {name: float(place)})).values for place in places]
    curves = {curve.name: [row[curve.name] for row in rows] for curve in found.model.curves}
    return {"design": name, "unit": number_at(specimen, name)[1], "places": places.tolist(), "curves": curves}


def _design(values: Mapping[str, float], specimen: Specimen) -> str:
    changed = with_numbers(specimen, dict(values))
    return ", ".join(f"{name} {field_shown(changed, name)}" for name in values)


def _curves(found: ParametricResult, specimen: Specimen) -> dict[str, Any]:
    header = ["design", *(curve.name for curve in found.model.curves)]
    rows = []
    for i, point in enumerate(found.model.points):
        cells = [
            f"{shown(c.values[i], c.unit)} +- {shown(c.standard_errors[i], c.unit)}"
            + ("" if c.known[i] else " (left out)")
            for c in found.model.curves
        ]
        rows.append([_design(dict(zip(found.model.design, point, strict=True)), specimen), *cells])
    notes = [*found.notes, f"{found.evaluations} runs in {found.wall_time_s:.1f} s."]
    return {"title": "parameters over the designs", "header": header, "rows": rows, "notes": notes}


def _left_out(found: ParametricResult, specimen: Specimen) -> dict[str, Any]:
    names = [curve.name for curve in found.model.curves]
    errors = ["predicted from the others [%]", "its own fit [%]"]
    header = ["design left out", "lies", *errors, *(f"{name} off" for name in names)]
    rows = list(_left_out_rows(found, specimen, names))
    return {"title": "designs left out", "header": header, "rows": rows, "notes": []}


def _left_out_rows(found: ParametricResult, specimen: Specimen, names: list[str]) -> Iterator[list[str]]:
    for score in found.left_out:
        off = [f"{score.parameters[n]:+.1%}" if n in score.parameters else "-" for n in names]
        where = "among them" if score.inside else "outside"
        errors = [f"{100 * score.error:.3g}", f"{100 * score.own_error:.3g}"]
        yield [_design(score.design, specimen), where, *errors, *off]
