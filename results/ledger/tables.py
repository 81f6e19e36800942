"""The ledger as files: CSV for programs, JSON for the report, Markdown and HTML for people."""

import csv
import io
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from typing import Any

from lab.ledger import Contradiction
from results.ledger.findings import four_digits
from results.ledger.rows import ARITHMETIC, CANNOT, DIFFERS, INPUT, NOT_HERE, NOT_YET, REPRODUCED, LedgerRow, counts

HEADER = tuple(field.name for field in fields(LedgerRow))
#: What a reader needs to know about the verdicts.
ABOUT = (
    "Every figure that the dissertation publishes, with our value. Reproduced and differs: by a tolerance that was set "
    "from what is known of the published figure, whatever ours is. Arithmetic on the text's figures only shows that "
    "they agree with each other. A figure called in sample was seen by the fit behind our value."
)
#: Columns of the tables for people.
COLUMNS = ("figure", "section", "published", "ours", "by", "difference", "within", "verdict", "because", "command")
_PARTS = (
    ("Compared", (REPRODUCED, DIFFERS), True),
    ("Not in this study", (NOT_HERE,), True),
    ("Not yet", (NOT_YET,), False),
    ("Inputs", (INPUT,), False),
    ("Cannot be tested", (CANNOT,), False),
)


@dataclass(frozen=True)
class Part:
    """Rows of some verdicts as text: ``opened`` where the report shows them at once."""

    title: str
    opened: bool
    rows: tuple[tuple[str, ...], ...]


@dataclass(frozen=True)
class LedgerView:
    """The ledger for people; ``arithmetic`` counts figures compared with the text's own only."""

    counts: Mapping[str, int]
    arithmetic: int
    parts: tuple[Part, ...]
    contradictions: tuple[Contradiction, ...]
    about: str = ABOUT
    columns: tuple[str, ...] = COLUMNS


def view(rows: Sequence[LedgerRow], contradictions: Sequence[Contradiction]) -> LedgerView:
    """Tables of the rows, verdict by verdict."""
    parts = (
        Part(title, opened, tuple(cells(row) for row in rows if row.verdict in verdicts))
        for title, verdicts, opened in _PARTS
    )
    arithmetic = sum(row.origin == ARITHMETIC for row in rows)
    return LedgerView(counts(rows), arithmetic, tuple(part for part in parts if part.rows), tuple(contradictions))


def summary(ledger: LedgerView) -> str:
    """Counts by verdict in a sentence."""
    numbers = ", ".join(f"{number} {verdict}" for verdict, number in ledger.counts.items())
    return f"{numbers}; {ledger.arithmetic} of the compared by arithmetic on the text's own figures"


def cells(row: LedgerRow) -> tuple[str, ...]:
    """A row as text under ``COLUMNS``."""
    difference = "" if math.isnan(row.relative_difference) else f"{row.relative_difference:+.1%}"
    by = ", ".join(text for text in (row.origin, row.model, row.use) if text)
    others = f"Others: {row.others}" if row.others else ""
    reading = f"Our reading: {row.reading}" if row.reading else ""
    because = ". ".join(text for text in (row.why, others, reading) if text)
    return (
        f"{row.quantity} ({row.id})", row.section, _shown(row.published, row.unit), _shown(row.ours, row.unit), by,
        difference.replace("-0.0%", "+0.0%"), row.tolerance.partition(": ")[0], row.verdict, because, row.command,
    )  # fmt: skip


def _shown(value: Any, unit: str) -> str:
    if value is None:
        return ""
    return f"{_digits(value)} {'' if unit == '-' else unit}".strip()


def _digits(value: Any) -> str:
    if isinstance(value, list):
        return f"[{', '.join(map(_digits, value))}]"
    return value if isinstance(value, str) else four_digits(value)


def to_csv(rows: Sequence[LedgerRow]) -> str:
    """One line per published figure; lists as JSON, empty cells for what does not exist."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(HEADER)
    for row in rows:
        writer.writerow([_cell(getattr(row, name)) for name in HEADER])
    return text.getvalue()


def _cell(value: Any) -> Any:
    if isinstance(value, list):
        return json.dumps(value)
    if isinstance(value, float):
        return "" if math.isnan(value) else f"{value:.12g}"
    return "" if value is None else value


def to_json(rows: Sequence[LedgerRow], contradictions: Sequence[Contradiction]) -> str:
    """Counts, rows and contradictions, for the stage that shows them."""
    lines = [{k: None if isinstance(v, float) and math.isnan(v) else v for k, v in asdict(r).items()} for r in rows]
    data = {
        "counts": counts(rows),
        "rows": lines,
        "contradictions": [c.model_dump(mode="json") for c in contradictions],
    }
    return json.dumps(data, indent=1) + "\n"


def from_json(text: str) -> LedgerView:
    """What ``to_json`` wrote, for people."""
    data = json.loads(text)
    rows = [
        LedgerRow(**{**line, "relative_difference": math.nan if (d := line["relative_difference"]) is None else d})
        for line in data["rows"]
    ]
    return view(rows, [Contradiction.model_validate(item) for item in data["contradictions"]])


def to_markdown(ledger: LedgerView) -> str:
    """Markdown document of the whole ledger."""
    return "\n\n".join(_markdown(ledger)) + "\n"


def _markdown(ledger: LedgerView) -> Iterator[str]:
    yield "# Published figures"
    yield ledger.about
    yield summary(ledger)
    for part in ledger.parts:
        yield f"## {part.title}"
        yield _grid(ledger.columns, part.rows)
    yield "## Where the text contradicts itself"
    lines = [(c.about, *map("; ".join, (c.says, c.follows)), c.reading, c.because) for c in ledger.contradictions]
    yield _grid(("about", "the text says", "what follows", "our reading", "because"), lines)


def _grid(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = (header, ["---"] * len(header), *rows)
    return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in lines)
