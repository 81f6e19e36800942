"""The published measurements that ship as data files, and stiffness tables of a user's own lab."""

import csv
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from lab.experiments.static_stiffness import KPRIME_ENTRIES
from lab.records import Scalar
from lab.units import to_si

DATA = Path(__file__).parent / "data"
PREFIX = "published:"


@cache
def figures() -> Mapping[str, Mapping[str, Any]]:
    """Every published figure of the dissertation by its id: value, unit, conditions, quote, contradictions."""
    document = json.loads((DATA / "published_figures.json").read_text(encoding="utf-8"))
    return {figure["id"]: figure for figure in document["figures"]}


@dataclass(frozen=True)
class StiffnessTable:
    """Measured K' matrices (eq. 5.6), one row per beam.

    Parameters
    ----------
    name
        File name without suffix.
    source
        Where the numbers come from.
    origin
        ``lab`` unless the file says ``virtual-lab``.
    rows
        Published twist (deg) to the nine entries, SI.
    """

    name: str
    source: str
    origin: str
    rows: Mapping[float, Mapping[str, Scalar]]


def locate(name: str, beside: Path) -> Path:
    """Path of a lab file: ``published:NAME`` ships with the project, others lie beside the study.

    Raises
    ------
    ValueError
        When there is no such file.
    """
    path = DATA / f"{name.removeprefix(PREFIX)}.csv" if name.startswith(PREFIX) else beside / name
    if not path.is_file():
        shipped = ", ".join(PREFIX + p.stem for p in sorted(DATA.glob("*.csv")))
        raise ValueError(
            f"lab file {name!r} not found (looked for {path.name} in {path.parent.name}/); shipped: {shipped}"
        )
    return path


def read_stiffness_table(path: Path) -> StiffnessTable:
    """Read a stiffness table: comment lines ``# source:`` and ``# origin:``, then ``name [unit]`` columns.

    Raises
    ------
    ValueError
        Naming file, row and column of what cannot be read.
    """
    text = path.read_text(encoding="utf-8").splitlines()
    comments = [line.lstrip("# ").strip() for line in text if line.startswith("#")]
    notes = dict(line.split(": ", 1) for line in comments if re.match(r"(source|origin): ", line))
    origin = notes.get("origin", "lab")
    if origin not in ("lab", "virtual-lab"):
        raise ValueError(f"{path.name}: origin {origin!r}; allowed: lab, virtual-lab")
    lines = [(number, line) for number, line in enumerate(text, 1) if line.strip() and not line.startswith("#")]
    header = [_split_header(path, cell) for cell in next(csv.reader([lines[0][1]]))] if lines else []
    required = {"phi", *(name for name, _ in KPRIME_ENTRIES)}
    if missing := sorted(required - {name for name, _ in header}):
        raise ValueError(f"{path.name}: column {missing[0]!r} is missing; needed: phi and the nine entries of K'")
    rows = {}
    for number, line in lines[1:]:
        cells = next(csv.reader([line]))
        if len(cells) != len(header):
            raise ValueError(f"{path.name}, row {number}: {len(cells)} cells, {len(header)} columns")
        values = {
            name: _number(path, number, name, cell, unit) for (name, unit), cell in zip(header, cells, strict=True)
        }
        phi = round(values.pop("phi"), 9)
        if phi in rows:
            raise ValueError(f"{path.name}, row {number}: phi {phi:g} deg stands twice")
        rows[phi] = {name: Scalar(values[name], unit) for name, unit in KPRIME_ENTRIES}
    return StiffnessTable(path.stem, notes.get("source", path.name), origin, rows)


def _split_header(path: Path, cell: str) -> tuple[str, str]:
    match = re.fullmatch(r"\s*(\w+) \[([^\]]+)\]\s*", cell)
    if not match:
        raise ValueError(f"{path.name}: column header {cell!r} needs its unit, as 'k_yy [N/m]'")
    return match[1], match[2]


def _number(path: Path, row: int, name: str, cell: str, unit: str) -> float:
    target = "deg" if name == "phi" else dict(KPRIME_ENTRIES).get(name, unit)
    try:
        return to_si(f"{float(cell)!r} {unit}", target)
    except ValueError as error:
        raise ValueError(f"{path.name}, row {row}, column {name}: {error}") from None
