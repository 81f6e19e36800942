"""Orbits of shaken beams as tables: axes, tilt and sense of travel, errors, and where the sense reverses."""

import math
from collections.abc import Sequence

import numpy as np

from lab.orbits import ranges, sense
from results.accuracy import tracking
from results.orbit_agreement import LINE_LIKE, agreement, line_like, turns
from results.orbit_series import Series, Track
from results.tables import Table

#: A series with more samples is a detail, and one with fewer says nothing of reversals.
_SHORT, _FEW = 10, 3
_SENSES = {1: "+", -1: "-", 0: "0"}
_ORBIT = (
    "an orbit: major x minor axis in mm, tilt of the major axis from +y about +x in deg, sense of travel (+ "
    "right-handed about +x, - left-handed, 0 a line); error: tracking error in %; a dash: no result"
)
_REVERSALS = (
    f"line-like: minor axis at most {LINE_LIKE:g} of the major one; senses are + right-handed about +x and - "
    "left-handed; a reversal lies where the signed ratio of the axes passes zero between two samples"
)
_MATCHED = (
    "missing, surplus: reversals of the reference that a model lacks, and of the model without one of the reference; "
    "farthest: of those that both have, to the same sense; same sense: samples with the reference's, of all and of "
    "those where its orbit is no line, and where the former are"
)


def orbit_tables(series: Sequence[Series], reference: str) -> list[Table]:
    """Reversals of all series of a campaign against a performer, then the orbits of every one of them.

    Parameters
    ----------
    series
        Those of one campaign.
    reference
        Performer that the others are compared with; series without it are left out.
    """
    known = [one for one in series if one.track(reference)]
    long = [one for one in known if len(one.values) >= _FEW]
    groups = [[one for one in long if one.swept == swept] for swept in dict.fromkeys(one.swept for one in long)]
    return [*(_reversals(group, reference) for group in groups), *(_orbits(one, reference) for one in known)]


def _orbits(series: Series, reference: str) -> Table:
    ordered = _reference_first(series, reference)
    first, others = ordered[0], ordered[1:]
    header = [series.axis, f"{first.performer} ({first.origin})"]
    for track in others:
        header += [track.performer, "error [%]"]
    lines = []
    for value in series.values:
        line = [f"{value * series.factor:.6g}", _orbit(first, value)]
        for track in others:
            line += [_orbit(track, value), _error(track, first, value)]
        lines.append(tuple(line))
    title = f"orbits of {series.title} against {reference}"
    return Table(title, tuple(header), tuple(lines), (_ORBIT,), len(lines) > _SHORT)


def _orbit(track: Track, value: float) -> str:
    place = track.place(value)
    if place is None or math.isnan(track.axis_ratio[place]):
        return "-"
    major, minor = 1e3 * track.major[place], 1e3 * track.minor[place]
    way = _SENSES[sense(track.axis_ratio[place])]
    return f"{major:.3g} x {minor:.2g}, {math.degrees(track.tilt[place]):.0f}, {way}"


def _error(track: Track, reference: Track, value: float) -> str:
    ours, theirs = track.place(value), reference.place(value)
    if ours is None or theirs is None:
        return "-"
    error, _ = tracking(track.entries[ours], reference.entries[theirs])
    return "-" if math.isnan(error) else f"{100 * error:.3g}"


def _reversals(series: Sequence[Series], reference: str) -> Table:
    first = series[0]
    unit = f" [{first.unit}]" if first.unit else ""
    header = (
        "series", "model", f"sense of travel over {first.name}{unit}", f"line-like{unit}", f"farthest{unit}", "missing",
        "surplus", "same sense (all)", "(no lines)", f"same sense at{unit}",
    )  # fmt: skip
    lines = []
    for one in series:
        lines += [_sense_line(one, track, reference) for track in _reference_first(one, reference)]
    title = f"where the sense of travel reverses over {first.name}: {first.campaign} against {reference}"
    return Table(title, header, tuple(lines), (_REVERSALS, _MATCHED))


def _sense_line(series: Series, track: Track, reference: str) -> tuple[str, ...]:
    lines = _ranges(series, ranges(track.values, line_like(track)))
    line = (series.label, track.performer, _senses(series, track), lines)
    of = series.track(reference)
    if of is None or of is track:
        return (*line, *[""] * 6)
    found = agreement(track, of)
    farthest = _between(series, found.farthest) if found.pairs else ""
    return (
        *line, farthest, str(len(found.missing)), str(len(found.surplus)), f"{found.same} of {found.compared}",
        f"{found.clear_same} of {found.clear}", _ranges(series, found.where),
    )  # fmt: skip


def _senses(series: Series, track: Track) -> str:
    """Senses in turn, with where each ends: ``+ to 8.4, - to 13.2, then +``."""
    known = [way for way in map(sense, track.axis_ratio[np.isfinite(track.axis_ratio)]) if way]
    if not known:
        return "a line" if np.isfinite(track.axis_ratio).any() else "-"
    ends = turns(track)
    if not ends:
        return f"{_SENSES[known[0]]} throughout"
    parts = [f"{_SENSES[-end.after]} to {_between(series, end.at)}" for end in ends]
    return ", ".join([*parts, f"then {_SENSES[ends[-1].after]}"])


def _between(series: Series, value: float) -> str:
    """A value between samples, to some thousandth of the range that is swept."""
    decimals = 3 - math.floor(math.log10(np.ptp(series.values) * series.factor))
    # Adding nothing makes -0 a 0.
    return f"{round(value * series.factor, decimals) + 0.0:.6g}"


def _ranges(series: Series, found: Sequence[tuple[float, float]]) -> str:
    pairs = [(f"{low * series.factor:.6g}", f"{high * series.factor:.6g}") for low, high in found]
    return ", ".join(low if low == high else f"{low} to {high}" for low, high in pairs)


def _reference_first(series: Series, reference: str) -> list[Track]:
    return sorted(series.tracks, key=lambda track: track.performer != reference)
