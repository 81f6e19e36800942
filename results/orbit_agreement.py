"""How far two performers agree on the sense of travel along a series of orbits."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lab.orbits import Reversal, ranges, reversals, sense
from results.orbit_series import Track

#: Orbits with a smaller ratio of their axes look like lines, and their sense of travel hardly matters.
LINE_LIKE = 0.1


@dataclass(frozen=True)
class Agreement:
    """Senses and reversals of a track beside those of a reference.

    Parameters
    ----------
    compared, same
        Number of swept values at which both have an orbit, and at which the senses are equal.
    clear, clear_same
        The same where the reference's orbit is no line (``LINE_LIKE``).
    where
        First and last value of every run of compared neighbours with equal senses, SI.
    pairs
        Ours and theirs: reversals to the same sense, the nearest first.
    missing, surplus
        Reversals of the reference without one of ours, and the other way round.
    """

    compared: int
    same: int
    clear: int
    clear_same: int
    where: tuple[tuple[float, float], ...]
    pairs: tuple[tuple[Reversal, Reversal], ...]
    missing: tuple[Reversal, ...]
    surplus: tuple[Reversal, ...]

    @property
    def farthest(self) -> float:
        """Largest distance within a pair, SI; NaN without pairs."""
        return max((abs(ours.at - theirs.at) for ours, theirs in self.pairs), default=math.nan)


def agreement(track: Track, reference: Track) -> Agreement:
    """How far the track's senses of travel are those of the reference."""
    _, mine, its = np.intersect1d(track.values, reference.values, return_indices=True)
    ours, theirs = track.axis_ratio[mine], reference.axis_ratio[its]
    known = np.isfinite(ours) & np.isfinite(theirs)
    same = np.array([sense(a) == sense(b) for a, b in zip(ours[known], theirs[known], strict=True)], dtype=bool)
    clear = np.abs(theirs[known]) > LINE_LIKE
    found, wanted = turns(track), turns(reference)
    pairs = _paired(found, wanted)
    return Agreement(
        len(same), int(same.sum()), int(clear.sum()), int((same & clear).sum()),
        tuple(ranges(track.values[mine][known], same)), pairs,
        tuple(r for r in wanted if r not in [pair[1] for pair in pairs]),
        tuple(r for r in found if r not in [pair[0] for pair in pairs]),
    )  # fmt: skip


def turns(track: Track) -> list[Reversal]:
    """Where the sense of travel reverses along a track."""
    return reversals(track.values, track.axis_ratio)


def line_like(track: Track) -> NDArray[np.bool_]:
    """Which orbits look like lines (n,)."""
    looks: NDArray[np.bool_] = np.abs(track.axis_ratio) <= LINE_LIKE
    return looks


def _paired(found: list[Reversal], wanted: list[Reversal]) -> tuple[tuple[Reversal, Reversal], ...]:
    """Each reversal in one pair at most; the nearest find each other first."""
    candidates = [(ours, theirs) for ours in found for theirs in wanted if ours.after == theirs.after]
    pairs: list[tuple[Reversal, Reversal]] = []
    for ours, theirs in sorted(candidates, key=lambda pair: abs(pair[0].at - pair[1].at)):
        if not any(ours is a or theirs is b for a, b in pairs):
            pairs.append((ours, theirs))
    return tuple(pairs)
