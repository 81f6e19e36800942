"""When a held part was let go."""

from collections.abc import Sequence

import numpy as np

from lab.readers.recording import Array, Recording, Release, runs
from lab.signals.windows import Window, between

#: A threshold must leave the noise of the held state so many standard deviations behind.
_NOISE = 5.0
#: Samples in a row beyond the threshold that make a release; fewer are a glitch of the tracking.
_DEPARTED = 3


def release_at(recording: Recording, time: float, uncertainty: float) -> Recording:
    """Set the clock to zero at a time that the user knows, s."""
    return recording.noted(
        f"release at {time:.6g} s as stated, give or take {uncertainty * 1e3:.3g} ms: time zero",
        time=recording.time - time, release=Release(time, uncertainty),
    )  # fmt: skip


def detect_release(recording: Recording, threshold: float, held: Window, names: Sequence[str] = ()) -> Recording:
    """Set the clock to zero at the last sample before the markers leave the held state.

    A marker leaves it when it stays further than ``threshold`` from its mean place while held, for three
    samples in a row.  The release lies within one sampling interval of that sample, unless the part starts so
    slowly that it takes longer to cover the threshold: from the first samples beyond it, taken as the begin
    of a uniform acceleration, that delay is estimated, and the larger of both is the uncertainty.

    Parameters
    ----------
    recording
        Seen throughout, at least around the release.
    threshold
        Distance, m.
    held
        Stretch in which the part was certainly held.
    names
        Markers that are watched; none: all.

    Raises
    ------
    ValueError
        When nothing leaves, the threshold lies in the noise, or the held state is not held.
    """
    watched = names or list(recording.markers)
    part = held.of(recording, "release")
    away = _distance(recording, watched, part, threshold)
    gone = [run for run in runs(away > threshold) if run[1] - run[0] + 1 >= _DEPARTED]
    if not gone or gone[0][0] <= part.stop - 1:
        what = "no marker ever goes" if not gone else f"a marker is already, at {recording.time[gone[0][0]]:.6g} s,"
        raise ValueError(f"{recording.source}: release: {what} {threshold * 1e3:.3g} mm away from the held state")
    first = gone[0][0]
    if np.isnan(away[part.stop : first]).any():
        blind = part.stop + int(np.argmax(np.isnan(away[part.stop : first])))
        raise ValueError(f"{recording.at(blind)}: release: no watched marker is seen here, between held and away")
    last = first - 1
    begin = _onset(recording.time[first : first + _DEPARTED], away[first : first + _DEPARTED])
    step = float(recording.time[first] - recording.time[last])
    uncertainty = max(step, float(recording.time[last]) - begin)
    time = float(recording.time[last])
    slow = "" if uncertainty <= step else ", more than one sample since the part starts slowly"
    return recording.noted(
        f"release at {time:.6g} s, give or take {uncertainty * 1e3:.3g} ms{slow}: last sample before "
        f"{', '.join(watched)} leave by {threshold * 1e3:.3g} mm the place held over {between(recording, part)}; "
        "time zero",
        time=recording.time - time, release=Release(time, uncertainty),
    )  # fmt: skip


def _onset(time: Array, distance: Array) -> float:
    """When a uniform acceleration through these samples began, s."""
    slope, intercept = np.polyfit(time, np.sqrt(distance), 1)
    return float(-intercept / slope) if slope > 0 else float(time[0])


def _distance(recording: Recording, watched: Sequence[str], part: slice, threshold: float) -> Array:
    """Distance of the furthest watched marker from its place while held, (n,), m; NaN where none is seen."""
    away = np.full(len(recording.time), np.nan)
    for name in watched:
        values = recording.markers[name]
        if np.isnan(values[part]).any():
            raise ValueError(f"{recording.source}: release: marker {name!r} is occluded while held")
        noise = float(np.sqrt(values[part].var(axis=0).sum()))
        if threshold < _NOISE * noise:
            raise ValueError(
                f"{recording.source}: release: threshold {threshold * 1e3:.3g} mm is within the noise of marker "
                f"{name!r} while held ({noise * 1e3:.3g} mm); take at least {_NOISE * noise * 1e3:.3g} mm, or a window "
                "in which it is held"
            )
        away = np.fmax(away, np.linalg.norm(values - values[part].mean(axis=0), axis=1))
    return away
