"""What the comparing stages read: all records of a study, with what their fits have seen."""

import json
from pathlib import Path
from typing import Any

from pipeline.plan import Plan, Sample
from results.accuracy import Entry, FitUse
from results.store import read_record


def entries(plan: Plan, with_fields: bool = False) -> list[Entry]:
    """All records of the study."""
    return [_entry(plan, sample, with_fields) for sample in plan.samples.values()]


def _entry(plan: Plan, sample: Sample, with_fields: bool) -> Entry:
    path = Path(plan.output(sample))
    return Entry(
        sample.campaign, sample.performer, sample.slug, sample.specimen_name, sample.experiment,
        read_record(path, with_fields), str(path.relative_to(plan.folder)), _use(plan, sample),
    )  # fmt: skip


def _use(plan: Plan, sample: Sample) -> FitUse | None:
    if not sample.model.fit:
        return None
    fit = plan.study.fits[sample.model.fit]
    if fit.campaign != sample.campaign:
        return FitUse(fit.reference, frozenset())
    # A modulus fit names rows of its lab table; what it used are the samples behind them.
    used = fit.used if fit.kind == "tracking" else [s.slug for s in plan.fit_samples(sample.model.fit)]
    return FitUse(fit.reference, frozenset(used))


def fit_results(plan: Plan) -> dict[str, dict[str, Any]]:
    """Results of all fits by name."""
    return {name: json.loads(Path(plan.fit_output(name)).read_text(encoding="utf-8")) for name in plan.study.fits}
