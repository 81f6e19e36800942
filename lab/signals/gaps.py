"""Samples that are missing: refused, or filled up to a limit."""

import numpy as np

from lab.readers.clock import HOLE
from lab.readers.recording import Array, Recording, runs


def refuse_missing(recording: Recording, what: str) -> None:
    """Stop where a sensor has no value.

    Raises
    ------
    ValueError
        Naming file, channel, rows and the step that may help.
    """
    for name, values in recording.channels().items():
        absent = np.atleast_1d(np.isnan(values).any(axis=1))
        if absent.any():
            first, last = runs(absent)[0]
            raise ValueError(
                f"{recording.at(first, last)}, {name}: {last - first + 1} samples are missing, and {what} needs all; "
                "crop them off or put a step 'fill-gaps' before"
            )


def refuse_gaps(recording: Recording, what: str) -> None:
    """Stop where a sensor has no value, or a sample lacks altogether.

    Raises
    ------
    ValueError
        Naming file and rows.
    """
    refuse_missing(recording, what)
    steps = np.diff(recording.time) * recording.rate
    if (steps > HOLE).any():
        at = int(np.argmax(steps > HOLE))
        raise ValueError(
            f"{recording.at(at, at + 1)}: {steps[at]:.3g} sampling intervals lie between these, and {what} needs all "
            "samples; put a step 'fill-gaps' before"
        )


def refuse_uneven(recording: Recording, what: str) -> None:
    """Stop where samples are missing or not evenly spaced.

    Raises
    ------
    ValueError
        Naming file and rows.
    """
    refuse_gaps(recording, what)
    steps = np.diff(recording.time) * recording.rate
    if np.abs(steps - 1).max() > 1e-2:
        at = int(np.abs(steps - 1).argmax())
        raise ValueError(
            f"{recording.at(at, at + 1)}: samples are {steps[at]:.4g} intervals apart, and {what} needs even ones; put "
            "a step 'resample' before"
        )


def fill_gaps(recording: Recording, limit: int) -> Recording:
    """Fill stretches of missing samples by a cubic spline through all that were seen.

    Rows that the file lacks altogether (a step of a whole number of intervals) count as missing samples.

    Parameters
    ----------
    recording
        With NaN where nothing was seen.
    limit
        Most samples in a row that may be filled.

    Raises
    ------
    ValueError
        For a longer gap, and for one at either end; naming file, rows and channel.
    """
    from scipy.interpolate import CubicSpline

    recording = _with_lacking_rows(recording)
    filled: list[str] = []

    def mend(name: str, values: Array) -> Array:
        absent = np.atleast_1d(np.isnan(values).any(axis=1))
        if not absent.any():
            return values
        gaps = runs(absent)
        for first, last in gaps:
            where, count = recording.at(first, last), last - first + 1
            if first == 0 or last == len(values) - 1:
                raise ValueError(f"{where}, {name}: {count} samples are missing at the record's end; crop them off")
            if count > limit:
                raise ValueError(f"{where}, {name}: a gap of {count} samples; at most {limit} may be filled")
        filled.append(f"{name}: {int(absent.sum())} samples in {len(gaps)} gaps")
        spline = CubicSpline(recording.time[~absent], values[~absent])
        return np.where(absent[:, None], spline(recording.time), values)

    changes = recording.each(mend)
    done = "; ".join(filled) or "there were none"
    return recording.noted(f"filled gaps of up to {limit} samples by a cubic spline: {done}", **changes)


def _with_lacking_rows(recording: Recording) -> Recording:
    """The recording with a row of NaN for every sample that the file leaves out."""
    steps = np.diff(recording.time) * recording.rate
    holes = np.flatnonzero(steps > HOLE)
    if not len(holes):
        return recording
    whole = np.round(steps[holes]).astype(int)
    if (np.abs(steps[holes] - whole) > 0.25).any():
        at = holes[int(np.argmax(np.abs(steps[holes] - whole)))]
        raise ValueError(
            f"{recording.at(at, at + 1)}: {steps[at]:.4g} sampling intervals lie between these, no whole number; the "
            "clock has a jump that cannot be filled"
        )
    at = np.repeat(holes + 1, whole - 1)
    share = np.concatenate([np.arange(1, count) / count for count in whole])
    times = recording.time[at - 1] + share * (recording.time[at] - recording.time[at - 1])
    changes = recording.each(lambda _, values: np.insert(values, at, np.nan, axis=0))
    if recording.leg is not None:
        changes["leg"] = np.insert(recording.leg, at, recording.leg[at - 1])
    return recording.noted(
        f"{len(at)} samples lack in {len(holes)} places of the file: rows of missing values put there",
        time=np.insert(recording.time, at, times), rows=np.insert(recording.rows, at, recording.rows[at - 1]),
        **changes,
    )  # fmt: skip
