"""Push tests of fins in both senses, state by state of the tube's flattening (4.5.1)."""

import math
from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from lab.experiments import FinPush
from lab.experiments.fin_drive import FIN_STAGES
from lab.records import Record
from results.accuracy import Entry
from results.benches import Bench
from results.fins import flattened_by, full_pinch
from results.slugs import words
from results.swept_series import Point
from results.two_terms import TwoTerms, two_term_fit

Array = NDArray[np.float64]

SENSES = ("opposite", "equal")
#: Fields that make a state, or only say how often is recorded.
_OWN = ("sense", "travel", "pressure", "increments", "push_increments")
_SWEPT = frozenset({"sense", "travel", "pressure"})
#: Numbers of a push that the two-term law is put through.
FITTED = {"torsional_stiffness": "N*m/rad", "torque": "N*m", "force_max": "N"}


@dataclass(frozen=True)
class FinState:
    """One state of flattening.

    Parameters
    ----------
    travel
        Approach of top and bottom, m: what was reached, or what was asked for where nothing was.
    pushes
        By sense, as far as they are there.
    """

    travel: float
    pushes: dict[str, Point]

    @property
    def share(self) -> float:
        """Of the full pinch of 33 mm."""
        return self.travel / full_pinch()

    def number(self, sense: str, name: str) -> float:
        """A reduced number of the push in one sense, SI; NaN where there is none."""
        return self.pushes[sense].number(name) if sense in self.pushes else math.nan


@dataclass(frozen=True)
class FinStates:
    """States of one device by one performer, ascending."""

    label: str
    performer: str
    origin: str
    plain: bool
    entry: Entry
    states: tuple[FinState, ...]

    @property
    def title(self) -> str:
        """Device and performer."""
        return f"{self.label} by {self.performer}"

    @property
    def is_variant(self) -> bool:
        """Whether it is another design or rig, pushed in one state alone."""
        return not self.plain and len(self.states) == 1

    @property
    def shares(self) -> Array:
        """Flattening of every state over the full pinch (states,)."""
        return np.array([state.share for state in self.states])

    def numbers(self, sense: str, name: str) -> Array:
        """A reduced number in every state (states,)."""
        return np.array([state.number(sense, name) for state in self.states])

    def largest(self, sense: str) -> float:
        """Largest force over all states and the whole push, N."""
        forces = self.numbers(sense, "force_max")
        return float(np.nanmax(forces)) if np.isfinite(forces).any() else math.nan

    @cached_property
    def laws(self) -> dict[tuple[str, str], TwoTerms]:
        """The two-term exponentials over the share of the full pinch, by sense and number, where points suffice."""
        fits = {(s, n): two_term_fit(self.shares, self.numbers(s, n)) for s in SENSES for n in FITTED}
        return {key: law for key, law in fits.items() if law is not None}


def fin_states(entries: Sequence[Entry]) -> list[FinStates]:
    """All push tests of fins among the entries, by device, rig and performer."""
    groups: dict[Hashable, list[Entry]] = {}
    for entry in entries:
        if isinstance(entry.experiment, FinPush):
            bench = Bench.whole(entry)
            left_out = {f"experiment.{name}" for name in _OWN}
            fields = tuple((path, value) for path, value in bench.fields.items() if path not in left_out)
            groups.setdefault((entry.performer, entry.specimen, fields), []).append(entry)
    return [_states(members) for members in groups.values()]


def _states(members: Sequence[Entry]) -> FinStates:
    found: dict[tuple[float, float], dict[str, Point]] = {}
    for entry in members:
        experiment = entry.experiment
        assert isinstance(experiment, FinPush)
        asked = (experiment.travel, 0.0) if experiment.drive == "pinch" else (math.nan, experiment.pressure)
        reached = flattened_by(entry.record)
        # Nothing is flatter than at rest but for round-off.
        travel = max(reached, 0.0) + 0.0 if math.isfinite(reached) else asked[0]
        state = found.setdefault((0.0 if math.isnan(asked[0]) else asked[0], asked[1]), {})
        state.setdefault(experiment.sense, Point(travel, entry, entry.scalars()))
    states = []
    for pushes in found.values():
        travels = [point.value for point in pushes.values() if math.isfinite(point.value)]
        states.append(FinState(travels[0] if travels else math.nan, pushes))
    first = members[0]
    own = {name: text for name, text in words(first.slug).items() if name not in _SWEPT}
    label = ", ".join([first.specimen, *(f"{name.replace('_', ' ')} {text}" for name, text in own.items())])
    ordered = tuple(sorted(states, key=lambda state: state.travel))
    return FinStates(label, first.performer, first.record.origin, not own, first, ordered)


def pushing(record: Record) -> NDArray[np.int64]:
    """Places of the increments of the push, with the state that it starts from."""
    found = np.flatnonzero(record["stage"] == FIN_STAGES.index("push"))
    return np.concatenate([found[:1] - 1, found]) if len(found) and found[0] else found
