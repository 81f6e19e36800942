"""Rules by which the text's sayings of tubes with fins are judged, each over the records of one model."""

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial

import numpy as np

from lab.published import figures
from results.effects import Effect, effect
from results.fins import CORRELATED, PSI, full_pinch, is_negligible
from results.ledger.tube_rules import Answer, Case

#: Fewer designs than this show no effect.
_SWEEP = 3
_OTHER = {"fin_arc": ("attachment_angle", "theta", "c4-alpha-sweep-theta"),
          "attachment_angle": ("fin_arc", "alpha", "c4-theta-sweep-alpha")}  # fmt: skip


def _full(cases: Sequence[Case]) -> list[Case]:
    """Pinches to 33 mm."""
    return [
        case for case in cases
        if case.source.experiment == "ShapePropagation" and case.facts["drive"] == "pinch"
        and math.isclose(case.facts["fin_travel"], full_pinch()) and not case.facts["swept"]
    ]  # fmt: skip


def _sweeps(cases: Sequence[Case], over: str) -> dict[float, tuple[Effect, Effect, Case]]:
    """Effects of the angle ``over`` on s and y by the held angle, deg; the text's held angle first."""
    held, _, published = _OTHER[over]
    groups: dict[float, dict[float, Case]] = {}
    for case in _full(cases):
        place = round(math.degrees(case.facts[held]), 6)
        groups.setdefault(place, {}).setdefault(round(math.degrees(case.facts[over]), 6), case)
    found = {}
    for place, members in groups.items():
        if len(members) >= _SWEEP:
            angles = np.array(sorted(members))
            s, y = (effect(angles, np.array([members[a].numbers[name] for a in angles])) for name in ("s", "y"))
            found[place] = s, y, members[angles[0]]
    wanted = float(figures()[published]["value"])
    return dict(sorted(found.items(), key=lambda item: (item[0] != wanted, item[0])))


def _effect_of(over: str, holds: Callable[[Effect, Effect], bool], cases: Sequence[Case]) -> Answer | None:
    found = _sweeps(cases, over)
    if not found:
        return None
    word = _OTHER[over][1]
    told = {
        place: f"at {word} {place:g} deg s varies by {s.spread:.0%} (r {s.correlation:+.2f}), y by {y.spread:.0%}, "
        f"{1e3 * y.range:.2g} mm"
        for place, (s, y, _) in found.items()
    }
    (first, (s, y, case)), *others = found.items()
    return Answer(told[first], "; ".join(told[place] for place, _ in others), case.source, holds(s, y))


def _alpha_does_nothing(s: Effect, y: Effect) -> bool:
    return is_negligible(s) and is_negligible(y, s)


def _theta_does_it(s: Effect, y: Effect) -> bool:
    return abs(s.correlation) > CORRELATED and not is_negligible(s) and is_negligible(y, s)


def _run_time(cases: Sequence[Case]) -> Answer | None:
    steps = int(figures()["c4-fea-steps"]["value"])
    known = [c for c in _full(cases) if c.facts["prototype"] and c.facts["increments"] >= steps]
    if not known or math.isnan(known[0].facts["wall_time"]):
        return None
    minutes = known[0].facts["wall_time"] / 60
    why = f"{60 * minutes:.3g} s for {known[0].facts['increments']} recorded increments"
    return Answer(minutes, why, known[0].source, minutes <= float(figures()["c4-fea-runtime"]["value"]))


def _limit(sense: str, cases: Sequence[Case]) -> Answer | None:
    """The largest force over all states of flattening."""
    known = [
        c for c in cases
        if c.source.experiment == "FinPush" and c.facts["sense"] == sense and c.facts["prototype"]
        and not c.facts["swept"] and math.isfinite(c.numbers.get("force_max", math.nan))
    ]  # fmt: skip
    if not known:
        return None
    most = max(known, key=lambda c: c.numbers["force_max"])
    limit = most.numbers.get("limit_load", math.nan)
    peak = f"first peak {limit:.3g} N" if math.isfinite(limit) else "no peak, it only rises"
    why = f"largest of {len(known)} states of flattening, pinched by {1e3 * most.facts['fin_travel']:.3g} mm; {peak}"
    return Answer(most.numbers["force_max"], why, most.source)


def _paddles(name: str, load_fin: bool, body: str, cases: Sequence[Case]) -> Answer | None:
    """A number of the prototype at 1 Hz and 60 psi."""
    frequency, pressure = (float(figures()[id]["value"]) for id in ("c4-thrust-freq", "c4-thrust-pressure"))
    for case in cases:
        facts = case.facts
        if (
            case.source.experiment == "PaddleThrust" and facts["prototype"] and not facts["swept"]
            and facts["load_fin"] is load_fin and facts["body"] == body
            and math.isclose(facts["frequency"], frequency)
            and math.isclose(facts["fin_pressure"], pressure * PSI, rel_tol=1e-3)
        ):  # fmt: skip
            value = case.numbers.get(name, math.nan)
            bent = [math.degrees(case.numbers.get(f"buckling_{end}", math.nan)) for end in ("max", "min")]
            why = f"the fin's distal part bends by {bent[0]:.2g} and {bent[1]:.2g} deg in power and recovery stroke"
            return Answer(value if math.isfinite(value) else None, why, case.source)
    return None


_THRUST = {
    "thrust-max": "thrust_max", "thrust-min": "thrust_min", "thrust-mean": "thrust_mean",
    "tip-power": "tip_speed_mean_power", "tip-recovery": "tip_speed_mean_recovery",
}  # fmt: skip
#: By the names that ``lab/data/ledger.yaml`` uses.
FIN_RULES: Mapping[str, Callable[[Sequence[Case]], Answer | None]] = {
    "alpha-effect": partial(_effect_of, "fin_arc", _alpha_does_nothing),
    "theta-effect": partial(_effect_of, "attachment_angle", _theta_does_it),
    "run-time": _run_time,
    "limit-opposite": partial(_limit, "opposite"),
    "limit-equal": partial(_limit, "equal"),
    **{f"{rule}-without": partial(_paddles, name, False, "fixed") for rule, name in _THRUST.items()},
    **{f"{rule}-with": partial(_paddles, name, True, "fixed") for rule, name in _THRUST.items()},
    "swim-speed": partial(_paddles, "swim_speed", True, "free"),
}
