"""Stage ``compare``: the accuracy tables."""

import json
import math
from collections.abc import Iterator
from dataclasses import replace

from lab.experiments import KPRIME_ENTRIES, NaturalModes
from pipeline.plan import Plan
from pipeline.stages.gather import entries, fit_results
from pipeline.study import Comparison
from results.accuracy import Entry, Row, against_record, against_scalars, holes, published_ring_down
from results.fin_tables import FIN_EXPERIMENTS, fin_tables
from results.fit_tables import fit_tables
from results.mirror import mirror_table
from results.mode_tables import THEORY, mode_tables, theory_rows
from results.orbit_series import orbit_series
from results.orbit_tables import orbit_tables
from results.store import write_text
from results.summary import errors_by_quantity, summary, told_once
from results.tables import Table, layout, to_csv, to_json, to_markdown
from results.tube_tables import TUBE_EXPERIMENTS, tube_comparison, tube_tables

PUBLISHED = "what the dissertation reports of its own ring-down models"
#: Sizes of an orbit that a table puts together.
_AXES = ("major_axis", "minor_axis", "span_y", "span_z")


def compare(plan: Plan) -> str:
    """Write ``accuracy.csv``, ``accuracy.md``, ``tables.json`` and ``holes.json``; return a line about them."""
    found = entries(plan)
    groups = [*groups_of(plan, found), *theory_groups(found)]
    rows = [row for _, group in groups for row in group]
    write_text(plan.folder / "accuracy.csv", to_csv(rows))
    tables = [*summaries(plan, groups), *tables_of(groups, found), *fit_tables(fit_results(plan))]
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
            performer = plan.study.performers[comparison.reference]
            origin = getattr(performer, "origin", performer.kind)
            title = f"{comparison.campaign} against {comparison.reference} ({origin})"
            groups.append((title, list(_record_rows(comparison, found))))
    if any(e.experiment.kind == "RingDown" for e in found):
        groups.append((PUBLISHED, published_ring_down()))
    return groups


def theory_groups(found: list[Entry]) -> list[tuple[str, list[Row]]]:
    """Natural frequencies of every campaign that asks for them against beam theory."""
    campaigns = dict.fromkeys(entry.campaign for entry in found if isinstance(entry.experiment, NaturalModes))
    return [
        (f"{name} against {THEORY}", list(theory_rows([entry for entry in found if entry.campaign == name])))
        for name in campaigns
    ]


def tables_of(groups: list[tuple[str, list[Row]]], found: list[Entry]) -> Iterator[Table]:
    """Tables of the groups, each as its experiment asks for, then the symmetry of all orbits and what tubes do."""
    series = orbit_series(found)
    for title, rows in groups:
        if not rows:
            continue
        campaign, experiment = rows[0].campaign, rows[0].experiment
        if experiment == "BaseShake":
            axes = [row for row in rows if row.quantity in _AXES]
            yield errors_by_quantity(f"orbits of {title}", axes, of_largest=True)
            yield from orbit_tables([one for one in series if one.campaign == campaign], rows[0].reference)
        elif experiment == "NaturalModes":
            yield from mode_tables(title, rows, [entry for entry in found if entry.campaign == campaign])
        elif experiment in (*TUBE_EXPERIMENTS, *FIN_EXPERIMENTS):
            yield from tube_comparison(title, rows)
        else:
            table = layout(title, rows)
            if table.detail:
                yield errors_by_quantity(title, rows, of_largest=True)
            yield table
    if (symmetry := mirror_table(found)) is not None:
        yield symmetry
    yield from tube_tables(found)
    yield from fin_tables(found)


def summaries(plan: Plan, groups: list[tuple[str, list[Row]]]) -> list[Table]:
    """For each reference in motion, one line per model, with the dissertation's own two models below."""
    published = [rows for title, rows in groups if title == PUBLISHED]
    tables = []
    for title, rows in groups:
        if title != PUBLISHED and any(row.quantity == "tracking_error" for row in rows):
            below = published if rows[0].experiment == "RingDown" else []
            found = summary(f"In short: {title}", [rows, *below])
            noise = getattr(plan.study.performers[rows[0].reference], "noise", 0.0)
            note = f"the noise of {rows[0].reference} alone is {1e3 * noise * math.sqrt(3.0):.3g} mm of eq. 5.13"
            tables.append(replace(found, notes=(*found.notes, note)) if noise else found)
    return told_once(tables)


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
