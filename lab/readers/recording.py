"""A measurement as it came out of a file, and as the steps of its user leave it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Release(NamedTuple):
    """When a held part was let go: on the file's clock, and how far off that may be, both in s."""

    time: float
    uncertainty: float


@dataclass(frozen=True)
class Recording:
    """Sensor channels over time in SI units.  Nothing is changed without a line in ``history``.

    Parameters
    ----------
    source
        Name of the file.
    time
        Clock of the samples, increasing, (n,), s.
    rate
        Nominal sampling rate, Hz.
    rows
        Row of the file (frame, in C3D) that each sample stems from or lies next to, (n,).
    markers
        Name to places, or after the step ``rest`` displacements from rest, (n, 3), m.  NaN: not seen.
    wrench
        Force and moment, (n, 6), N and N m.
    pose
        Position and rotation vector of the robot's tool, after ``rest`` its motion from rest, (n, 6), m and rad.
    leg
        Number of the static test's leg at each sample, -1 outside of legs, (n,).
    up
        Unit vector that points up, in the axes of the markers, (3,).  None: the file does not say.
    specimen, declared
        Name of the specimen as the file states it, and fields of it that it states (``{"twist": "90 deg"}``).
    rest
        Place of each marker at rest, (3,), m, once ``rest`` has been taken off.
    release
        Where the clock was set to zero.
    unit_of_rows
        ``row`` or ``frame``.
    history
        What was read and done, one sentence each.
    """

    source: str
    time: Array
    rate: float
    rows: NDArray[np.int64]
    markers: Mapping[str, Array] = field(default_factory=dict)
    wrench: Array | None = None
    pose: Array | None = None
    leg: NDArray[np.int64] | None = None
    up: Array | None = None
    specimen: str = ""
    declared: Mapping[str, str] = field(default_factory=dict)
    rest: Mapping[str, Array] = field(default_factory=dict)
    release: Release | None = None
    unit_of_rows: str = "row"
    history: tuple[str, ...] = ()

    def noted(self, sentence: str, **changes: Any) -> Self:
        """Copy with other values and one more line of history."""
        return replace(self, **changes, history=(*self.history, sentence))

    def channels(self) -> dict[str, Array]:
        """Every continuous channel by name: markers, ``wrench``, ``pose``."""
        found = {f"marker {name!r}": values for name, values in self.markers.items()}
        found |= {} if self.wrench is None else {"wrench": self.wrench}
        return found | ({} if self.pose is None else {"pose": self.pose})

    def each(self, work: Callable[[str, Array], Array]) -> dict[str, Any]:
        """Changes that replace every continuous channel by ``work(name, values)``."""
        return {
            "markers": {name: work(f"marker {name!r}", values) for name, values in self.markers.items()},
            "wrench": None if self.wrench is None else work("wrench", self.wrench),
            "pose": None if self.pose is None else work("pose", self.pose),
        }

    def at(self, first: int, last: int | None = None) -> str:
        """Place in the file as text: ``beam.csv, row 12`` or ``beam.csv, rows 12 to 15``."""
        begin, end = self.rows[first], self.rows[first if last is None else last]
        if begin == end:
            return f"{self.source}, {self.unit_of_rows} {begin}"
        return f"{self.source}, {self.unit_of_rows}s {begin} to {end}"


def runs(flags: NDArray[Any]) -> list[tuple[int, int]]:
    """First and last index of every stretch of true values.

    Examples
    --------
    >>> runs(np.array([True, False, True, True]))
    [(0, 0), (2, 3)]
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(int)))
    return [(int(a), int(b) - 1) for a, b in edges.reshape(-1, 2)]
