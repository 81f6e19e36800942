"""The HTML report: one file, pictures inside, tables first."""

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from results.ledger.tables import LedgerView
from results.tables import MARKS, Table


@dataclass(frozen=True)
class Picture:
    """A PNG with its caption.

    Parameters
    ----------
    file, caption
        Picture and what it shows.
    group
        Heading that it stands under: a campaign, or ``fits``.
    folded
        Shown on demand: one of many of a kind.
    """

    file: Path
    caption: str
    group: str
    folded: bool = False

    def data_uri(self) -> str:
        """The picture as a data URI."""
        return "data:image/png;base64," + base64.b64encode(self.file.read_bytes()).decode()


def render(
    title: str,
    tables: Sequence[Table],
    pictures: Sequence[Picture],
    left_out: str,
    assumptions: Sequence[str],
    holes: Sequence[Mapping[str, Any]],
    provenance: Mapping[str, Any],
    ledger: LedgerView | None = None,
) -> str:
    """HTML text of the report."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    folder = Path(__file__).parent / "templates"
    environment = Environment(
        loader=FileSystemLoader(folder), autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
    groups = {group: [p for p in pictures if p.group == group] for group in dict.fromkeys(p.group for p in pictures)}
    return environment.get_template("report.html.jinja").render(
        title=title, tables=tables, groups=groups, left_out=left_out, assumptions=assumptions, holes=holes,
        provenance=provenance, marks=MARKS, ledger=ledger,
    )  # fmt: skip
