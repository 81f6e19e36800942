"""Shapes of the tip's path at published frequencies of a shaken clamp."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

from lab.ledger import Orbit
from results.ledger.findings import Finding
from results.ledger.rows import DIFFERS, REPRODUCED, LedgerRow, attributed, missing


def judge_orbit(row: LedgerRow, judgement: Orbit, findings: Sequence[Finding]) -> LedgerRow:
    """Ratios of the axes, by the first role and twist that has all published frequencies."""
    for role in judgement.role:
        for twist in judgement.twists:
            axes = _axes(findings, role, twist)
            if all((frequency, "minor_axis") in axes for frequency in row.published):
                ratios = [axes[f, "minor_axis"].value / axes[f, "major_axis"].value for f in row.published]
                return _verdict(attributed(row, [axes[row.published[0], "major_axis"]]), judgement, ratios)
    return missing(row, judgement)


def _axes(findings: Sequence[Finding], role: str, twist: float) -> Mapping[tuple[float, str], Finding]:
    """Axes of free orbits of a twist (rad) by frequency (Hz) and name, of the first model of the role."""
    inside = [
        f
        for f in findings
        if f.experiment == "BaseShake"
        and f.role == role
        and not f.against
        and not f.facts.get("tip_mass")
        and math.isclose(f.facts.get("twist", math.nan), twist, abs_tol=1e-6)
    ]
    return {(f.facts["frequency"], f.quantity): f for f in reversed(inside) if _source(f) == _source(inside[0])}


def _source(finding: Finding) -> tuple[str, str]:
    return finding.campaign, finding.model


def _verdict(row: LedgerRow, judgement: Orbit, ratios: list[float]) -> LedgerRow:
    oval = judgement.shape == "oval"
    good = [ratio >= judgement.ratio if oval else ratio <= judgement.ratio for ratio in ratios]
    bound = f"minor over major axis {'at least' if oval else 'at most'} {judgement.ratio:g}"
    shown = ", ".join(f"{ratio:.2f} at {f:g} Hz" for f, ratio in zip(row.published, ratios, strict=True))
    why = judgement.tolerance.why if judgement.tolerance else ""
    row = replace(row, ours=ratios, tolerance=f"{bound}: {why}", verdict=REPRODUCED if all(good) else DIFFERS)
    return row.because(f"ours are the ratios of the axes, {shown}")
