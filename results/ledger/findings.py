"""Numbers of a study by their names, and the choice of those that answer a published figure."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from lab.ledger import Select
from lab.units import from_si

#: Units of published figures that are names, not measures.
_COUNTED = frozenset({"-", "BL/s", "Shore A", "nodes", "elements", "steps", "designs", "links", "joints", "markers"})
#: Round-off of entries that vanish by symmetry, SI; no published figure is this small.
NOUGHT = 1e-9


@dataclass(frozen=True)
class Finding:
    """One number of a study.

    Parameters
    ----------
    quantity, unit, value
        Name, SI unit and SI value: ``k_yy``, ``tracking_error``, ``fit.k``, ``TwistedBeam.length`` ...
    model, role
        Performer (or specimen, experiment) and what it is, see ``lab.ledger.Role``; no role for inputs.
    campaign, experiment, sample
        Name of the campaign, kind of its experiment, name of the sample.
    against, reference_value
        Role of the reference that the number is about, and the reference's own value, SI.
    use
        ``in sample``, ``held out`` or ``not fitted``.
    error
        Standard error, SI.
    facts
        Further names and numbers by which it is chosen: ``topology``, ``phi`` (deg), ``frequency`` (Hz) ...
    note
        What a reader must know about it.
    """

    quantity: str
    unit: str
    value: float
    model: str = ""
    role: str = ""
    campaign: str = ""
    experiment: str = ""
    sample: str = ""
    against: str = ""
    reference_value: float = math.nan
    use: str = ""
    error: float = math.nan
    facts: Mapping[str, Any] = field(default_factory=dict)
    note: str = ""

    def shown(self, unit: str) -> float:
        """The value in the unit of a published figure."""
        return self.value if unit in _COUNTED else from_si(self.value, self.unit, unit)


def choose(findings: Sequence[Finding], select: Select) -> list[Finding]:
    """What ``select`` names, all samples of one model in one campaign: the first that the preferences lead to."""
    found = [
        f
        for f in findings
        if f.quantity == select.quantity
        and select.experiment in ("", f.experiment)
        and select.topology in ("", f.facts.get("topology"))
        and math.isfinite(f.value)
    ]
    for name in ("role", "against", "use"):
        present = [wish for wish in getattr(select, name) if any(getattr(f, name) == wish for f in found)]
        if getattr(select, name):
            found = [f for f in found if present and getattr(f, name) == present[0]]
    return [f for f in found if (f.model, f.campaign) == (found[0].model, found[0].campaign)]


def difference(ours: Any, published: Any) -> float:
    """Difference over the published size: the largest of a list, over the list's largest; NaN for words."""
    if isinstance(published, str):
        return math.nan
    mine, theirs = np.atleast_1d(ours).astype(float), np.atleast_1d(published).astype(float)
    size = float(np.abs(theirs).max())
    off = mine - theirs
    return float(off[np.argmax(np.abs(off))] / size) if size else math.nan


def four_digits(value: float) -> str:
    """Text of a number for people; nought where it vanishes but for round-off."""
    return "0" if abs(value) < NOUGHT else f"{value:.4g}"
