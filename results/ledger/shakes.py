"""Shaken samples as the ledger sees them: numbers of one orbit together with what was shaken and how."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any

from results.ledger.findings import Finding


@dataclass(frozen=True)
class Shake:
    """Numbers of one orbit by name, SI, what its record says of itself, and one of the findings that it came in."""

    numbers: Mapping[str, float]
    facts: Mapping[str, Any]
    source: Finding

    @property
    def ratio(self) -> float:
        """Minor over major axis with the sign of the sense of travel."""
        return self.numbers["axis_ratio"]


def of_role(findings: Iterable[Finding], role: str) -> list[Shake]:
    """Every shaken sample of models of a role, see ``lab.ledger.Role``, in the order of the findings."""
    inside = [f for f in findings if f.experiment == "BaseShake" and f.role == role and not f.against]
    found: dict[tuple[str, str, str], list[Finding]] = {}
    for finding in inside:
        found.setdefault((finding.campaign, finding.model, finding.sample), []).append(finding)
    return [Shake({f.quantity: f.value for f in items}, items[0].facts, items[0]) for items in found.values()]


def free(shakes: Iterable[Shake]) -> list[Shake]:
    """Those whose tip carries nothing."""
    return [s for s in shakes if not s.facts.get("tip_mass") and "corner" not in s.facts]


def by_source(shakes: Sequence[Shake]) -> Iterator[list[Shake]]:
    """Shakes of one campaign and model at a time."""
    for _, group in groupby(shakes, key=lambda s: (s.source.campaign, s.source.model)):
        yield list(group)


def close(value: float, other: float) -> bool:
    """Whether two swept angles (rad) or frequencies (Hz) are the same but for rounding."""
    return math.isclose(value, other, abs_tol=1e-6)
