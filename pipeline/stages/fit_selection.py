"""Fit of kind ``selection``: which topology to take, and how far the answers of several differ."""

import math
from collections.abc import Iterator, Mapping
from typing import Any

from calibrate.selection import Candidate, Selection, select
from calibrate.spec import Fit, SelectionFit
from lab.records import Record
from pipeline.plan import Plan
from pipeline.stages.fit import model_of, targets_of
from pipeline.stages.gather import fit_result
from results.tables import shown


def selection(plan: Plan, name: str, records: Mapping[str, Record], threads: int) -> dict[str, Any]:
    """The fits named, ranked, with the parameters and the model of the one to take."""
    spec = plan.study.fits[name]
    assert isinstance(spec, SelectionFit)
    candidates = []
    for other in spec.fits:
        fit = plan.study.fits[other]
        assert isinstance(fit, Fit)
        candidates.append(Candidate(other, model_of(plan, other), fit, fit_result(plan, other)))
    used, held_out = targets_of(plan, spec.fits[0], records)
    found = select(candidates, used, held_out, leave_one_out=spec.leave_one_out, threads=threads)
    chosen = next(c for c in candidates if c.name == found.ranked[0].name)
    result = found.to_json()
    result |= {"parameters": list(chosen.result["parameters"]), "chosen_model": plan.following(chosen.name).model}
    if "mjcf" in chosen.result:
        result["mjcf"] = chosen.result["mjcf"]
    notes = list(found.notes)
    if not spec.leave_one_out:
        notes.append("The choice has seen the held-out records: for the chosen model they are no longer quite so.")
    return {**result, "notes": notes, "tables": [_ranking(found), _spreads(found)]}


def _ranking(found: Selection) -> dict[str, Any]:
    header = [
        "fit",
        "free",
        "in sample [%]",
        "in sample [mm]",
        "held out [%]",
        "held out [mm]",
        "left out [%]",
        "taken",
    ]
    rows = [
        [
            r.name, str(r.parameters), _scaled(r.in_sample, 100), _scaled(r.in_sample_rms, 1e3),
            _scaled(r.held_out, 100), _scaled(r.held_out_rms, 1e3), _scaled(r.left_out, 100),
            "chosen" if not i else "in the spread" if r.credible else "",
        ]
        for i, r in enumerate(found.ranked)
    ]  # fmt: skip
    return {"title": f"ranked by {found.by} error", "header": header, "rows": rows, "notes": []}


def _scaled(value: float, factor: float) -> str:
    return f"{factor * value:.3g}" if math.isfinite(value) else "-"


def _spreads(found: Selection) -> dict[str, Any]:
    names = list(found.spreads[0].values) if found.spreads else []
    header = ["quantity", "spread of models", *(f"{name} +- 95 %" for name in names)]
    return {"title": "model-form spread", "header": header, "rows": list(_spread_rows(found, names)), "notes": []}


def _spread_rows(found: Selection, names: list[str]) -> Iterator[list[str]]:
    for spread in found.spreads:
        cells = [
            f"{shown(spread.values[n], spread.unit)} +- {shown(spread.half_widths[n], spread.unit)}" for n in names
        ]
        yield [spread.long_name or spread.name, shown(spread.spread, spread.unit), *cells]
