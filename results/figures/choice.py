"""Which tracks and which orbits of a series a figure shows when it cannot show all."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from results.accuracy import tracking
from results.figures.canvas import Style, styles
from results.orbit_series import Series, Track


def reference_of(series: Series, wanted: str | None) -> Track:
    """The track that others are compared with: the wanted performer's, else the first that is not of a PRB model."""
    track = series.track(wanted) if wanted else None
    return track or next((track for track in series.tracks if track.origin != "prb"), series.tracks[0])


def series_styles(series: Series) -> dict[str, Style]:
    """Style by performer, the same in all figures of a series."""
    return styles([track.entries[0] for track in series.tracks])


def chosen(series: Series, reference: str | None) -> list[tuple[Track, Style]]:
    """The reference's track, then those of the PRB models nearest to and farthest from it, with their styles."""
    first, look = reference_of(series, reference), series_styles(series)
    errors = {t.performer: misfit(t, first) for t in series.tracks if t.origin == "prb" and t is not first}
    ranked = sorted((error, name) for name, error in errors.items() if np.isfinite(error))
    words = ("nearest", "farthest") if len(ranked) > 2 else ("", "")
    shown = [(first, look[first.performer])]
    for (error, name), word in zip([*ranked[:1], *ranked[1:][-1:]], words, strict=False):
        about = f"{word} of {len(ranked)}, tracking error {error:.0%}" if word else f"tracking error {error:.0%}"
        track = series.track(name)
        assert track is not None
        shown.append((track, replace(look[name], label=f"{look[name].label}: {about}")))
    return shown


def misfit(track: Track, reference: Track) -> float:
    """Root mean square over the common samples of the tracking error (a fraction); NaN without any."""
    pairs = [
        (entry, reference.entries[place])
        for entry, value in zip(track.entries, track.values, strict=True)
        if (place := reference.place(value)) is not None
    ]
    errors = np.array([tracking(ours, theirs)[0] for ours, theirs in pairs])
    errors = errors[np.isfinite(errors)]
    return float(np.sqrt(np.mean(errors**2))) if len(errors) else float("nan")


def spread(order: Sequence[int] | NDArray[np.int64], values: NDArray[np.float64], count: int) -> list[int]:
    """The first ``count`` places in ``order`` whose values stand apart by an eighth of the sweep, ascending."""
    apart = float(np.ptp(values)) / 8.0
    taken: list[int] = []
    for place in order:
        if len(taken) < count and all(abs(values[place] - values[other]) >= apart for other in taken):
            taken.append(int(place))
    return sorted(taken)
