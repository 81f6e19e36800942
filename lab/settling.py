"""How a shaken motion settles on its steady orbit, seen once a period, and where a slow transient ends.

A beam of little damping keeps its free vibration for hundreds of periods.  Once that shrinks steadily and is small, its
end is foreseen: the motion may go on from the state that the ends of the last periods tend to.  Only what the following
periods themselves show makes an orbit steady, so that an unstable orbit is never taken for one.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from lab.experiments.base_shake import BaseShake

Array = NDArray[np.float64]
#: Smallest share of the largest singular value that is heeded.
_RANK = 1e-9
#: Changes from which the end of a transient is foreseen, and the largest last one from which it may be.
_WINDOW, _SMALL = 8, 0.1
#: Share of the last foresight's change below which another one is worth while, and how far it may reach: so many
#: times what is left of the transient.
_PROGRESS, _REACH = 0.5, 3.0
#: Most periods after which a subharmonic motion is looked for, and the distance then over that after one period.
_SUBHARMONIC, _REPEATED = 8, 0.01


def limit(terms: Array, scale: Array) -> Array:
    """What x[n+1] = A x[n] + b tends to, by reduced rank extrapolation (Sidi, "Vector Extrapolation Methods", 2017).

    The weighted mean of the terms whose next step would be the shortest.  Exact when no more parts of the sequence
    decay than there are steps but one.

    Parameters
    ----------
    terms
        Successive terms, (terms, n), at least three.
    scale
        What makes the steps of the components comparable, (n,).

    Returns
    -------
    limit
        (n,).
    """
    steps = np.diff(terms, axis=0) * scale
    shares, *_ = np.linalg.lstsq((steps[:-1] - steps[-1]).T, -steps[-1], rcond=_RANK)
    last: Array = (1.0 - shares.sum()) * terms[-1] + shares @ terms[1:-1]
    return last


@dataclass
class Settling:
    """A motion on its way to the steady orbit.

    Parameters
    ----------
    scale
        What makes the components of the state comparable, (n,): a speed counts as what it moves in 1 / (2 pi f).
    tolerance
        Transient that may be left over the path's size.

    Attributes
    ----------
    changes
        ``BaseShake.change`` from each period at full amplitude to the next, since the last foresight.
    """

    scale: Array
    tolerance: float
    changes: list[float] = field(default_factory=list)
    _ends: list[Array] = field(default_factory=list)
    #: What was left over the last change, at the slowest shrinking that was seen before a foresight.
    _lasting: float = 0.0
    #: Change at the last foresight.
    _foreseen: float = _SMALL / _PROGRESS

    def add(self, change: float, ends: Array) -> None:
        """Take in the change between two periods and the states at their three ends (3, n)."""
        self.changes.append(change)
        self._ends += list(ends if not self._ends else ends[-1:])

    def resumed(self, tolerance: float) -> "Settling":
        """For a motion that goes on from here by other steps."""
        return Settling(self.scale, tolerance, _lasting=self._lasting)

    @property
    def change(self) -> float:
        """The last change; NaN before there is one."""
        return self.changes[-1] if self.changes else float("nan")

    @property
    def remaining(self) -> float:
        """Transient that may be left, see ``BaseShake.remaining``; a foresight leaves the slowest part of it hidden."""
        told = BaseShake.remaining(self.changes)
        return max(told, self._lasting * self.changes[-1]) if self.changes else told

    @property
    def is_steady(self) -> bool:
        """Whether no more than the tolerance is left."""
        return self.remaining < self.tolerance

    @property
    def repeats(self) -> int:
        """Periods after which the state repeats: 1 when steady, more for a subharmonic motion, 0 if it does not."""
        if self.is_steady:
            return 1
        away = [self._distance(self._ends[-1], end) for end in self._ends[-2 : -_SUBHARMONIC - 2 : -1]]
        return next((n for n, distance in enumerate(away, 1) if distance < _REPEATED * away[0]), 0)

    def foresee(self) -> Array | None:
        """State (n,) at the last end without the transient, from which to go on; None: not yet, or not to be had.

        The changes begin anew after it.
        """
        if len(self.changes) < _WINDOW or self.changes[-1] >= min(_PROGRESS * self._foreseen, self.changes[-_WINDOW]):
            return None
        self._foreseen, self._lasting = self.changes[-1], self.remaining / self.changes[-1]
        ends = np.array(self._ends[-_WINDOW - 2 :])
        foreseen = limit(ends, self.scale)
        reach, last = (self._distance(state, ends[-1]) for state in (foreseen, ends[-2]))
        if reach > _REACH * self._lasting * last:
            return None
        self.changes, self._ends = [], []
        return foreseen

    def reason(self, periods: int, allowed: float) -> str:
        """Why the orbit is not steady after some periods: more than ``allowed`` of the path's size may be left."""
        why = (
            f"not steady after {periods} periods: the last one still changed the path by {100 * self.change:.3g} % of "
            f"its size, so that more than the {100 * allowed:.3g} % that is allowed may be left of the transient"
        )
        if self.repeats > 1:
            why += f"; it is a subharmonic motion, which repeats every {self.repeats} periods"
        return why

    def _distance(self, one: Array, other: Array) -> float:
        return float(np.linalg.norm(self.scale * (one - other)))
