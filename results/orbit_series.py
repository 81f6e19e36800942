"""Orbits of shaken beams as series over one swept number: the common ground of tables and figures."""

from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.experiments import BaseShake
from lab.units import Quantity, from_si
from results.accuracy import Entry
from results.benches import Bench, is_number, text_of, words_of
from results.slugs import words

Array = NDArray[np.float64]

FREQUENCY, TWIST = "experiment.frequency", "specimen.twist"
#: Fields that a label tells although nothing varies them: a reader expects them.
_TOLD = (TWIST, FREQUENCY)


@dataclass(frozen=True)
class Track:
    """One performer's orbits along a series, in ascending order of the swept number.

    Parameters
    ----------
    performer, origin
        Name in the study and kind of its records.
    values
        Swept number (n,), SI.
    entries
        The records (n,), those without a result too.
    major, minor, span_y, span_z
        Lengths of the axes and extents of the path (n,), m; NaN where there is no result, as in all that follows.
    axis_ratio
        Minor over major axis, positive for right-handed travel about +x (n,).
    tilt
        Angle of the major axis from +y about +x (n,), rad.
    """

    performer: str
    origin: str
    values: Array
    entries: tuple[Entry, ...]
    major: Array
    minor: Array
    axis_ratio: Array
    tilt: Array
    span_y: Array
    span_z: Array

    @classmethod
    def of(cls, entries: Sequence[Entry], values: Sequence[float]) -> "Track":
        """The track of one performer's entries at swept values in any order."""
        order = np.argsort(values, kind="stable")
        ranked = tuple(entries[i] for i in order)
        reduced = [entry.scalars() for entry in ranked]
        major, minor, ratio, tilt, span_y, span_z = (
            np.array([numbers[name].value if name in numbers else np.nan for numbers in reduced])
            for name in ("major_axis", "minor_axis", "axis_ratio", "tilt", "span_y", "span_z")
        )
        first = ranked[0]
        return cls(
            first.performer, first.record.origin, np.asarray(values, float)[order], ranked, major, minor, ratio, tilt,
            span_y, span_z,
        )  # fmt: skip

    def place(self, value: float) -> int | None:
        """Where a swept value stands in the arrays, if it does."""
        places = np.flatnonzero(self.values == value)
        return int(places[0]) if len(places) else None


@dataclass(frozen=True)
class Series:
    """Orbits of one campaign in which nothing but one number of specimen or experiment differs.

    Parameters
    ----------
    campaign
        Name in the study.
    label
        What is fixed and tells the series from its neighbours, for titles: ``twist -90 deg, lower-left``.
    swept
        Dotted path of the swept number, as ``experiment.frequency``.
    quantity
        Its SI unit and the one that a person reads; None for a number without unit.
    tracks
        One per performer, in the order of the campaign; they need not have the same samples.
    """

    campaign: str
    label: str
    swept: str
    quantity: Quantity | None
    tracks: tuple[Track, ...]

    @property
    def title(self) -> str:
        """Campaign and label."""
        return f"{self.campaign}, {self.label}" if self.label else self.campaign

    @property
    def name(self) -> str:
        """The swept number in words: ``frequency``."""
        return words_of(self.swept)

    @property
    def unit(self) -> str:
        """Unit in which a person reads the swept number; empty where it has none."""
        return self.quantity.shown_in if self.quantity else ""

    @property
    def axis(self) -> str:
        """Name and unit of the swept number, for an axis or a column."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name

    @property
    def performers(self) -> tuple[str, ...]:
        """Names of those that have a track."""
        return tuple(track.performer for track in self.tracks)

    @cached_property
    def values(self) -> Array:
        """Swept values (n,) that any performer has, ascending, SI."""
        return np.unique(np.concatenate([track.values for track in self.tracks]))

    def track(self, performer: str) -> Track | None:
        """The track of a performer, if it has one."""
        return next((track for track in self.tracks if track.performer == performer), None)

    @cached_property
    def factor(self) -> float:
        """What takes a swept value from SI to the unit that a person reads."""
        return from_si(1.0, self.quantity.unit, self.quantity.shown_in) if self.quantity else 1.0

    def shown(self, values: Array) -> Array:
        """Swept values (n,) in the unit that a person reads."""
        return values * self.factor

    def text(self, value: float) -> str:
        """One swept value with its unit: ``15 Hz``."""
        return text_of(value, self.quantity)


def orbit_series(entries: Sequence[Entry]) -> list[Series]:
    """Series of all campaigns of ``BaseShake`` among the entries, in their order.

    The swept number is the frequency where it varies, else the twist, else whatever number does.  Where a campaign
    is a union of sweeps, each becomes series of its own number; a sample that both hold stands in both.  A sample
    that nothing else resembles is a series of one.

    Parameters
    ----------
    entries
        Records of a study; other experiments are passed over.
    """
    shakes = [entry for entry in entries if isinstance(entry.experiment, BaseShake)]
    campaigns = dict.fromkeys(entry.campaign for entry in shakes)
    return [s for name in campaigns for s in _of_campaign([entry for entry in shakes if entry.campaign == name])]


def _of_campaign(entries: Sequence[Entry]) -> Iterator[Series]:
    benches = _benches(entries)
    varied = _varied(benches)
    numbers = [path for path in varied if any(is_number(bench.fields.get(path)) for bench in benches.values())]
    order = sorted(numbers or [FREQUENCY], key=lambda path: (path != FREQUENCY, path != TWIST))
    left = set(benches)
    for swept in order:
        for slugs in _alike(benches, [path for path in varied if path != swept], swept):
            if len(slugs) > 1 and left & set(slugs):
                left -= set(slugs)
                yield _series(entries, {slug: benches[slug] for slug in slugs}, swept, varied)
    for slug in [slug for slug in benches if slug in left]:
        yield _series(entries, {slug: benches[slug]}, order[0], varied)


def _benches(entries: Sequence[Entry]) -> dict[str, Bench]:
    """Benches by slug, which is what performers of a sample share: fits may change the specimen that a record tells."""
    found: dict[str, Bench] = {}
    for entry in entries:
        if entry.slug not in found:
            found[entry.slug] = Bench.of(entry)
    names = {path.rpartition(".")[2] for path in _varied(found)}
    for slug, bench in found.items():
        settings = {f"performer.{name}": text for name, text in words(slug).items() if name not in names}
        found[slug] = replace(bench, fields={**bench.fields, **settings})
    return found


def _series(entries: Sequence[Entry], benches: dict[str, Bench], swept: str, varied: Sequence[str]) -> Series:
    mine = [entry for entry in entries if entry.slug in benches]
    tracks = []
    for performer in dict.fromkeys(entry.performer for entry in mine):
        own = [entry for entry in mine if entry.performer == performer]
        tracks.append(Track.of(own, [benches[entry.slug].fields[swept] for entry in own]))
    first = next(iter(benches.values()))
    return Series(mine[0].campaign, _label(first, swept, varied), swept, first.quantity(swept), tuple(tracks))


def _alike(benches: dict[str, Bench], fixed: Sequence[str], swept: str) -> list[list[str]]:
    """Slugs of samples that differ in one number only; of equal samples the first."""
    found: dict[Hashable, dict[Any, str]] = {}
    for slug, bench in benches.items():
        if is_number(bench.fields.get(swept)):
            key = tuple(bench.fields.get(path) for path in fixed)
            found.setdefault(key, {}).setdefault(bench.fields[swept], slug)
    return [list(group.values()) for group in found.values()]


def _varied(benches: dict[str, Bench]) -> list[str]:
    """Paths whose values differ between samples; a part that some lack counts once, not field by field."""
    known: dict[str, set[Any]] = {}
    for bench in benches.values():
        for path, value in bench.fields.items():
            known.setdefault(path, set()).add(value)
    lacking = {
        path for path, values in known.items() if None in values and any(p.startswith(f"{path}.") for p in known)
    }
    return [path for path, values in known.items() if len(values) > 1 or path in lacking]


def _label(bench: Bench, swept: str, varied: Sequence[str]) -> str:
    paths = [path for path in dict.fromkeys((*_TOLD, *varied)) if path != swept and path in bench.fields]
    return ", ".join(_told(path, bench.fields[path], bench.quantity(path)) for path in paths)


def _told(path: str, value: Any, quantity: Quantity | None) -> str:
    if value is None:
        return f"no {words_of(path)}"
    # A corner, say, speaks for itself.
    alone = path == FREQUENCY or (isinstance(value, str) and not path.startswith("performer."))
    return text_of(value, quantity) if alone else f"{words_of(path)} {text_of(value, quantity)}"
