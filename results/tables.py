"""Accuracy tables for people: console, Markdown and HTML from one layout; ``accuracy.csv`` for programs."""

import csv
import io
import json
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass

from lab.measures import TRACKING_ERROR_DEFINITION
from results.accuracy import HEADER, IN_SAMPLE, Row, as_cells

#: SI unit to the factor and unit that a person reads.
_SHOWN = {"m": (1e3, "mm"), "rad": (180.0 / math.pi, "deg")}
#: The same for numbers that stand alone, where tables of one unit do not ask for the plain one.
_ALONE = {**_SHOWN, "Pa": (1e-6, "MPa"), "s": (1e3, "ms"), "kg": (1e3, "g"), "1": (1.0, ""), "dimensionless": (1.0, "")}
#: A layout with more lines is a detail.
_LONG = 100
#: Round-off of entries that vanish by symmetry, SI; no quantity of the tables is this small.
_NOUGHT = 1e-9
MARKS = (
    "value (error against the reference); * in sample: the fit behind the model has seen this number; "
    f"a dash: the model has no such number. {TRACKING_ERROR_DEFINITION}."
)


@dataclass(frozen=True)
class Table:
    """Cells as text, first row the header.

    ``detail``: for who asks; left out of the console, folded in the report.
    """

    title: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    notes: tuple[str, ...] = ()
    detail: bool = False


def layout(title: str, rows: Sequence[Row]) -> Table:
    """Samples and quantities down, the reference and every model across."""
    models = list(dict.fromkeys(row.model for row in rows))
    reference = f"{rows[0].reference} ({rows[0].reference_origin})"
    cells: dict[tuple[str, str, str], dict[str, str]] = {}
    references: dict[tuple[str, str, str], str] = {}
    for row in rows:
        key = (row.sample, row.quantity, row.unit)
        cells.setdefault(key, {})[row.model] = _cell(row)
        references[key] = (
            _number(row, row.reference_value) if row.reference_value and row.quantity != "speed_up" else ""
        )
    lines = tuple(
        (sample, f"{quantity.replace('_', ' ') if len(quantity) > 4 else quantity}{_unit(quantity, unit)}",
         references[sample, quantity, unit], *(line.get(model, "") for model in models))
        for (sample, quantity, unit), line in cells.items()
    )  # fmt: skip
    notes = tuple(dict.fromkeys(f"{row.model}: {row.note}" for row in rows if row.note))
    return Table(title, ("sample", "quantity", reference, *models), lines, notes, len(lines) > _LONG)


def _unit(quantity: str, unit: str) -> str:
    if quantity == "tracking_error":
        return " [%]"
    return "" if unit == "1" else f" [{_SHOWN.get(unit, (1, unit))[1]}]"


def shown(value: float | None, unit: str) -> str:
    """An SI number as text in the unit that a person reads; a dash where there is none."""
    if value is None or not math.isfinite(value):
        return "-"
    factor, name = _ALONE.get(unit, (1.0, unit))
    # Without the sign of a nought.
    return f"{value * factor + 0.0:.4g} {name}".rstrip()


def _number(row: Row, value: float) -> str:
    factor = 100.0 if row.quantity == "tracking_error" else _SHOWN.get(row.unit, (1.0, ""))[0]
    if abs(value) < _NOUGHT:
        return "0"
    text = f"{value * factor:.4g}"
    return f"{value * factor:.0f}" if "e+" in text and abs(value * factor) < 1e9 else text


def _cell(row: Row) -> str:
    if math.isnan(row.value):
        return "-"
    mark = " *" if row.use == IN_SAMPLE else ""
    derived = row.quantity in ("tracking_error", "tracking_rms", "speed_up") or math.isnan(row.relative_error)
    error = "" if derived else f" ({row.relative_error:+.0%})"
    return f"{_number(row, row.value)}{error}{mark}"


def to_csv(rows: Sequence[Row]) -> str:
    """Tidy CSV, one line per number, SI units, empty cells for numbers that do not exist."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(HEADER)
    writer.writerows(as_cells(row) for row in rows)
    return text.getvalue()


def to_json(tables: Sequence[Table]) -> str:
    """Tables as JSON, for the stages that show them."""
    return json.dumps([asdict(table) for table in tables], indent=1) + "\n"


def from_json(text: str) -> list[Table]:
    """What ``to_json`` wrote."""
    return [
        Table(t["title"], tuple(t["header"]), tuple(map(tuple, t["rows"])), tuple(t["notes"]), t["detail"])
        for t in json.loads(text)
    ]


def to_markdown(tables: Sequence[Table]) -> str:
    """Markdown document of all tables."""
    parts = ["# Accuracy", MARKS]
    for table in tables:
        lines = [table.header, tuple("---" for _ in table.header), *table.rows]
        parts.append(f"## {table.title}")
        parts.append("\n".join("| " + " | ".join(line) + " |" for line in lines))
        parts.extend(f"- {note}" for note in table.notes)
    return "\n\n".join(parts) + "\n"


def to_console(tables: Sequence[Table]) -> None:
    """Print the tables to the terminal, but for those of details."""
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table as Grid

    console = Console()
    if not console.is_terminal:
        console = Console(width=200)
    for table in (table for table in tables if not table.detail):
        grid = Grid(title=escape(table.title), title_justify="left")
        for name in table.header:
            grid.add_column(escape(name), overflow="fold")
        firsts = [line[0] for line in table.rows]
        grouped, last = len(set(firsts)) < len(firsts), None
        for line in table.rows:
            if grouped and last not in (None, line[0]):
                grid.add_section()
            grid.add_row(escape(line[0]) if line[0] != last else "", *map(escape, line[1:]))
            last = line[0]
        console.print(grid)
        for note in table.notes:
            console.print(f"  {note}", highlight=False, markup=False)
    if details := sum(table.detail for table in tables):
        console.print(f"{details} more tables of details stand in accuracy.md", highlight=False, markup=False)
    console.print(MARKS, highlight=False, markup=False)
