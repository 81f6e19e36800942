"""Stage ``collect``: the one writer of ``study.h5``."""

import math
from typing import Any

from lab.fields import quantity_of
from lab.materials import Frozen
from pipeline.plan import ALL_SOURCES, Plan, Sample
from pipeline.provenance import provenance
from pipeline.stages.gather import entries, fit_results
from results.collection import write_study
from results.store import write_text


def collect(plan: Plan) -> str:
    """Gather all records and fits in ``study.h5`` and the fitted models as MJCF; return a line about it."""
    found, fits = entries(plan), fit_results(plan)
    path = plan.folder / "study.h5"
    about = {"study": plan.study.model_dump(mode="json"), "study_hash": plan.study.digest(), **provenance(ALL_SOURCES)}
    write_study(path, found, _sweeps(plan), fits, about)
    for name, fit in fits.items():
        if fit.get("mjcf"):
            write_text(plan.folder / "mjcf" / f"{name}.xml", fit["mjcf"])
    done = sum(entry.record.completed for entry in found)
    return f"{path}: {done} of {len(found)} samples completed, {len(fits)} fits"


def _sweeps(plan: Plan) -> dict[str, tuple[str, list[float]]]:
    """Unit and value per sample of every numeric swept parameter, SI."""
    samples = list(plan.samples.values())
    axes = dict.fromkeys(axis for c in plan.study.campaigns.values() for grid in c.sweep for axis in grid)
    swept = {}
    for axis in axes:
        values = [_number(sample, axis) for sample in samples]
        if not all(math.isnan(v) for _, v in values):
            swept[axis.replace(".", "_")] = (next((u for u, _ in values if u), "1"), [v for _, v in values])
    return swept


def _number(sample: Sample, axis: str) -> tuple[str, float]:
    part, *path = axis.split(".")
    here: Any = {"specimen": sample.specimen, "experiment": sample.experiment, "performer": sample.model}[part]
    for name in path[:-1]:
        here = getattr(here, name, None)
    value = here.get(path[-1]) if isinstance(here, dict) else getattr(here, path[-1], None)
    if isinstance(value, bool) or not isinstance(value, int | float):
        return "", math.nan
    quantity = quantity_of(type(here), path[-1]) if isinstance(here, Frozen) else None
    return quantity.unit if quantity else "", float(value)
