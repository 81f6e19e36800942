"""Axes and sense of the tip's orbit over a swept number, beside orbits that stand out (fig. 5.3f, 5.5, 5.6)."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.experiments import BaseShake
from results.figures.canvas import Style, pyplot, save
from results.figures.choice import chosen, reference_of, series_styles, spread
from results.figures.paths import VIEW, Orbit, Tiles
from results.figures.senses import SENSES, TICKS, edges, sense_map
from results.orbit_agreement import turns
from results.orbit_series import Series, Track

#: Colours of orbits that stand out, as in fig. 5.5: large and round ones, and lines.
_OVAL, _LINE = "#1b9e3e", "#8c510a"
#: Orbits of each kind beside the curves.
_SHOWN = 3
_HEADER = (
    "series", "swept", "unit", "value", "performer", "major_mm", "minor_mm", "axis_ratio", "tilt_deg", "span_y_mm",
    "span_z_mm",
)  # fmt: skip


def orbit_axes(series: Series, reference: str | None, path: Path) -> Path:
    """Both axes of the ellipse and its sense of travel for every performer; at the right, ovals and lines."""
    first, look = reference_of(series, reference), series_styles(series)
    figure = pyplot().figure(figsize=(13.5, 5.6 + 0.18 * len(series.tracks)), layout="constrained")
    left, right = figure.subfigures(1, 2, width_ratios=(2.6, 1.0))
    height = 0.32 * len(series.tracks)
    major, minor, senses = left.subplots(3, 1, sharex=True, height_ratios=(2.3, 2.0, height))
    for track in series.tracks:
        style, values = look[track.performer], series.shown(track.values)
        for axis, lengths in ((major, track.major), (minor, track.minor)):
            axis.plot(
                values, 1e3 * lengths, style.line, marker=".", ms=3, color=style.colour, label=style.label, lw=1.2
            )
    image = sense_map(senses, series, [(track.performer, track) for track in series.tracks])
    left.colorbar(image, ax=senses, label="signed ratio", ticks=TICKS, aspect=6, pad=0.01)
    ovals, lines = _standing_out(first)
    _mark(series, first, (major, minor), ovals, lines)
    _mark_reversals(series, first, (major, minor, senses))
    major.set(ylabel="major axis [mm]", ylim=(0, None))
    minor.set(ylabel="minor axis [mm]", ylim=(0, None))
    senses.set(xlabel=f"{series.axis}\n{SENSES}", xlim=tuple(edges(series.shown(series.values))[[0, -1]]))
    for axis in (major, minor):
        axis.grid(alpha=0.3)
    left.legend(*major.get_legend_handles_labels(), loc="outside lower center", frameon=False, fontsize=8, ncols=4)
    left.suptitle(f"{series.title}: axes of the tip's orbit, seen from the {_eye(series)}", fontsize=10)
    _selected(right, series, chosen(series, first.performer)[:2], first, ovals, lines)
    return save(figure, path, _HEADER, _rows(series), dpi=115)


def _standing_out(track: Track) -> tuple[list[int], list[int]]:
    """Places of the roundest orbits and of the thinnest, those of each kind apart from each other."""
    ratio = np.abs(track.axis_ratio)
    known = np.flatnonzero(np.isfinite(ratio))
    order = known[np.argsort(ratio[known], kind="stable")]
    ovals = spread(order[::-1], track.values, _SHOWN)
    return ovals, spread([i for i in order if i not in ovals], track.values, _SHOWN)


def _mark(series: Series, track: Track, axes: Sequence[Any], ovals: Sequence[int], lines: Sequence[int]) -> None:
    values = series.shown(track.values)
    # As broad as half the step of a dense sweep, yet to be seen in a sparse one.
    half = 0.006 * float(np.ptp(values))
    for places, colour in ((ovals, _OVAL), (lines, _LINE)):
        for place in places:
            for axis in axes:
                axis.axvspan(values[place] - half, values[place] + half, color=colour, alpha=0.25, lw=0)


def _mark_reversals(series: Series, track: Track, axes: Sequence[Any]) -> None:
    found = turns(track)
    for at in series.shown(np.array([reversal.at for reversal in found])):
        for axis in axes:
            axis.axvline(at, color="#444444", lw=0.8, ls=":")
        axes[0].annotate(
            f"{at:.3g} {series.unit}", (at, 1.0), xycoords=("data", "axes fraction"), xytext=(2, -2), fontsize=7,
            textcoords="offset points", rotation=90, ha="left", va="top", color="#444444",
        )  # fmt: skip


def _selected(
    figure: Any, series: Series, tracks: Sequence[tuple[Track, Style]], first: Track, ovals: Sequence[int],
    lines: Sequence[int],
) -> None:  # fmt: skip
    rows = max(len(ovals), len(lines), 1)
    tiles = Tiles(figure.add_subplot(), rows, 2)
    for column, (places, colour) in enumerate(((ovals, _OVAL), (lines, _LINE))):
        for row, place in enumerate(places):
            value = float(first.values[place])
            orbits = [Orbit.at(track, value, style) for track, style in tracks]
            label = f"{series.text(value)}: {round(first.axis_ratio[place], 2) + 0.0:+.2f}"
            tiles.draw(row, column, label, orbits, edge=colour)
    names = "\nand ".join(track.performer for track, _ in tracks)
    figure.suptitle(f"roundest and thinnest orbits of {names}", fontsize=9)
    figure.supxlabel(VIEW.replace(", y up", ",\ny up"), fontsize=7)


def _eye(series: Series) -> str:
    experiment = series.tracks[0].entries[0].experiment
    return experiment.seen_from if isinstance(experiment, BaseShake) else ""


def _rows(series: Series) -> list[Sequence[Any]]:
    return [
        (series.label, series.name, series.unit, f"{shown:.9g}", track.performer, *(f"{n:.6g}" for n in numbers))
        for track in series.tracks
        for shown, *numbers in zip(series.shown(track.values), *_numbers(track), strict=True)
    ]


def _numbers(track: Track) -> Sequence[NDArray[np.float64]]:
    lengths = [1e3 * track.major, 1e3 * track.minor, track.axis_ratio, np.degrees(track.tilt)]
    return [*lengths, 1e3 * track.span_y, 1e3 * track.span_z]
