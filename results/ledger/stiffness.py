"""Entries and matrices of table 5.1, judged by the scatter of the table itself."""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from lab.formulas import FORMULAS
from lab.ledger import InTable, Select
from lab.published import DATA, figures, read_stiffness_table
from results.ledger.findings import NOUGHT, Finding, choose, difference, four_digits
from results.ledger.rows import CANNOT, DIFFERS, REPRODUCED, LedgerRow, attributed, missing

#: Entries of K' that do not vanish by symmetry, and the unit by which each is scaled in a row.
MAIN_ENTRIES = {"k_yy": "N/m", "k_yz": "N/m", "k_zy": "N/m", "k_zz": "N/m", "n_xx": "N*m/rad"}
#: Half of the last digit printed in table 5.1, in each entry's unit.
_LAST_DIGIT = 0.005


def judge_in_table(row: LedgerRow, judgement: InTable, findings: Sequence[Finding]) -> LedgerRow:
    """An entry, or the matrix of a row, by the FEA whose sample stands for that row."""
    figure = figures()[row.id]
    phi = float(re.findall(r"phi = (-?\d+) deg", figure["conditions"])[0])
    inside = [f for f in findings if f.against == "lab" and f.facts.get("phi") == phi]
    if not isinstance(figure["value"], list):
        return _entry(row, judgement, inside, figure["quantity"].split()[-1])
    entries = {
        name: _entry(replace(row, published=value), judgement, inside, name)
        for name, value in _published_row(phi).items()
    }
    if any(entry.ours is None for entry in entries.values()):
        return missing(row, judgement)
    return _matrix(row, judgement, entries)


def _matrix(row: LedgerRow, judgement: InTable, entries: Mapping[str, LedgerRow]) -> LedgerRow:
    """The nine entries as one figure: reproduced when every main one is, or is not told from zero."""
    good = sum(entries[name].verdict != DIFFERS for name in MAIN_ENTRIES)
    scale = {
        unit: max(abs(entries[name].published) for name, of in MAIN_ENTRIES.items() if of == unit)
        for unit in MAIN_ENTRIES.values()
    }
    shares = [(entries[name].ours - entries[name].published) / scale[unit] for name, unit in MAIN_ENTRIES.items()]
    first = next(iter(entries.values()))
    row = replace(
        row, ours=np.array([entry.ours for entry in entries.values()]).reshape(3, 3).tolist(), origin=first.origin,
        model=first.model, use=first.use, relative_difference=float(np.sqrt(np.mean(np.square(shares)))),
        tolerance=judgement.tolerance.why, verdict=REPRODUCED if good == len(MAIN_ENTRIES) else DIFFERS,
    )  # fmt: skip
    return row.because(
        f"{good} of {len(MAIN_ENTRIES)} lie within; the difference is their root mean square over the row's largest"
    )


def _entry(row: LedgerRow, judgement: InTable, findings: Sequence[Finding], name: str) -> LedgerRow:
    # A table of the user's own has other numbers: it is not what was published.
    same = [f for f in findings if f.quantity == name and math.isclose(f.reference_value, row.published)]
    select = Select(quantity=name, experiment="StaticStiffness", role=("fea fitted", "fea"))
    chosen = choose(same, select)[:1]
    if not chosen:
        return missing(row, judgement)
    relative, floor = table_scatter()[name]
    allowed = max(relative * abs(row.published) + _LAST_DIGIT, floor)
    ours = chosen[0].value if abs(chosen[0].value) > NOUGHT else 0.0
    others = {_label(f, chosen[0]): f.value for f in same if math.isfinite(f.value) and f is not chosen[0]}
    beside = {label: float(np.asarray(FORMULAS[formula]())) for label, formula in judgement.beside.items()}
    row = replace(
        attributed(row, chosen), ours=ours, relative_difference=difference(ours, row.published),
        tolerance=f"{allowed:.3g} {row.unit}: {judgement.tolerance.why}",
        others="; ".join(_compared(label, value, row.published) for label, value in {**beside, **others}.items()),
    )  # fmt: skip
    return _verdict(row, allowed, floor)


def _label(finding: Finding, chosen: Finding) -> str:
    return finding.model if finding.campaign == chosen.campaign else f"{finding.model} in {finding.campaign}"


def _compared(label: str, value: float, published: float) -> str:
    return f"{label} {four_digits(value)} ({difference(value, published):+.0%})"


def _verdict(row: LedgerRow, allowed: float, floor: float) -> LedgerRow:
    if abs(row.ours - row.published) > allowed:
        return replace(row, verdict=DIFFERS)
    if abs(row.published) <= floor:
        small = f"the published figure is not told from zero by the table's own scatter of {floor:.3g} {row.unit}"
        return replace(row, verdict=CANNOT).because(small)
    return replace(row, verdict=REPRODUCED)


@cache
def table_scatter() -> Mapping[str, tuple[float, float]]:
    """Two standard deviations of one entry of table 5.1, from the table's own asymmetry.

    Returns
    -------
    dict
        Entry of K' to (relative, floor).  Relative: beams of opposite twist have equal entries but for signs; from
        k_yy, k_zz, n_xx for these three, from k_yz, k_zy for these two.  Floor, what an entry must exceed to be told
        from zero, in its unit: k_yz = k_zy, m_yx = t_xy and m_zx = t_xz in every elastic body.
    """
    rows = {phi: _published_row(phi) for phi in (0.0, 45.0, -45.0, 90.0, -90.0)}
    scatter: dict[str, tuple[float, float]] = {}
    couplings = _two_deviations([row["k_yz"] - row["k_zy"] for row in rows.values()])
    for group, floor in ((("k_yy", "k_zz", "n_xx"), 0.0), (("k_yz", "k_zy"), couplings)):
        pairs = [(abs(rows[phi][name]), abs(rows[-phi][name])) for name in group for phi in (45.0, 90.0)]
        relative = _two_deviations([2 * (a - b) / (a + b) for a, b in pairs])
        scatter |= dict.fromkeys(group, (relative, floor))
    twins = (("m_yx", "t_xy"), ("m_zx", "t_xz"))
    floor = _two_deviations([row[m] - row[t] for row in rows.values() for m, t in twins])
    return scatter | {name: (0.0, floor) for pair in twins for name in pair}


def _two_deviations(differences: Sequence[float]) -> float:
    """Twice the standard deviation of one figure, from differences of two with the same expected value."""
    return 2.0 * float(np.sqrt(np.mean(np.square(differences)) / 2.0))


@cache
def _published_row(phi: float) -> dict[str, float]:
    table = read_stiffness_table(DATA / "table_5_1.csv")
    return {name: scalar.value for name, scalar in table.rows[phi].items()}
