"""Sensitivities as a table, and what would have to give for ours to be the lab's."""

import math
from collections.abc import Iterator, Sequence

from lab.published import figures
from lab.units import from_si
from results.accuracy import Entry
from results.benches import text_of, words_of
from results.push_tests import pairs, push_tests
from results.sensitivity import ANISOTROPY, CLOSED, CLOSING, FAR, OPEN, RATIO, Sensitivity, sensitivities
from results.tables import Table, shown
from results.tubes import published_size

_NOTE = (
    "one field at a time, all else as in the nominal case; power: d ln(result) / d ln(field), for fields that may be "
    "zero the change per unit instead; by least squares over all samples; to match the lab: where the result would be "
    "the lab's, between samples if they enclose it, else by the power and marked so, none beyond a factor of "
    f"{FAR:g}; settings of a performer, as of its mesh, show how settled its results are"
)
_HEADER = ("tube", "by", "result", "field", "samples", "nominal", "lab", "power or change", "to match the lab")


def sensitivity_tables(entries: Sequence[Entry]) -> Iterator[Table]:
    """The table of all sensitivities, if there is any."""
    if lines := [*map(_line, sensitivities(entries)), *_in_series(entries)]:
        order = [OPEN, CLOSED, RATIO, CLOSING, ANISOTROPY]
        lines.sort(key=lambda line: (line[0], order.index(line[2])))
        yield Table("sensitivities, one at a time", _HEADER, tuple(lines), (_NOTE,))


def _in_series(entries: Sequence[Entry]) -> Iterator[tuple[str, ...]]:
    """What would have to give behind the pusher: it is in series with the tube, so that nothing need be computed."""
    told: set[tuple[str, str]] = set()
    for opened, closed in pairs(push_tests(entries)):
        if opened is None or closed is None or closed.experiment.pinch_angle or closed.entry.record.origin == "prb":
            continue
        entry, plain = closed.entry, opened.is_plain and closed.is_plain and not closed.experiment.rig_stiffness
        known = published_size(entry.record.specimen) == "printed-tpu"
        if not (plain and known) or (entry.performer, entry.specimen) in told:
            continue
        told.add((entry.performer, entry.specimen))
        lab = {name: float(figures()[id]["value"]) for name, id in ((OPEN, "c3-k-unpinched"), (CLOSED, "c3-k-pinched"))}
        ratio = lab[OPEN] / lab[CLOSED]
        gives = {
            OPEN: (opened.k, lab[OPEN], 1 / lab[OPEN] - 1 / opened.k),
            CLOSED: (closed.k, lab[CLOSED], 1 / lab[CLOSED] - 1 / closed.k),
            RATIO: (opened.k / closed.k, ratio, (1 / closed.k - ratio / opened.k) / (ratio - 1)),
        }
        for name, (ours, wanted, compliance) in gives.items():
            match = f"{1e-3 / compliance:.3g} N/mm" if compliance > 0 else "none"
            yield (
                entry.specimen, entry.performer, name, "plate and pusher in series", f"rigid: {shown(ours, '')}",
                "rigid", shown(wanted, ""), "-", match,
            )  # fmt: skip


def _line(one: Sensitivity) -> tuple[str, ...]:
    values = ", ".join(
        f"{text_of(float(p), one.quantity)}: {shown(float(r), '')}"
        for p, r in zip(one.values, one.results, strict=True)
    )
    return (
        one.entry.specimen, one.entry.performer, one.result, words_of(one.path), values,
        text_of(float(one.values[one.nominal]), one.quantity), shown(one.target, ""), _power(one), _match(one),
    )  # fmt: skip


def _power(one: Sensitivity) -> str:
    if one.by_power:
        return f"{round(one.slope, 2) + 0.0:+.2f}"
    if one.quantity is None:
        return f"{100 * one.slope:+.3g} % each"
    factor = from_si(1.0, one.quantity.unit, one.quantity.shown_in)
    return f"{100 * one.slope / factor:+.3g} % per {one.quantity.shown_in}"


def _match(one: Sensitivity) -> str:
    value, between = one.matching()
    if math.isnan(one.target):
        return "-"
    if math.isnan(value):
        return "none"
    unit = f" {one.quantity.shown_in}" if one.quantity else ""
    number = from_si(value, one.quantity.unit, one.quantity.shown_in) if one.quantity else value
    return f"{number:.3g}{unit}" + ("" if between else " (extrapolated)")
