"""Pinches of one tube over the pinch angle, and all designs that its symmetry makes of them."""

from collections import Counter
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from lab.experiments import Pinch
from lab.pinching import Equivalent, axis_difference, distinct, ideal_axis
from lab.records import Scalar
from lab.specimens import PinchedTube
from results.accuracy import Entry
from results.benches import Bench
from results.pinch_symmetry import DIGITS, imaged, images, turned
from results.slugs import words

Array = NDArray[np.float64]

ANGLE, LAW = "experiment.pinch_angle", "experiment.law"
#: Pinch angles closer than this are one, rad.
_SAME = 1e-6


@dataclass(frozen=True)
class PinchPoint:
    """One pinch of a series.

    Parameters
    ----------
    experiment
        With the pinch angle.
    pairs
        n.
    entry
        Its record, without a result too.
    numbers
        What it reduces to; empty without a result.
    """

    experiment: Pinch
    pairs: int
    entry: Entry
    numbers: Mapping[str, Scalar]

    @property
    def pinch_angle(self) -> float:
        """alpha, rad."""
        return self.experiment.pinch_angle

    @property
    def shares(self) -> Array:
        """Force of every pair over F_p (pairs,)."""
        return self.experiment.shares(self.pairs)

    @property
    def ideal(self) -> float:
        """Hinge axis that turns steadily with alpha, rad; NaN for forces that follow no law."""
        return ideal_axis(self.pinch_angle) if self.experiment.pair_forces is None else float("nan")

    def value(self, name: str) -> float:
        """A reduced number, SI; NaN where there is none."""
        return self.numbers[name].value if name in self.numbers else float("nan")

    @cached_property
    def equivalent(self) -> Equivalent:
        """The distinct pinch angle behind it."""
        return distinct(self.pinch_angle, self.pairs)

    def mirror_error(self, name: str) -> float:
        """How far the axis ``name`` is from the tube's own mirror line, rad; NaN where pinch and tube have no mirror.

        Equal forces on both sides of a mirror leave the symmetric shape a hinge axis in the mirror or across it.
        Another one tells that the shape is one of two, each the other's mirror image.
        """
        base = self.equivalent.pinch_angle
        if min(base, np.pi / self.pairs - base) > _SAME:
            return float("nan")
        off = axis_difference(self.value(name), self.ideal)
        return float(axis_difference(2 * off, 0.0) / 2)


@dataclass(frozen=True)
class Design:
    """A pinch angle with the pinch that tells of it: its own, or one of which it is an image."""

    pinch_angle: float
    source: PinchPoint

    @property
    def computed(self) -> bool:
        """Whether it is no image."""
        return abs(self.pinch_angle - self.source.pinch_angle) < _SAME

    def axis(self, name: str) -> float:
        """The axis ``name`` of the tube pinched at this angle, rad, 0 to pi."""
        angle = self.source.value(name)
        to = distinct(self.pinch_angle, self.source.pairs)
        return angle if self.computed else imaged(angle, self.source.equivalent, to)


@dataclass(frozen=True)
class PinchSeries:
    """Pinches by one performer in which nothing but the pinch angle differs.

    Parameters
    ----------
    label
        What tells it from others, for titles.
    performer, origin
        Who made it and what kind its records are of.
    specimen, experiment
        Of the first point.
    points
        In ascending order of the pinch angle.
    """

    label: str
    performer: str
    origin: str
    specimen: PinchedTube
    experiment: Pinch
    points: tuple[PinchPoint, ...]

    @property
    def title(self) -> str:
        """Label and performer."""
        return f"{self.label} by {self.performer}"

    @cached_property
    def first(self) -> PinchPoint | None:
        """The pinch by one pair alone with which others are compared."""
        alone = [p for p in self.points if p.equivalent.pinch_angle < _SAME and p.numbers]
        return alone[0] if alone and self.experiment.pair_forces is None else None

    @cached_property
    def designs(self) -> tuple[Design, ...]:
        """Every pinch angle from 0 to below 360 deg that is computed or an image of a computed one, ascending."""
        if self.experiment.pair_forces is not None:
            return ()
        found: dict[float, Design] = {}
        # Where a distinct angle was computed several times, images are of the one that stands for it.
        for point in sorted(self.points, key=lambda p: p.pinch_angle - p.equivalent.pinch_angle):
            for angle in images(point.pinch_angle, self.specimen.pairs):
                found.setdefault(angle, Design(angle, point))
        for point in self.points:
            found[turned(point.pinch_angle)] = Design(turned(point.pinch_angle), point)
        return tuple(found[angle] for angle in sorted(found))

    @cached_property
    def twins(self) -> tuple[tuple[PinchPoint, PinchPoint], ...]:
        """Computed pinches with the one of which symmetry makes them images."""
        kept = {round(p.equivalent.pinch_angle, DIGITS): p for p in reversed(self.points)}
        pairs = ((p, kept[round(p.equivalent.pinch_angle, DIGITS)]) for p in self.points)
        return tuple((p, one) for p, one in pairs if p is not one) if self.experiment.pair_forces is None else ()


def pinch_series(entries: Sequence[Entry]) -> list[PinchSeries]:
    """Series of all pinches among the entries, in their order; a pinch that no other resembles is a series of one.

    Series go across campaigns.  One by another law starts with the pinch by one pair alone of the series that has
    everything else in common with it: there laws agree.
    """
    groups: dict[Hashable, list[tuple[Entry, Bench]]] = {}
    for entry in entries:
        if isinstance(entry.experiment, Pinch):
            bench = Bench.whole(entry)
            groups.setdefault(_key(entry, bench, (ANGLE,)), []).append((entry, bench))
    found = {key: _series(members) for key, members in groups.items()}
    alike: dict[Hashable, list[Hashable]] = {}
    for key, members in groups.items():
        alike.setdefault(_key(*members[0], (ANGLE, LAW)), []).append(key)
    for keys in alike.values():
        starts = [found[key].first for key in keys]
        start = next((point for point in starts if point is not None and point.pinch_angle < _SAME), None)
        for key, own in zip(keys, starts, strict=True):
            if own is None and start is not None:
                found[key] = replace(found[key], points=(start, *found[key].points))
    return _told_apart(list(found.values()))


def _key(entry: Entry, bench: Bench, free: Sequence[str]) -> Hashable:
    fields = tuple((path, value) for path, value in bench.fields.items() if path not in free)
    return entry.performer, entry.specimen, fields


def _series(members: Sequence[tuple[Entry, Bench]]) -> PinchSeries:
    points: dict[float, PinchPoint] = {}
    for entry, bench in members:
        specimen, experiment = bench.parts["specimen"], bench.parts["experiment"]
        assert isinstance(specimen, PinchedTube)
        assert isinstance(experiment, Pinch)
        point = PinchPoint(experiment, specimen.pairs, entry, entry.scalars())
        points.setdefault(round(experiment.pinch_angle, DIGITS), point)
    (entry, bench), ordered = members[0], [points[angle] for angle in sorted(points)]
    specimen, experiment = bench.parts["specimen"], bench.parts["experiment"]
    assert isinstance(specimen, PinchedTube)
    assert isinstance(experiment, Pinch)
    return PinchSeries(
        _label(entry, experiment), entry.performer, entry.record.origin, specimen, experiment, tuple(ordered)
    )


def _label(entry: Entry, experiment: Pinch) -> str:
    swept = {name: text for name, text in words(entry.slug).items() if name != "pinch_angle"}
    parts = [entry.specimen, *(f"{name.replace('_', ' ')} {text}" for name, text in swept.items())]
    if experiment.law != "published" and "law" not in swept:
        parts.append(f"law {experiment.law}")
    if experiment.pair_forces is not None and "pair_forces" not in swept:
        parts.append(f"forces {', '.join(f'{force:g}' for force in experiment.pair_forces)}")
    return ", ".join(parts)


def _told_apart(series: Sequence[PinchSeries]) -> list[PinchSeries]:
    """The same series, with the campaign in labels that would be alike."""
    counted = Counter(one.title for one in series)
    return [
        replace(one, label=f"{one.label} in {one.points[-1].entry.campaign}") if counted[one.title] > 1 else one
        for one in series
    ]
