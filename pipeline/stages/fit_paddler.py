"""Fit of kind ``paddler``: a fin from finite elements, and what the published thrust says about the rest."""

from collections.abc import Mapping
from typing import Any

from calibrate.spec import PaddlerFit
from lab.experiments import PaddleThrust
from lab.records import Record
from lab.specimens import FinnedTube
from pipeline.plan import Plan
from pipeline.stages.fit import mjcf_of, model_of
from pipeline.study import PrbPerformer
from prb.fin_curves import FinCurves


def paddler(plan: Plan, name: str, records: Mapping[str, Record], threads: int) -> dict[str, Any]:
    """Curves of the fin and the numbers found; records without a result are left out, and named."""
    from calibrate.paddler_fit import FinDatum, fit_paddler  # compiled code, which other fits do not need

    spec, model = plan.study.fits[name], model_of(plan, name)
    assert isinstance(spec, PaddlerFit)
    if not isinstance(model, PrbPerformer):
        raise ValueError(f"fit {name}: a paddler is a PRB model, not {model.kind}")
    specimen = plan.study.specimens[spec.specimen] if spec.specimen else None
    if specimen is not None and not isinstance(specimen, FinnedTube):
        raise ValueError(f"fit {name}: specimen {spec.specimen} is a {specimen.kind}, not a FinnedTube")
    data = [FinDatum(datum.label, datum.used, records[datum.sample.id]) for datum in plan.data(name)]
    result = fit_paddler(spec, model, [item for item in data if item.record.completed], specimen, threads)
    holes = [
        f"{item.label} {item.record.status}: {'left out of the fit' if item.used else 'not scored'}"
        for item in data
        if not item.record.completed
    ]
    if specimen is not None and spec.free:
        result["mjcf"] = _mjcf(model, result, specimen)
    return {**result, "notes": [*result["notes"], *holes]}


def _mjcf(model: PrbPerformer, result: Mapping[str, Any], specimen: FinnedTube) -> str:
    """The best set for a user's own simulator."""
    fin = FinCurves.model_validate(result["fin"]) if result["fin"] else None
    values = {p["name"]: p["value"] for p in result["parameters"]}
    return mjcf_of(model.model_copy(update={"fin": fin}), values, specimen, PaddleThrust())
