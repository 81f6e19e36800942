"""OptiTrack Motive's CSV export, format versions 1.20 to 1.25 (Motive 1.9 to 3).

The first row pairs titles with values (``Format Version,1.23,Take Name,...``).  Below an empty row stand, per
column, the type of what was tracked, its name, its ID (from 1.25 on its parent as well), Position or Rotation,
and the axis; to 1.21 these rows have no titles of their own.  A 1.24 export may have a time code as third column.
An occluded sample is a stretch of empty cells.
"""

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lab.readers.clock import clock
from lab.readers.markers import collect, occlusions, wanted
from lab.readers.options import MotiveOptions, factor, with_sidecar
from lab.readers.recording import Recording
from lab.readers.rotations import axis_of
from lab.readers.table import Table, body, lines_of

_HEADER_ROWS = 12
_FACTS = (
    "Format Version", "Take Name", "Capture Frame Rate", "Export Frame Rate", "Length Units", "Coordinate Space",
)  # fmt: skip
_TITLES = ("type", "name", "id", "parent")


def read_motive(path: Path, options: MotiveOptions, names: Sequence[str] | None = None) -> Recording:
    """Read one take.

    Parameters
    ----------
    path
        The export.
    options
        Which columns count, and where up is.
    names
        Markers that are needed, all of the file by default.

    Raises
    ------
    ValueError
        In one line with file, row and column.
    """
    options = with_sidecar(options, path)
    lines = lines_of(path)
    facts = _facts(path.name, lines[0])
    scale = _scale(path.name, facts)
    below, axes_row = _header(path.name, lines)
    samples = [(number, line) for number, line in enumerate(lines, 1) if number > axes_row and line.strip()]
    table = body(path.name, below["axis"], samples)
    triples = _triples(table, below, options.columns)
    if not triples:
        there = ", ".join(sorted({text for text in below["type"][2:] if text}))
        raise ValueError(f"{path.name}: no positions of the type {options.columns!r}; the file has {there}")
    chosen = wanted(path.name, triples, names)
    rate = float(facts.get("Export Frame Rate") or facts.get("Capture Frame Rate") or 0) or None
    column = table.numbers([1], ["Time"])[:, 0]
    time, rate, source = clock(path.name, table.rows, column, rate)
    markers = {name: collect(table, name, triples[name], ("",)) * scale for name in chosen}
    return Recording(
        source=path.name, time=time, rate=rate, rows=table.rows, markers=markers, up=axis_of(options.up),
        specimen=options.specimen, declared=options.declared,
    ).noted(
        f"read {path.name}: Motive CSV {facts['Format Version']}, take {facts.get('Take Name', '')!r}, {len(time)} "
        f"samples, {options.columns} columns in {facts['Length Units'].lower()}, {source}, {occlusions(markers)}"
    )  # fmt: skip


def _facts(name: str, line: str) -> Mapping[str, str]:
    """Titles and values of the first row."""
    cells = [cell.strip() for cell in next(csv.reader([line]))]
    if cells[0] != "Format Version":
        raise ValueError(
            f"{name}, row 1: no Motive export with its header (it would begin with 'Format Version'); "
            "export the take again with 'Header Information' on"
        )
    # Looked up by title: a comma in the take's name or notes shifts all that follow.
    facts = {title: cells[cells.index(title) + 1] for title in _FACTS if title in cells[:-1]}
    if not facts["Format Version"].startswith("1.2"):
        raise ValueError(f"{name}, row 1: format version {facts['Format Version']}; read are 1.20 to 1.25")
    if (space := facts.get("Coordinate Space", "Global")) != "Global":
        raise ValueError(f"{name}, row 1: coordinate space {space!r}; export it as Global")
    for title in ("Capture Frame Rate", "Export Frame Rate"):
        try:
            float(facts.get(title) or 1)
        except ValueError:
            raise ValueError(f"{name}, row 1: {title} {facts[title]!r} is not a number") from None
    return facts


def _scale(name: str, facts: Mapping[str, str]) -> float:
    if "Length Units" not in facts:
        raise ValueError(f"{name}, row 1: no 'Length Units'")
    return factor(f"{name}, row 1", facts["Length Units"].lower(), "m")


def _header(name: str, lines: Sequence[str]) -> tuple[dict[str, list[str]], int]:
    """The rows that say what stands in each column, by title, and the number of the last of them."""
    rows = [[cell.strip() for cell in row] for row in csv.reader(lines[:_HEADER_ROWS])]
    last = next((n for n, row in enumerate(rows) if row[:1] == ["Frame"] and row[1:2] and "Time" in row[1]), None)
    if last is None:
        raise ValueError(f"{name}: no row 'Frame,Time (Seconds),X,Y,Z' among the first {_HEADER_ROWS}")
    above = [row for row in rows[1:last] if any(row)]
    if len(above) < 3:
        raise ValueError(f"{name}, row {last + 1}: {len(above)} rows of titles above; type, name and position belong")
    titled = {row[1].lower(): row for row in above[:-1] if len(row) > 1 and row[1].lower() in _TITLES}
    found = titled or dict(zip(_TITLES, above[:-1], strict=False))
    if not {"type", "name"} <= set(found):
        raise ValueError(f"{name}: the rows 'Type' and 'Name' are not both there above row {last + 1}")
    found |= {"component": above[-1], "axis": rows[last]}
    width = max(map(len, found.values()))
    return {title: row + [""] * (width - len(row)) for title, row in found.items()}, last + 1


def _triples(table: Table, below: Mapping[str, Sequence[str]], kind: str) -> dict[str, NDArray[np.int64]]:
    """Name to the columns of X, Y and Z, of the type that is asked for."""
    found: dict[str, dict[str, int]] = {}
    for number, (what, name, part, axis) in enumerate(
        zip(below["type"], below["name"], below["component"], below["axis"], strict=True)
    ):
        if number < 2 or what.lower().replace(" ", "-") != kind or part != "Position":
            continue
        if axis in found.setdefault(name, {}):
            raise ValueError(
                f"{table.name}: two {what} columns {name!r} {axis}; give each marker its own name in Motive"
            )
        found[name][axis] = number
    for name, columns in found.items():
        if sorted(columns) != ["X", "Y", "Z"]:
            raise ValueError(f"{table.name}: {name!r} has the axes {', '.join(columns)}, not X, Y, Z")
    return {name: np.array([columns[axis] for axis in "XYZ"]) for name, columns in found.items()}
