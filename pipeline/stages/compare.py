"""Stage ``compare``: the accuracy tables."""

import json
from collections.abc import Iterator

from lab.experiments import KPRIME_ENTRIES
from pipeline.plan import Plan
from pipeline.stages.gather import entries, fit_results
from pipeline.study import Comparison
from results.accuracy import Entry, Row, against_record, against_scalars, holes, published_ring_down
from results.store import write_text
from results.tables import Table, layout, to_csv, to_json, to_markdown


def compare(plan: Plan) -> str:
    """Write ``accuracy.csv``, ``accuracy.md``, ``tables.json`` and ``holes.json``; return a line about them."""
    found = entries(plan)
    groups = groups_of(plan, found)
    rows = [row for _, group in groups for row in group]
    write_text(plan.folder / "accuracy.csv", to_csv(rows))
    tables = [layout(title, rows) for title, rows in groups if rows] + fit_tables(fit_results(plan))
    write_text(plan.folder / "accuracy.md", to_markdown(tables))
    write_text(plan.folder / "tables.json", to_json(tables))
    failed = [{"sample": e.path, "status": e.record.status, "reason": e.record.reason} for e in holes(found)]
    write_text(plan.folder / "holes.json", json.dumps(failed, indent=1) + "\n")
    return f"{len(rows)} numbers compared, {len(failed)} samples failed"


def groups_of(plan: Plan, found: list[Entry]) -> list[tuple[str, list[Row]]]:
    """Accuracy rows under a title each: the comparisons in their order, then what was published."""
    groups = []
    for comparison in plan.study.comparisons:
        if comparison.reference in plan.study.lab:
            title = f"{comparison.campaign} against {comparison.reference} (published lab measurements)"
            groups.append((title, list(_lab_rows(plan, comparison, found))))
        else:
            origin = plan.study.performers[comparison.reference].model_dump().get("origin", "prb")
            title = f"{comparison.campaign} against {comparison.reference} ({origin})"
            groups.append((title, list(_record_rows(comparison, found))))
    if any(e.experiment.kind == "RingDown" for e in found):
        groups.append(("what the dissertation reports of its own ring-down models", published_ring_down()))
    return groups


def _lab_rows(plan: Plan, comparison: Comparison, found: list[Entry]) -> Iterator[Row]:
    table = plan.lab_table(comparison.reference)
    inside = {(e.performer, e.slug): e for e in found if e.campaign == comparison.campaign}
    performers = plan.study.campaigns[comparison.campaign].performers
    places = {p: plan.rows_of_table(comparison.reference, comparison.campaign, p) for p in performers}
    for phi, values in table.rows.items():
        for performer in performers:
            if sample := places[performer].get(phi):
                entry, label = inside[performer, sample.slug], f"phi {phi:g} deg: {sample.slug}"
                yield from against_scalars(entry, KPRIME_ENTRIES, comparison.reference, table.origin, values, label)


def _record_rows(comparison: Comparison, found: list[Entry]) -> Iterator[Row]:
    inside = [entry for entry in found if entry.campaign == comparison.campaign]
    references = {entry.slug: entry for entry in inside if entry.performer == comparison.reference}
    for slug, other in references.items():
        for entry in inside:
            if entry.slug == slug and entry is not other:
                yield from against_record(entry, other)


def fit_tables(results: dict[str, dict]) -> list[Table]:
    """One table per fit, as its result describes it."""
    tables = []
    for name, result in results.items():
        header, rows = result["table"]["header"], result["table"]["rows"]
        notes = [result["reason"]] if result["reason"] else result["notes"]
        tables.append(Table(f"fit {name}", tuple(header), tuple(tuple(row) for row in rows), tuple(notes)))
    return tables
