"""Benchmarks: run the modules of ``benchmarks/``, print their rows and keep them as a table."""

import csv
import os
import re
import sys
import traceback
from collections.abc import Iterable, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from time import perf_counter
from typing import Any

from pipeline.study import StudyError

ROOT = Path(__file__).resolve().parent.parent
TABLE = Path("runs") / "bench" / "benchmarks.csv"
COLUMNS = ("name", "value", "unit", "peer", "peer value", "ratio", "goal", "met")
Row = dict[str, Any]

_COMPARISONS = {"<": float.__lt__, "<=": float.__le__, ">": float.__gt__, ">=": float.__ge__}
_NUMBER = r"([-+]?[\d.]+(?:e[-+]?\d+)?)"


def benchmarks(folder: Path = ROOT / "benchmarks") -> list[str]:
    """Names of the modules in ``folder`` that are benchmarks."""
    return sorted(path.stem for path in folder.glob("*.py") if not path.stem.startswith("_"))


def bench(names: Sequence[str], output: Path = TABLE, folder: Path = ROOT / "benchmarks") -> bool:
    """Run benchmarks, print their rows, and write them to ``output``, where other benchmarks' rows stay.

    Parameters
    ----------
    names
        Modules of ``folder``; all when there are none.
    output
        CSV file; written anew after every benchmark.

    Returns
    -------
    bool
        Whether all could be run; goals that are missed do not count.

    Raises
    ------
    StudyError
        For a name that is not there.
    """
    known = benchmarks(folder)
    if strangers := [name for name in names if name not in known]:
        raise StudyError(f"no benchmark {', '.join(map(repr, strangers))}; there are {', '.join(known) or 'none'}")
    sys.path.insert(0, str(folder.parent))
    well, rows = True, []
    for name in names or known:
        begin = perf_counter()
        _say(f"{name}: running, load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
        try:
            fresh = [finished(name, row) for row in import_module(f"{folder.name}.{name}").rows()]
        except Exception:
            well = False
            traceback.print_exc()
            _say(f"{name}: stopped by the error above")
            continue
        _say(f"{name}: {perf_counter() - begin:.0f} s")
        rows += fresh
        write(output, [row for row in read(output) if not row["name"].startswith(f"{name}: ")] + fresh)
    show(rows)
    return well


def finished(benchmark: str, row: Mapping[str, Any]) -> Row:
    """Row in the columns of the table: its benchmark's name in front, and whether its goal is met."""
    line: Row = {column: row.get(column.replace(" ", "_")) for column in COLUMNS[:-1]}
    numbers = {key: None if line[key] is None else float(line[key]) for key in ("value", "peer value", "ratio")}
    return line | numbers | {"name": f"{benchmark}: {line['name']}", "met": met(line)}


def met(row: Mapping[str, Any]) -> str:
    """``yes`` or ``no``; "" without goal, and where the peer is missing that the goal refers to.

    Examples
    --------
    >>> met({"value": 2.0, "ratio": 12.0, "goal": ">= 10"}), met({"value": 2.0, "goal": "< 1.5"})
    ('yes', 'no')
    """
    goal, ratio = str(row.get("goal") or ""), row.get("ratio")
    subject = re.match(r"(ratio|value)\b", goal)
    absent = "missing" in str(row.get("peer") or "")
    number = row.get(subject[1]) if subject else None if absent else row.get("value") if ratio is None else ratio
    if number is None:
        return ""
    if between := re.search(rf"{_NUMBER} to {_NUMBER}", goal):
        return "yes" if float(between[1]) <= float(number) <= float(between[2]) else "no"
    if bound := re.search(rf"(<=|>=|<|>)\s*{_NUMBER}", goal):
        return "yes" if _COMPARISONS[bound[1]](float(number), float(bound[2])) else "no"
    return ""


def read(path: Path) -> list[Row]:
    """Rows of an earlier table; none where there is none."""
    if not path.exists():
        return []
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def write(path: Path, rows: Iterable[Row]) -> None:
    """Replace the table as a whole."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    with temporary.open("w", encoding="utf-8", newline="") as file:
        lines = csv.DictWriter(file, COLUMNS)
        lines.writeheader()
        lines.writerows({column: _exact(row.get(column)) for column in COLUMNS} for row in rows)
    temporary.replace(path)


def show(rows: Iterable[Row]) -> None:
    """Print rows as a table."""
    from rich.console import Console
    from rich.table import Table

    table = Table(*COLUMNS[:-1], "met")
    for column in table.columns:
        column.justify = "right" if column.header in ("value", "peer value", "ratio") else "left"
    for row in rows:
        colour = {"yes": "[green]yes", "no": "[red]no"}.get(row["met"], "")
        table.add_row(*(_short(row[column]).replace("[", r"\[") for column in COLUMNS[:-1]), colour)
    console = Console()
    if not console.is_terminal:
        console.width = 170
    console.print(table)


def _exact(value: Any) -> str:
    return "" if value is None else f"{value:.6g}" if isinstance(value, float) else str(value)


def _short(value: Any) -> str:
    return "" if value is None else f"{value:.4g}" if isinstance(value, float) else str(value)


def _say(text: str) -> None:
    sys.stderr.write(f"bench: {text}\n")
    sys.stderr.flush()
