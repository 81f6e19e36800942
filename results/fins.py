"""What tables, figures and ledger share about tubes with fins: whether it is the text's, and what is flat."""

import math
from collections.abc import Mapping
from typing import Any

from lab.experiments.fin_drive import FIN_STAGES
from lab.published import figures
from lab.records import Record
from lab.specimens import FinnedTube
from results.effects import Effect

#: Name of the device of table 4.1 in judgements of the ledger.
TABLE = "table-4-1"
#: What table 4.1 says; both angles are what the text sweeps.
_PUBLISHED = ("diameter", "length", "wall", "fin_thickness")
_ANGLES = ("fin_arc", "attachment_angle")
_CHAMBERS = ("number", "width", "height", "length", "wall")
PSI = 6894.757293168

#: An effect smaller than this share of the mean is negligible, a correlation stronger than that is high: ASSUMED,
#: since the text has words only.
NEGLIGIBLE, CORRELATED = 0.10, 0.9
#: A motion across that varies by less than this share of the travel does not show beside it: ASSUMED.
_UNSEEN = 0.01


def is_negligible(found: Effect, beside: Effect | None = None) -> bool:
    """Whether a sweep hardly changes a result, by itself or beside another one, as y beside s."""
    unseen = beside is not None and found.range < _UNSEEN * abs(beside.mean)
    return found.spread < NEGLIGIBLE or unseen


def full_pinch() -> float:
    """Approach of top and bottom at the full pinch of 4.4.1, m."""
    return float(figures()["c4-fea-pinch"]["value"])


def published_device(specimen: Mapping[str, Any]) -> str:
    """``TABLE`` for a specimen (plain data, SI) of table 4.1 with any two angles; empty for any other."""
    if specimen.get("kind") != "FinnedTube":
        return ""
    known = FinnedTube()
    pairs = [
        *((specimen[name], getattr(known, name)) for name in _PUBLISHED),
        *((specimen["chambers"][name], getattr(known.chambers, name)) for name in _CHAMBERS),
        (specimen["material"]["youngs_modulus"], known.material.youngs_modulus),
    ]
    return TABLE if all(math.isclose(ours, theirs) for ours, theirs in pairs) else ""


def is_prototype(specimen: Mapping[str, Any]) -> bool:
    """Whether the angles are those of the table too."""
    known = FinnedTube()
    return bool(published_device(specimen)) and all(
        math.isclose(specimen[name], getattr(known, name), rel_tol=1e-6) for name in _ANGLES
    )


def flattened_by(record: Record) -> float:
    """Approach of top and bottom while the plate pushes, m; NaN where it never came to that."""
    if "stage" not in record.channels:
        return math.nan
    pushing = record["stage"] == FIN_STAGES.index("push")
    return float(record["travel"][pushing][0]) if pushing.any() else math.nan
