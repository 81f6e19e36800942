"""Stretches of a recording's clock."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lab.readers.recording import Recording


@dataclass(frozen=True)
class Window:
    """A stretch of the clock: between ``start`` and ``end``, or the ``first`` or ``last`` so many seconds, s."""

    start: float | None = None
    end: float | None = None
    first: float | None = None
    last: float | None = None

    def of(self, recording: Recording, what: str) -> slice:
        """Its samples.

        Raises
        ------
        ValueError
            When there is none.
        """
        time = recording.time
        begin = time[-1] - self.last if self.last is not None else self.start
        end = time[0] + self.first if self.first is not None else self.end
        hair = 1e-3 / recording.rate
        inside = np.ones(len(time), dtype=bool)
        inside &= True if begin is None else time >= begin - hair
        inside &= True if end is None else time <= end + hair
        if not inside.any():
            raise ValueError(
                f"{recording.source}: {what}: no sample between {_said(begin)} and {_said(end)}; the record runs from "
                f"{time[0]:.6g} to {time[-1]:.6g} s"
            )
        found = np.flatnonzero(inside)
        return slice(int(found[0]), int(found[-1]) + 1)


def _said(time: float | None) -> str:
    return "its end" if time is None else f"{time:.6g} s"


def between(recording: Recording, part: slice) -> str:
    """A stretch as text."""
    time = recording.time[part]
    return f"{time[0]:.6g} to {time[-1]:.6g} s ({len(time)} samples)"


def crop(recording: Recording, window: Window) -> Recording:
    """Keep the samples of one stretch."""
    part = window.of(recording, "crop")
    return cut(recording, part, f"cropped to {between(recording, part)} of {len(recording.time)}")


def cut(recording: Recording, part: slice | NDArray[np.int64], sentence: str) -> Recording:
    """Keep some samples."""
    changes = recording.each(lambda _, values: values[part])
    if recording.leg is not None:
        changes["leg"] = recording.leg[part]
    return recording.noted(sentence, time=recording.time[part], rows=recording.rows[part], **changes)
