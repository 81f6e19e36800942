"""One published figure with our value and a verdict: the line of the ledger."""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from lab.ledger import Judgement
from results.ledger.findings import Finding

REPRODUCED, DIFFERS, NOT_YET = "reproduced", "differs", "not yet"
CANNOT, INPUT, NOT_HERE = "cannot be tested", "input", "not in this study"
#: Origin of what follows from the text's own figures.
ARITHMETIC = "arithmetic on the text's figures"
VERDICTS = (REPRODUCED, DIFFERS, NOT_HERE, NOT_YET, INPUT, CANNOT)


@dataclass(frozen=True)
class LedgerRow:
    """One published figure as a line of ``ledger.csv``; NaN, None and empty text where there is nothing to say.

    Parameters
    ----------
    id, section, quantity, published, unit, kind
        As published: a number, a list, or words.
    ours, origin, model, use
        Our value in the same unit, what made it, and whether a fit behind it has seen the published one.
    relative_difference
        (ours - published) / size of what is published.
    tolerance, verdict, why
        How far ours may be off, one of ``VERDICTS``, and what it rests on.
    others
        What other models say.
    command
        That makes our value.
    contradiction, reading
        Where the text disagrees with itself about this figure: what it says, and how we read it.
    """

    id: str
    section: str
    quantity: str
    published: Any
    unit: str
    kind: str
    ours: Any = None
    origin: str = ""
    model: str = ""
    use: str = ""
    relative_difference: float = math.nan
    tolerance: str = ""
    verdict: str = ""
    why: str = ""
    others: str = ""
    command: str = ""
    contradiction: str = ""
    reading: str = ""

    def because(self, *reasons: str) -> "LedgerRow":
        """The row with further reasons."""
        return replace(self, why=". ".join(text.rstrip(".") for text in (self.why, *reasons) if text))


def counts(rows: Sequence[LedgerRow]) -> dict[str, int]:
    """Number of figures by verdict, in the order of ``VERDICTS``."""
    found = Counter(row.verdict for row in rows)
    return {verdict: found[verdict] for verdict in VERDICTS}


def missing(row: LedgerRow, judgement: Judgement) -> LedgerRow:
    """The row of a figure that the study in hand does not answer."""
    if judgement.by is None:
        return replace(row, verdict=NOT_HERE)
    return replace(row, verdict=NOT_YET, why=f"{judgement.by}: {row.why}" if row.why else judgement.by)


def attributed(row: LedgerRow, chosen: Sequence[Finding]) -> LedgerRow:
    """The row with origin, model and use of what was chosen, and with its notes."""
    first = chosen[0]
    against = f" against {first.against}" if first.against not in ("", "lab") else ""
    model = f"{first.model} ({len(chosen)} samples)" if len(chosen) > 1 else first.model
    row = replace(row, origin=first.role + against, model=model, use=first.use)
    return row.because(*dict.fromkeys(f.note for f in chosen))
