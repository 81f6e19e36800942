"""The clock of a file: its time column against the rate that it states."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Largest relative difference between a stated rate and that of the time column.
_SAME_RATE = 5e-3
#: A step longer than this many usual ones is a hole: samples are missing between two rows.
HOLE = 1.5


def clock(name: str, rows: NDArray[np.int64], column: Array | None, stated: float | None) -> tuple[Array, float, str]:
    """Time of each sample, sampling rate, and a sentence on where they come from.

    Parameters
    ----------
    name, rows
        File, and the row of each sample in it, (n,).
    column
        Time column, (n,), s; None: the rate alone makes the clock, which then starts at zero.
    stated
        Rate that the file or its sidecar states, Hz.

    Raises
    ------
    ValueError
        When the time runs backwards or repeats, or disagrees with the rate; naming file and row.
    """
    if len(rows) < 2:
        raise ValueError(f"{name}: {len(rows)} sample; at least 2 are needed")
    if column is None:
        if stated is None:
            raise ValueError(f"{name}: neither a rate nor a time column is given; one of them is needed")
        return np.arange(len(rows)) / stated, stated, f"clock from the stated rate of {stated:g} Hz"
    steps = np.diff(column)
    if (steps <= 0).any():
        at = int(np.argmax(steps <= 0))
        how = "repeats" if steps[at] == 0 else "runs backwards"
        raise ValueError(f"{name}, row {rows[at + 1]}, time column: {how}, {column[at + 1]:g} s after {column[at]:g} s")
    usual = float(np.median(steps))
    # The mean over all steps but holes does not suffer from time stamps that were rounded.
    rate = 1 / float(steps[steps < HOLE * usual].mean())
    if stated is None:
        return column, rate, f"clock from the time column, {rate:.6g} Hz"
    if abs(rate / stated - 1) > _SAME_RATE:
        raise ValueError(f"{name}: stated rate {stated:g} Hz, but the time column runs at {rate:.5g} Hz")
    even = column[0] + np.arange(len(rows)) / stated
    worst = float(np.abs(even - column).max())
    if worst < 0.5 / stated:
        return even, stated, f"clock from the stated rate of {stated:g} Hz (time column within {worst * 1e3:.3g} ms)"
    return column, stated, f"clock from the time column (up to {worst:.3g} s off the stated {stated:g} Hz)"
