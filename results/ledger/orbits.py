"""Shapes of the tip's path at published frequencies of a shaken clamp."""

from collections.abc import Sequence
from dataclasses import replace

from lab.ledger import Orbit
from results.ledger.findings import Finding
from results.ledger.rows import DIFFERS, REPRODUCED, LedgerRow, attributed, missing
from results.ledger.shakes import by_source, close, free, of_role


def judge_orbit(row: LedgerRow, judgement: Orbit, findings: Sequence[Finding]) -> LedgerRow:
    """Ratios of the axes, by the first role, twist and model that has all published frequencies."""
    for role in judgement.role:
        for twist in judgement.twists:
            for shakes in by_source(free(of_role(findings, role))):
                axes = {s.facts["frequency"]: s for s in shakes if close(s.facts["twist"], twist)}
                if all(frequency in axes for frequency in row.published):
                    chosen = [axes[f] for f in row.published]
                    ratios = [s.numbers["minor_axis"] / s.numbers["major_axis"] for s in chosen]
                    return _verdict(attributed(row, [chosen[0].source]), judgement, ratios)
    return missing(row, judgement)


def _verdict(row: LedgerRow, judgement: Orbit, ratios: list[float]) -> LedgerRow:
    oval = judgement.shape == "oval"
    good = [ratio >= judgement.ratio if oval else ratio <= judgement.ratio for ratio in ratios]
    bound = f"minor over major axis {'at least' if oval else 'at most'} {judgement.ratio:g}"
    shown = ", ".join(f"{ratio:.2f} at {f:g} Hz" for f, ratio in zip(row.published, ratios, strict=True))
    why = judgement.tolerance.why if judgement.tolerance else ""
    row = replace(row, ours=ratios, tolerance=f"{bound}: {why}", verdict=REPRODUCED if all(good) else DIFFERS)
    return row.because(f"ours are the ratios of the axes, {shown}")
