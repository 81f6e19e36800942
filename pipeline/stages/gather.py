"""What stages read of others: all records of a study with what their fits have seen, and results of fits."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pipeline.plan import Plan, Sample
from pipeline.study import LabPerformer
from results.accuracy import Entry, Seen
from results.store import read_record


def entries(plan: Plan, with_fields: bool = False) -> list[Entry]:
    """All records of the study."""
    seen = {name: plan.seen(name) for name in plan.study.fits}
    return [_entry(plan, sample, seen, with_fields) for sample in plan.samples.values()]


def _entry(plan: Plan, sample: Sample, seen: Mapping[str, frozenset[Seen]], with_fields: bool) -> Entry:
    path = Path(plan.output(sample))
    fit = None if isinstance(sample.model, LabPerformer) else sample.model.fit
    return Entry(
        sample.campaign, sample.performer, sample.slug, sample.specimen_name, sample.experiment,
        read_record(path, with_fields), str(path.relative_to(plan.folder)), seen[fit] if fit else None,
    )  # fmt: skip


def fit_results(plan: Plan) -> dict[str, dict[str, Any]]:
    """Results of all fits by name."""
    return {name: fit_result(plan, name) for name in plan.study.fits}


def fit_result(plan: Plan, name: str) -> dict[str, Any]:
    """Result of a finished fit, whatever its status."""
    result: dict[str, Any] = json.loads(Path(plan.fit_output(name)).read_text(encoding="utf-8"))
    return result
