"""Rules by which the text's sayings of pinched tubes are judged, each over the records of one model."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.pinching import distinct
from results.ledger.findings import Finding
from results.pinch_symmetry import axis_steps, imaged, images
from results.tubes import RECOVERED, way

Array = NDArray[np.float64]

#: Weights of 3.5.2 and 3.6, N, and how close a load must be to count as one of them.
_HALF, _WHOLE, _CLOSE = 4.905, 9.81, 0.01
#: The sweep of 3.2 has steps of 15 deg; with longer ones nobody sees where the axis turns fast.
_STEP = math.radians(15.0) + 1e-6
#: A transition is rapid when it goes faster than a steadily turning axis by this factor: ASSUMED.
_RAPID = 1.2


@dataclass(frozen=True)
class Answer:
    """Our value of a published figure.

    Parameters
    ----------
    ours
        Number, list or words; None where it does not exist.
    why
        What it rests on.
    source
        A finding that it rests on.
    holds
        Whether a rule in words holds; None for numbers, which are compared.
    """

    ours: Any
    why: str
    source: Finding
    holds: bool | None = None


@dataclass(frozen=True)
class Case:
    """Numbers of one record by name, SI, its facts, and one of the findings that they came in."""

    numbers: Mapping[str, float]
    facts: Mapping[str, Any]
    source: Finding


def _pinches(cases: Sequence[Case]) -> dict[float, Case]:
    """Pinches by the published law over alpha (rad), the first of each."""
    found: dict[float, Case] = {}
    for case in cases:
        if case.source.experiment == "Pinch" and case.facts["law"] == "published":
            found.setdefault(case.facts["pinch_angle"], case)
    return found


def _force_increase(cases: Sequence[Case]) -> Answer | None:
    found = _pinches(cases)
    sector = 2 * math.pi / 3
    ends = [case for alpha, case in found.items() if abs(distinct(alpha).pinch_angle) < 1e-6]
    middles = [case for alpha, case in found.items() if abs(distinct(alpha).pinch_angle - sector / 2) < 1e-6]
    if not (ends and middles):
        return None
    forces = {case.facts["pinch_angle"]: case.numbers["closing_force"] for case in (*ends, *middles)}
    shown = ", ".join(
        f"{force:.4g} N at {math.degrees(alpha):.4g} deg" if math.isfinite(force) else
        f"the walls never touch at {math.degrees(alpha):.4g} deg" for alpha, force in sorted(forces.items())
    )  # fmt: skip
    means = [float(np.mean([case.numbers["closing_force"] for case in group])) for group in (middles, ends)]
    ratio = means[0] / means[1]
    ours = 100.0 * (ratio - 1.0) if math.isfinite(ratio) else None
    return Answer(ours, f"tube {ends[0].facts['size']}: {shown}", ends[0].source)


def _transitions(cases: Sequence[Case]) -> Answer | None:
    found = _pinches(cases)
    axes: dict[float, float] = {}
    for alpha, case in sorted(found.items()):
        for image in images(alpha, 3):
            axis = imaged(case.numbers["deformation_axis"], distinct(alpha), distinct(image))
            axes[image] = axis if abs(image - alpha) < 1e-6 else axes.get(image, axis)
    angles = np.array(sorted(axes))
    if not len(angles):
        return None
    gaps = np.diff(np.append(angles, angles[0] + 2 * np.pi))
    speeds = np.abs(axis_steps(np.array([axes[angle] for angle in angles]))) / gaps
    if gaps.max() > _STEP or np.isnan(speeds).any():
        return None
    first = next(iter(found.values()))
    why = (
        f"tube {first.facts['size']}: middles of the fastest steps; the axis of deformation turns by up to "
        f"{speeds.max():.2f} deg per deg of alpha, at least {speeds.min():.2f}, on average 0.50"
    )
    if speeds.max() < _RAPID * 0.5:
        return Answer("no rapid transition", why, first.source, holds=False)
    return Answer(_fastest(angles + gaps / 2, speeds), why, first.source)


def _fastest(middles: Array, speeds: Array) -> list[float]:
    """Where each third of the turn is fastest, deg; the middle of neighbouring steps that are equally fast."""
    found = []
    for third in range(3):
        inside = np.flatnonzero(np.floor(middles / (2 * np.pi / 3)) == third)
        slower = speeds[inside] < 0.999 * speeds[inside].max()
        first = int(np.argmin(slower))
        run = int(np.argmax([*slower[first:], True]))
        found.append(round(float(np.degrees(middles[inside[first : first + run]].mean())), 6))
    return found


def _push(cases: Sequence[Case], pinched: bool) -> Case | None:
    """The first push test, of the closed tube at alpha = 0."""
    return next(
        (
            case for case in cases
            if case.facts["tube_push"] and case.facts["tube_pinched"] is pinched
            and (not pinched or abs(case.facts["pinch_angle"]) < 1e-6)
        ),
        None,
    )  # fmt: skip


def _push_open(cases: Sequence[Case]) -> Answer | None:
    case = _push(cases, pinched=False)
    return Answer(_known(case.numbers["k"]), "", case.source) if case else None


def _push_closed(cases: Sequence[Case]) -> Answer | None:
    case = _push(cases, pinched=True)
    return Answer(_known(case.numbers["k"]), "", case.source) if case else None


def _push_ratio(cases: Sequence[Case]) -> Answer | None:
    opened, closed = _push(cases, pinched=False), _push(cases, pinched=True)
    if opened is None or closed is None:
        return None
    one, other = opened.numbers["k"], closed.numbers["k"]
    return Answer(_known(one / other), f"{one:.4g} over {other:.4g} N/m", closed.source)


def _directions(cases: Sequence[Case]) -> Answer | None:
    """Way of the block from the direction of 500 g, in the order of the published directions."""
    ways: dict[int, Case] = {}
    for case in cases:
        facts = case.facts
        if facts["tube_pinched"] and facts["law"] == "published" and _loaded(case, _HALF):
            ways.setdefault(round(math.degrees(facts["pinch_angle"])), case)
    chosen = [ways[alpha] for alpha in (240, 0, 120) if alpha in ways]
    if len(chosen) < 3:
        return None
    moves = [(case.numbers["move_x"], case.numbers["move_y"], case.facts["tube_direction"]) for case in chosen]
    ours = [round(math.degrees(way(*move)), 6) for move in moves]
    sizes = [f"{1e3 * math.hypot(x, y):.3g}" for x, y, _ in moves]
    why = f"way of the block across the tube from that of the load at alpha 240, 0, 120 deg, by {', '.join(sizes)} mm"
    return Answer(ours, why, chosen[0].source)


def _recovers(cases: Sequence[Case]) -> Answer | None:
    case = _recovery(cases, _HALF)
    if case is None:
        return None
    left = case.numbers["flat_after_release"]
    return Answer(_said(left), "", case.source, holds=left < RECOVERED)


def _needs_help(cases: Sequence[Case]) -> Answer | None:
    case = _recovery(cases, _WHOLE)
    if case is None:
        return None
    alone, helped = case.numbers["flat_after_release"], case.numbers["flat_after_let_go"]
    if math.isnan(helped):
        return None
    ours = f"by itself {_said(alone)}; after an active pinch {_said(helped)}"
    return Answer(ours, "", case.source, holds=alone >= RECOVERED > helped)


def _recovery(cases: Sequence[Case], load: float) -> Case | None:
    return next((c for c in cases if c.source.experiment == "ShapeRecovery" and _loaded(c, load)), None)


def _loaded(case: Case, load: float) -> bool:
    return math.isclose(case.facts["tube_load"] or 0.0, load, rel_tol=_CLOSE)


def _said(left: float) -> str:
    return f"{'round again' if left < RECOVERED else 'stays flat'}, {100 * left:.3g} % of the flattening left"


def _known(value: float) -> float | None:
    return value if math.isfinite(value) else None


#: By the names that ``lab/data/ledger.yaml`` uses.
RULES: Mapping[str, Callable[[Sequence[Case]], Answer | None]] = {
    "force-increase": _force_increase,
    "transitions": _transitions,
    "push-open": _push_open,
    "push-closed": _push_closed,
    "push-ratio": _push_ratio,
    "directions": _directions,
    "recovers": _recovers,
    "needs-help": _needs_help,
}
