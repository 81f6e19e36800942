"""Lab, the dissertation's model, FEA and PRB side by side for chapter 4, and what each costs."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from lab.experiments import ShapePropagation
from lab.measures import relative_error
from lab.published import figures
from results.accuracy import Entry, seconds_per_10_s
from results.fin_states import fin_states
from results.fins import full_pinch, is_prototype
from results.paddling import CASES, DISSERTATION, LAB, published, saw_thrust, standing_for
from results.slugs import words
from results.tables import Table, shown

#: Number, its unit and factor in the table, and what it is called.
_SHAPE = (("s", "s at full pinch [mm]"), ("y", "y at full pinch [mm]"))
_FORCES = (("opposite", "c4-f-opposite"), ("equal", "c4-f-equal"))
_THRUST = ("thrust_max", "thrust_min", "thrust_mean")
_SPEED = "swimming speed, with load fin [mm/s]"
_WORDS = {"thrust_max": "peak thrust", "thrust_min": "smallest thrust", "thrust_mean": "mean thrust"}
_ABOUT = (
    "the prototype of table 4.1 with nothing swept: value (error against the lab); a dash: no such number, the text "
    "has s and y in a figure alone, and PRB models are given how the fin turns and gives way; limit load: largest "
    "force over all states of flattening; thrust at 1 Hz and 60 psi"
)
_FITTED = (
    "fitted: to records that the fit's own tables name; *: the fit has searched its numbers for this very figure; of "
    "such the text has six, fewer than there are free numbers, so that a match proves nothing by itself"
)
_TIME = (
    "wall time of the solve, median over the samples; per step: of a recorded increment; per second: of a second of "
    "motion; the dissertation's FEA: 25 min in 200 steps on 24 threads (4.4.1)"
)


@dataclass
class _Model:
    """A column: its header, values (SI) by quantity, and which of them the fit behind it has seen."""

    title: str
    origin: str
    values: dict[str, float] = field(default_factory=dict)
    seen: set[str] = field(default_factory=set)

    def put(self, quantity: str, value: float, seen: bool = False) -> None:
        """Keep the first value of a quantity."""
        if quantity not in self.values:
            self.values[quantity] = value
            self.seen |= {quantity} if seen else set()

    @property
    def known(self) -> int:
        """Number of quantities."""
        return sum(map(math.isfinite, self.values.values()))


def accuracy_table(entries: Sequence[Entry]) -> Table:
    """Every quantity that the text or we have, one line each; columns by origin."""
    models = _models(entries)
    header = ("quantity", "lab (measured)", "dissertation's model (prb)", *(model.title for model in models))
    lines = []
    for name, factor, lab, theirs in _published_lines():
        cells = [_cell(theirs, lab, factor)]
        cells += [_cell(model.values.get(name, math.nan), lab, factor, name in model.seen) for model in models]
        lines.append((name, shown(lab * factor, ""), *cells))
    notes = (_ABOUT, _FITTED) if any("fitted" in model.title for model in models) else (_ABOUT,)
    return Table("lab, dissertation, FEA and PRB: tube with fins", header, tuple(lines) if models else (), notes)


def _published_lines() -> list[tuple[str, float, float, float]]:
    """Quantity, factor to the shown unit, what the lab and the dissertation's model have, SI."""
    known = figures()
    lines = [(name, 1e3, math.nan, math.nan) for _, name in _SHAPE]
    lines += [(_limit(sense), 1.0, float(known[id]["value"]), math.nan) for sense, id in _FORCES]
    for load_fin in CASES:
        for name in _THRUST:
            lab, theirs = (published(of, load_fin, name) for of in (LAB, DISSERTATION))
            lines.append((_thrust(name, load_fin), 1.0, lab, theirs))
    lines.append((_SPEED, 1e3, published(LAB, True, "swim_speed"), math.nan))
    return lines


def _limit(sense: str) -> str:
    return f"limit load, {sense} sense [N]"


def _thrust(name: str, load_fin: bool) -> str:
    return f"{_WORDS[name]}, {CASES[load_fin]} [N]"


def _cell(value: float, lab: float, factor: float, seen: bool = False) -> str:
    error = relative_error(value, lab)
    told = f" ({error:+.0%})" if math.isfinite(error) else ""
    return f"{shown(value * factor, '')}{told}{' *' if seen else ''}"


def _models(entries: Sequence[Entry]) -> list[_Model]:
    """Every performer that has any number, FEA first, then those with the most."""
    models: dict[str, _Model] = {}
    for entry in entries:
        fitted = ", fitted" if entry.seen is not None else ""
        origin = entry.record.origin
        models.setdefault(entry.performer, _Model(f"{entry.performer} ({origin}{fitted})", origin))
        if _is_full_pinch(entry):
            _put(models, entry, _SHAPE)
    for states in fin_states(entries):
        if states.plain and is_prototype(states.entry.record.specimen):
            for sense, _ in _FORCES:
                models[states.performer].put(_limit(sense), states.largest(sense))
    for load_fin in CASES:
        for entry in standing_for(entries, "fixed", load_fin):
            _put(models, entry, [(name, _thrust(name, load_fin)) for name in _THRUST])
    for entry in standing_for(entries, "free", True):
        _put(models, entry, [("swim_speed", _SPEED)])
    return sorted((m for m in models.values() if m.known), key=lambda m: (m.origin == "prb", -m.known))


def _put(models: dict[str, _Model], entry: Entry, names: Sequence[tuple[str, str]]) -> None:
    numbers = entry.scalars()
    for name, quantity in names:
        if name in numbers:
            models[entry.performer].put(quantity, numbers[name].value, saw_thrust(entry, name))


def _is_full_pinch(entry: Entry) -> bool:
    experiment = entry.experiment
    return (
        isinstance(experiment, ShapePropagation)
        and experiment.drive == "pinch"
        and math.isclose(experiment.travel, full_pinch())
        and is_prototype(entry.record.specimen)
        and not words(entry.slug).keys() - {"fin_arc", "attachment_angle"}
    )


def run_time_table(entries: Sequence[Entry]) -> Table:
    """Wall time of every kind of experiment by every performer, beside the dissertation's FEA."""
    minutes, steps = (float(figures()[id]["value"]) for id in ("c4-fea-runtime", "c4-fea-steps"))
    theirs = 60.0 * minutes
    groups: dict[tuple[str, str, str, int], list[Entry]] = {}
    for entry in entries:
        if entry.record.completed and "wall_time_s" in entry.record.how:
            still = entry.experiment.kind != "PaddleThrust"
            count = len(next(iter(entry.record.channels.values())).values) - 1 if still else 0
            groups.setdefault((entry.experiment.kind, entry.performer, entry.record.origin, count), []).append(entry)
    lines = []
    for (kind, performer, origin, count), members in groups.items():
        wall = _median(members, lambda e: float(e.record.how["wall_time_s"]))
        second = _median(members, lambda e: seconds_per_10_s(e.record) / 10) if kind == "PaddleThrust" else math.nan
        # As many recorded increments of the same pinch.
        same = kind == "ShapePropagation" and count >= steps and wall > 0
        lines.append(
            (
                kind, performer, origin, str(len(members)), shown(wall, ""), str(count) if count else "-",
                shown(1e3 * wall / count, "") if count else "-", shown(1e3 * second, ""),
                f"{theirs / wall:.3g}" if same else "-",
            )
        )  # fmt: skip
    first = ("ShapePropagation", "dissertation's FEA", "fea", "1", shown(theirs, ""), f"{steps:g}",
             shown(1e3 * theirs / steps, ""), "-", "1")  # fmt: skip
    header = (
        "experiment", "by", "origin", "samples", "wall time [s]", "increments", "per step [ms]", "per second [ms]",
        "faster than the dissertation's",
    )  # fmt: skip
    return Table("run time, tube with fins", header, (first, *lines) if lines else (), (_TIME,))


def _median(members: Sequence[Entry], of: Callable[[Entry], float]) -> float:
    values = np.array([of(entry) for entry in members])
    known = values[np.isfinite(values)]
    return float(np.median(known)) if len(known) else math.nan
