"""Every published figure against our value: carries out the judgements of ``lab.ledger``.

Knows the judgements and the numbers of a study with their names (``Finding``), nothing of how a study is run.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from lab.formulas import FORMULAS
from lab.ledger import (
    Cannot,
    ClosedForm,
    Fin,
    Input,
    InTable,
    Judgement,
    Ledger,
    Measured,
    NotYet,
    Observed,
    Orbit,
    Tolerance,
    Tube,
)
from lab.materials import material
from lab.published import figures
from results.ledger.findings import NOUGHT, Finding, choose, difference, four_digits
from results.ledger.observations import judge_observation
from results.ledger.orbits import judge_orbit
from results.ledger.rows import ARITHMETIC, CANNOT, DIFFERS, INPUT, NOT_HERE, REPRODUCED, LedgerRow, attributed, missing
from results.ledger.stiffness import judge_in_table
from results.ledger.tubes import answers
from results.tubes import sized

#: An input is written with so many digits.
_ROUNDED = 1e-6
#: Verdicts on a value of ours, which a command made.
_MADE = (REPRODUCED, DIFFERS, CANNOT)


def evaluate(ledger: Ledger, findings: Sequence[Finding], made_by: str) -> list[LedgerRow]:
    """A row for every published figure.

    Parameters
    ----------
    findings
        Numbers of the study in hand, those that come first preferred among equals.
    made_by
        Command that makes the study in hand.
    """
    rows = []
    for id, judgement in ledger.judgements.items():
        figure, read = figures()[id], ledger.readings(id)
        row = LedgerRow(
            id, figure["section"], figure["quantity"], figure["value"], figure["unit"], figure["kind"],
            why=judgement.why, contradiction="; ".join(f"{c.about}: {' / '.join(c.says)}" for c in read),
            reading="; ".join(c.reading for c in read),
        )  # fmt: skip
        row = _judged(row, judgement, findings)
        if row.verdict == NOT_HERE:
            row = replace(row, command=ledger.commands[judgement.judge])
        elif row.ours is not None and row.verdict in _MADE:
            row = replace(row, command=made_by)
        rows.append(row)
    return rows


def _judged(row: LedgerRow, judgement: Judgement, findings: Sequence[Finding]) -> LedgerRow:
    match judgement:
        case Cannot():
            return _cannot(row, judgement, findings)
        case NotYet():
            return missing(row, judgement)
        case Input():
            return _input(row, judgement, findings)
        case ClosedForm():
            return _closed_form(row, judgement)
        case InTable():
            return judge_in_table(row, judgement, findings)
        case Measured():
            return _measured(row, judgement, findings)
        case Orbit():
            return judge_orbit(row, judgement, findings)
        case Observed():
            return judge_observation(row, judgement, findings)
        case Tube() | Fin():
            return _tube(row, judgement, findings)


def _cannot(row: LedgerRow, judgement: Cannot, findings: Sequence[Finding]) -> LedgerRow:
    row = replace(row, verdict=CANNOT)
    chosen = choose(findings, judgement.select) if judgement.select else []
    return _with_value(attributed(row, chosen), _mean(chosen, row.unit)) if chosen else row


def _input(row: LedgerRow, judgement: Input, findings: Sequence[Finding]) -> LedgerRow:
    row = replace(row, verdict=INPUT, why="").because(judgement.where, judgement.why)
    ours = _looked_up(judgement.field, row.unit, findings)
    if ours is None:
        return missing(row, judgement) if judgement.field and judgement.by else row
    low = [-ours] if judgement.both_senses else [0.0] if judgement.from_nought else []
    row = _with_value(replace(row, origin="input"), [*low, ours] if low else ours)
    return row.because("this study uses another value") if abs(row.relative_difference) > _ROUNDED else row


def _looked_up(name: str, unit: str, findings: Sequence[Finding]) -> float | None:
    """An input by its name, in ``unit``; None when the study has none of that name."""
    if name.startswith("material:"):
        sheet, _, attribute = name.removeprefix("material:").partition(".")
        return float(getattr(material(sheet), attribute))
    if name.startswith("size:"):
        size, _, attribute = name.removeprefix("size:").partition(".")
        return 2 * sized(size).radius if attribute == "diameter" else float(getattr(sized(size), attribute))
    found = [finding for finding in findings if finding.quantity == name]
    return found[0].shown(unit) if found else None


def _closed_form(row: LedgerRow, judgement: ClosedForm) -> LedgerRow:
    result = FORMULAS[judgement.formula]()
    origin = ARITHMETIC if judgement.basis == "text" else "theory"
    ours = list(result) if isinstance(result, tuple) else result
    row = replace(row, ours=ours, origin=origin, model=judgement.formula)
    published = row.published if judgement.expects is None else list(judgement.expects)
    return _within(row, published, judgement.tolerance)


def _measured(row: LedgerRow, judgement: Measured, findings: Sequence[Finding]) -> LedgerRow:
    chosen = choose(findings, judgement.select)
    if not chosen:
        return missing(row, judgement)
    values, tolerance = [finding.shown(row.unit) for finding in chosen], judgement.tolerance
    row = _with_value(attributed(row, chosen), _mean(chosen, row.unit))
    if judgement.compare == "nonzero":
        return _told(row, min(abs(value) for value in values) > 0, "not zero", tolerance)
    if judgement.compare == "at-most":
        return _told(row, row.relative_difference <= (tolerance.share or 0.0), "at most as published", tolerance)
    if tolerance.spread:
        low, high = min(values), max(values)
        return _told(row, low <= row.published <= high, f"{low:.4g} to {high:.4g} {row.unit}", tolerance)
    of = choose(findings, tolerance.of) if tolerance.of else chosen
    return _within(row, row.published, tolerance, max((abs(f.error / f.value) for f in of), default=math.nan))


def _tube(row: LedgerRow, judgement: Tube | Fin, findings: Sequence[Finding]) -> LedgerRow:
    """Verdict on the preferred model's answer; others stand beside."""
    beside = [f"{label} {_said(float(np.asarray(FORMULAS[name]())), row)}" for label, name in judgement.beside.items()]
    found = answers(judgement, findings)
    if not found:
        return missing(replace(row, others="; ".join(beside)), judgement)
    first, *others = found
    row = attributed(row, [first.source]).because(first.why)
    row = replace(row, others="; ".join([*beside, *(f"{o.source.model} {_said(o.ours, row)}" for o in others)]))
    if first.holds is not None:
        return _told(replace(row, ours=first.ours), first.holds, "rule", judgement.tolerance)
    if first.ours is None:
        return replace(row, verdict=CANNOT)
    return _within(replace(row, ours=first.ours), row.published, judgement.tolerance)


def _said(ours: Any, row: LedgerRow) -> str:
    """Another model's value for people, with its difference where it is a number."""
    if not isinstance(ours, float):
        return "has no value" if ours is None else str(ours)
    return f"{four_digits(ours)} ({difference(ours, row.published):+.0%})"


def _within(row: LedgerRow, published: Any, tolerance: Tolerance, error: float = math.nan) -> LedgerRow:
    """Verdict on our value beside published numbers; ``error`` is the relative standard error where it counts."""
    ours, theirs = np.atleast_1d(row.ours), np.atleast_1d(published)
    size = float(np.abs(theirs).max())
    if tolerance.absolute is not None:
        allowed = tolerance.absolute
    elif tolerance.standard_errors is not None:
        allowed = tolerance.standard_errors * error * float(np.abs(ours).max())
    else:
        allowed = (tolerance.share or 0.0) * size
    row = _with_value(row, row.ours, published)
    if math.isnan(allowed):
        return replace(row, verdict=CANNOT).because("the standard error that the tolerance asks for is not known here")
    # Differences of decimal figures carry round-off.
    good = float(np.abs(ours - theirs).max()) <= allowed + NOUGHT * size
    unit = "" if row.unit == "-" else f" {row.unit}"
    shown = f"{tolerance.share * 100:g} %" if tolerance.share is not None else f"{allowed:.3g}{unit}"
    return _told(row, good, shown, tolerance)


def _told(row: LedgerRow, good: bool, allowed: str, tolerance: Tolerance) -> LedgerRow:
    verdict = REPRODUCED if good else DIFFERS
    return replace(row, verdict=verdict, tolerance=f"{allowed}: {tolerance.why}")


def _with_value(row: LedgerRow, ours: Any, published: Any = None) -> LedgerRow:
    against = row.published if published is None else published
    return replace(row, ours=ours, relative_difference=difference(ours, against))


def _mean(chosen: Sequence[Finding], unit: str) -> float:
    return float(np.mean([finding.shown(unit) for finding in chosen]))
