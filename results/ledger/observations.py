"""What the text observes in words of the tip's path: each a rule over a sweep, held against our orbits."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from lab.ledger import Observed
from lab.orbits import LINE, reversals
from lab.published import figures
from results.ledger.findings import Finding
from results.ledger.rows import DIFFERS, REPRODUCED, LedgerRow, attributed, missing
from results.ledger.shakes import Shake, by_source, close, free, of_role

_QUARTER = math.pi / 2
#: Fewer samples than this are no sweep.
_SWEEP = 10


@dataclass(frozen=True)
class _Answer:
    """Whether the rule holds, our value in words, what else a reader should know, and an orbit that it rests on."""

    holds: bool
    ours: str
    why: str
    orbit: Shake


def judge_observation(row: LedgerRow, judgement: Observed, findings: Sequence[Finding]) -> LedgerRow:
    """The verdict of the first model, by the order of the roles, that was shaken as the rule needs."""
    for role in judgement.role:
        shakes = of_role(findings, role)
        for model in dict.fromkeys(s.source.model for s in shakes):
            mine = [s for s in shakes if s.source.model == model]
            if answer := _RULES[judgement.observation](mine, judgement):
                row = replace(attributed(row, [answer.orbit.source]), ours=answer.ours)
                row = replace(row, tolerance=f"rule: {judgement.tolerance.why}").because(answer.why)
                return replace(row, verdict=REPRODUCED if answer.holds else DIFFERS)
    return missing(row, judgement)


def _across_the_axis(shakes: Sequence[Shake], _: Observed) -> _Answer | None:
    swept = _over_frequency(free(shakes), _QUARTER)
    if len(swept) < _SWEEP:
        return None
    shares = [s.numbers["span_x"] / max(s.numbers["span_y"], s.numbers["span_z"]) for s in swept]
    return _Answer(
        max(shares) < 0.5, f"along x at most {max(shares):.2g} of the extent across",
        f"largest at {swept[int(np.argmax(shares))].facts['frequency']:g} Hz", swept[0],
    )  # fmt: skip


def _grows_with_twist(shakes: Sequence[Shake], _: Observed) -> _Answer | None:
    swept = _over_twist(free(shakes))
    twists = sorted(twist for twist in swept if twist >= -1e-9)
    if len(twists) < _SWEEP:
        return None
    spans = np.array([swept[twist].numbers["span_y"] for twist in twists])
    grown = int(np.count_nonzero(np.diff(spans) > 0))
    largest = int(np.argmax(spans))
    return _Answer(
        grown == len(spans) - 1, f"grows in {grown} of {len(spans) - 1} steps",
        f"extent along y {1e3 * spans[0]:.3g} mm at {_degrees(twists[0])}, at most {1e3 * spans[largest]:.3g} mm at "
        f"{_degrees(twists[largest])}, {1e3 * spans[-1]:.3g} mm at {_degrees(twists[-1])}",
        swept[twists[largest]],
    )  # fmt: skip


def _mirrored(shakes: Sequence[Shake], judgement: Observed) -> _Answer | None:
    swept = _over_twist(free(shakes))
    pairs = [(swept[twist], swept[-twist]) for twist in swept if twist > 1e-9 and -twist in swept]
    if len(pairs) < _SWEEP:
        return None
    off = max(max(_unlike(one, other)) for one, other in pairs)
    allowed = judgement.tolerance.share or 0.0
    ours = f"{len(pairs)} pairs mirrored within {100 * off:.2g} %"
    return _Answer(
        off <= allowed, ours, "axes, tilt and signed ratio of the axes; see also the mirror law", pairs[0][0]
    )


def _unlike(one: Shake, other: Shake) -> tuple[float, ...]:
    """How far two orbits are from being mirror images: major axis, signed ratio of the axes, direction of the axis."""
    majors = one.numbers["major_axis"], other.numbers["major_axis"]
    # Of a nearly round orbit the direction of the axis means little.
    turned = (1.0 - abs(one.ratio)) * abs(math.sin(one.numbers["tilt"] + other.numbers["tilt"]))
    return abs(majors[0] / majors[1] - 1.0), abs(one.ratio + other.ratio), turned


def _sense_by_chirality(shakes: Sequence[Shake], _: Observed) -> _Answer | None:
    right, left = (_at_frequencies(free(shakes), twist) for twist in (_QUARTER, -_QUARTER))
    both = [f for f in right if f in left and min(abs(right[f].ratio), abs(left[f].ratio)) >= LINE]
    if len(both) < _SWEEP:
        return None
    opposite = [f for f in both if right[f].ratio * left[f].ratio < 0.0]
    senses = {np.sign(right[f].ratio) for f in both}
    kept = "one sense at all frequencies" if len(senses) == 1 else "each sense reverses along the sweep"
    ours = f"opposite at {len(opposite)} of {len(both)} frequencies"
    return _Answer(len(opposite) == len(both), ours, f"{kept}; lines have no sense", right[both[0]])


def _loaded_more_elliptic(shakes: Sequence[Shake], _: Observed) -> _Answer | None:
    corners, bare = _loaded(shakes), _at_frequencies(free(shakes), -_QUARTER)
    if not corners or len(bare) < _SWEEP:
        return None
    shared = sorted(set(bare).intersection(*corners.values()))
    lower = shared[: (len(shared) + 1) // 2]
    if not lower:
        return None
    without = float(np.mean([abs(bare[f].ratio) for f in lower]))
    means = {corner: float(np.mean([abs(orbits[f].ratio) for f in lower])) for corner, orbits in corners.items()}
    shown = ", ".join(f"{corner} {mean:.2f}" for corner, mean in means.items())
    more = sum(mean > without for mean in means.values())
    return _Answer(
        more == len(means), f"at {more} of {len(means)} corners",
        f"mean ratio of the axes up to {lower[-1]:g} Hz: {shown}; without load {without:.2f}",
        next(iter(corners.values()))[lower[0]],
    )  # fmt: skip


def _reverses_at_all_corners(shakes: Sequence[Shake], _: Observed) -> _Answer | None:
    places = _reversals(shakes)
    if len(places) < len(_CORNERS):
        return None
    shown = "; ".join(f"{corner} {_listed(found)}" for corner, (found, _) in places.items())
    some = sum(bool(found) for found, _ in places.values())
    return _Answer(some == len(places), f"at {some} of {len(places)} corners", shown, next(iter(places.values()))[1])


def _reversal_depends_on_corner(shakes: Sequence[Shake], judgement: Observed) -> _Answer | None:
    places = _reversals(shakes)
    if len(places) < len(_CORNERS):
        return None
    firsts = [found[0] for found, _ in places.values() if found]
    spread = max(firsts) - min(firsts) if firsts else 0.0
    shown = "; ".join(f"{corner} {_listed(found)}" for corner, (found, _) in places.items())
    numbers = len({len(found) for found, _ in places.values()}) > 1
    return _Answer(
        spread > (judgement.tolerance.absolute or 0.0) or numbers, f"first reversals {spread:.3g} Hz apart", shown,
        next(iter(places.values()))[1],
    )  # fmt: skip


_CORNERS = ("lower-left", "lower-right", "upper-left", "upper-right")


def _loaded(shakes: Sequence[Shake]) -> dict[str, dict[float, Shake]]:
    """Orbits by frequency at every corner, published load, twist -90 deg, of the first campaign that has all."""
    load = figures()["c5-offset-load"]["value"]
    for source in by_source([s for s in shakes if close(s.facts.get("load", math.nan), load)]):
        found = {
            corner: _at_frequencies([s for s in source if s.facts["corner"] == corner], -_QUARTER)
            for corner in _CORNERS
        }
        if all(len(orbits) >= _SWEEP for orbits in found.values()):
            return found
    return {}


def _reversals(shakes: Sequence[Shake]) -> dict[str, tuple[list[float], Shake]]:
    """Frequencies of the reversals, Hz, at every corner, with one of the orbits."""
    found = {}
    for corner, orbits in _loaded(shakes).items():
        frequencies = np.array(sorted(orbits))
        ratios = np.array([orbits[f].ratio for f in frequencies])
        found[corner] = [r.at for r in reversals(frequencies, ratios)], orbits[frequencies[0]]
    return found


def _listed(frequencies: Sequence[float]) -> str:
    return ", ".join(f"{f:.1f} Hz" for f in frequencies) or "none"


def _over_frequency(shakes: Sequence[Shake], twist: float) -> list[Shake]:
    """Orbits at a twist (rad), in ascending order of the frequency."""
    found = _at_frequencies(shakes, twist)
    return [found[f] for f in sorted(found)]


def _at_frequencies(shakes: Sequence[Shake], twist: float) -> dict[float, Shake]:
    """Orbits by frequency, Hz, at a twist (rad); of several campaigns the first counts."""
    found: dict[float, Shake] = {}
    for shake in shakes:
        if close(shake.facts["twist"], twist):
            found.setdefault(round(shake.facts["frequency"], 9), shake)
    return found


def _over_twist(shakes: Sequence[Shake]) -> dict[float, Shake]:
    """Orbits by twist, rad, in the campaign and at the frequency that have most of them."""
    sweeps: dict[tuple[str, float], dict[float, Shake]] = {}
    for shake in shakes:
        key = (shake.source.campaign, shake.facts["frequency"])
        sweeps.setdefault(key, {})[round(shake.facts["twist"], 9)] = shake
    return max(sweeps.values(), key=len, default={})


def _degrees(angle: float) -> str:
    return f"{math.degrees(angle):.0f} deg"


_RULES: Mapping[str, Callable[[Sequence[Shake], Observed], _Answer | None]] = {
    "across-the-axis": _across_the_axis,
    "grows-with-twist": _grows_with_twist,
    "mirrored": _mirrored,
    "sense-by-chirality": _sense_by_chirality,
    "loaded-more-elliptic": _loaded_more_elliptic,
    "reverses-at-all-corners": _reverses_at_all_corners,
    "reversal-depends-on-corner": _reversal_depends_on_corner,
}
