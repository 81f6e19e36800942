"""Series of samples in which nothing but one field differs, across campaigns."""

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from lab.records import Scalar
from lab.units import Quantity, from_si
from results.accuracy import Entry
from results.benches import Bench, is_number, text_of, words_of

Array = NDArray[np.float64]

#: Fields that say how often something is recorded or repeated.
_HOW_OFTEN = frozenset(
    f"experiment.{name}" for name in ("increments", "push_increments", "samples_per_cycle", "cycles", "warm_up")
)
#: Names of fields as the dissertation has them.
SYMBOLS = {"fin_arc": "alpha", "attachment_angle": "theta"}


@dataclass(frozen=True)
class Point:
    """One sample of a series: the field's value, SI, its record, and what it reduces to."""

    value: float
    entry: Entry
    numbers: Mapping[str, Scalar]

    def number(self, name: str) -> float:
        """A reduced number, SI; NaN where there is none."""
        return self.numbers[name].value if name in self.numbers else float("nan")


@dataclass(frozen=True)
class SweptSeries:
    """Samples by one performer over one field, ascending.

    Parameters
    ----------
    path, quantity
        Dotted path of the field, and its units.
    label
        What tells it from other series over the same field; empty where there is none.
    bench
        Of the first point.
    """

    path: str
    quantity: Quantity | None
    label: str
    performer: str
    origin: str
    bench: Bench
    points: tuple[Point, ...]

    @property
    def name(self) -> str:
        """The field in words, or as the dissertation's symbol."""
        return named(self.path)

    @property
    def title(self) -> str:
        """Field, what is held, and performer."""
        return f"over {self.name}{f' at {self.label}' if self.label else ''} by {self.performer}"

    @cached_property
    def values(self) -> Array:
        """Of the field, SI (points,)."""
        return np.array([point.value for point in self.points])

    def results(self, name: str) -> Array:
        """A reduced number of every point, SI (points,)."""
        return np.array([point.number(name) for point in self.points])

    def told(self, value: float) -> str:
        """A value of the field as a person reads it."""
        return text_of(value, self.quantity)

    @property
    def unit(self) -> str:
        """Unit in which the field is read; empty for a plain number."""
        return self.quantity.shown_in if self.quantity else ""

    def shown(self, values: Array) -> Array:
        """Values of the field in that unit."""
        return values * from_si(1.0, self.quantity.unit, self.quantity.shown_in) if self.quantity else values


def named(path: str) -> str:
    """A field in words, with the part that it belongs to, or as the dissertation's symbol."""
    *part, name = path.split(".")[1:]
    return SYMBOLS.get(name) or " ".join(map(words_of, [*part, name]))


def swept_series(entries: Sequence[Entry], path: str, least: int = 2) -> list[SweptSeries]:
    """Series of ``least`` samples or more over the field at the dotted ``path``, in the order of the entries.

    The first sample of every value counts.  Samples without a result are points without numbers.  Labels say what
    differs among all samples that have the field.
    """
    groups: dict[Hashable, list[tuple[Entry, Bench]]] = {}
    for entry in entries:
        bench = Bench.whole(entry)
        if is_number(bench.fields.get(path)):
            groups.setdefault(_key(entry, bench, path), []).append((entry, bench))
    found = _labelled([_series(members, path) for members in groups.values()])
    return [one for one in found if len(one.points) >= least]


def _key(entry: Entry, bench: Bench, path: str) -> Hashable:
    fields = tuple((name, value) for name, value in bench.fields.items() if name != path and name not in _HOW_OFTEN)
    return entry.performer, entry.specimen, entry.experiment.kind, fields


def _series(members: Sequence[tuple[Entry, Bench]], path: str) -> SweptSeries:
    points: dict[float, Point] = {}
    for entry, bench in members:
        value = float(bench.fields[path])
        points.setdefault(round(value, 12), Point(value, entry, entry.scalars()))
    entry, bench = members[0]
    ordered = tuple(points[value] for value in sorted(points))
    return SweptSeries(path, bench.quantity(path), "", entry.performer, entry.record.origin, bench, ordered)


def _labelled(series: Sequence[SweptSeries]) -> list[SweptSeries]:
    """With labels of what differs among them: the specimen's name, then fields."""
    several = len({_specimen(one) for one in series}) > 1
    found = []
    for one in series:
        kin = [other for other in series if _specimen(other) == _specimen(one)]
        differing = [
            name for name, value in one.bench.fields.items()
            if name != one.path and name not in _HOW_OFTEN
            and any(other.bench.fields.get(name) != value for other in kin)
        ]  # fmt: skip
        parts = [_specimen(one)] if several else []
        parts += [f"{named(n)} {text_of(one.bench.fields[n], one.bench.quantity(n))}" for n in differing]
        found.append(replace(one, label=", ".join(parts)))
    return found


def _specimen(series: SweptSeries) -> str:
    return series.points[0].entry.specimen
