"""Fit of kind ``hinge``: what a finite-element tube says about the hinge that stands for it."""

from collections.abc import Mapping
from typing import Any

from calibrate.hinge_fit import HingeDatum, fit_hinge
from calibrate.spec import HingeFit
from lab.records import Record
from pipeline.plan import Plan
from pipeline.stages.fit import model_of
from pipeline.study import PrbPerformer


def hinge(plan: Plan, name: str, records: Mapping[str, Record], threads: int) -> dict[str, Any]:
    """Curves of the hinge with their scores; records without a result are left out, and named."""
    spec, model = plan.study.fits[name], model_of(plan, name)
    assert isinstance(spec, HingeFit)
    if not isinstance(model, PrbPerformer):
        raise ValueError(f"fit {name}: a hinge is that of a PRB model, not of {model.kind}")
    data = [HingeDatum(datum.label, datum.used, records[datum.sample.id]) for datum in plan.data(name)]
    result = fit_hinge(spec, model, [item for item in data if item.record.completed])
    holes = [
        f"{item.label} {item.record.status}: {'left out of the fit' if item.used else 'not scored'}"
        for item in data
        if not item.record.completed
    ]
    return {**result, "notes": [*result["notes"], *holes]}
