"""A tube along its pinch: the hinge at every recorded share of the pinch."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.specimens import PinchedTube
from prb.hinge_curves import TOUCH, HingeCurves, HingeState
from prb.model import PrbModel
from prb.statics import Chain
from prb.tube_statics import Bent, chain_of, pose

Array = NDArray[np.float64]
#: Share of the pinch over which the tendons' part of a bend is differenced.  Between first touch and closing there is
#: hardly any travel to divide by.
_SPAN = 0.05
#: States recorded after the first touch.
_TOUCHING = 4


@dataclass(frozen=True)
class Row:
    """One recorded increment: its stage and share of the pinch, the hinge (None: not learned), and what it bears."""

    stage: str
    share: float
    state: HingeState | None
    chain: Chain
    bent: Bent


class Walk:
    """States of one tube along its pinch.

    Parameters
    ----------
    tube, experiment, model
        ``experiment`` is any with a ``PinchDrive``.

    Attributes
    ----------
    limited
        Whether ``force_limit`` ended the pinch, once ``shares`` has been asked.
    """

    def __init__(self, tube: PinchedTube, experiment: Any, model: PrbModel) -> None:
        self.tube, self.experiment, self.model = tube, experiment, model
        self.curves: HingeCurves | None = model.hinge
        self.limited = False

    def at(self, share: float, *, pinching: bool = False) -> tuple[HingeState | None, Chain]:
        """The hinge and its chain at a share of the learned pinch, with the tendons held unless it is ``pinching``."""
        if self.curves is None:
            return None, chain_of(self.model, self.tube)
        state = self.curves.state(self.experiment.pinch_angle, share, pinching=pinching)
        return state, chain_of(self.model.pinched(state.parameters), self.tube)

    def shares(self) -> list[float]:
        """Of the travel at which the pinch is recorded, after rest, the first touch among them."""
        assert self.curves is not None
        e = self.experiment
        even = TOUCH * np.arange(1, e.increments + 1) / e.increments
        if self.curves.touches(e.pinch_angle):
            even = np.concatenate([even, np.linspace(TOUCH, 1.0, _TOUCHING + 1)[1:]])
        found = []
        for share in even.tolist():
            state = self.curves.state(e.pinch_angle, share)
            found.append(share)
            self.limited = e.force_limit is not None and state.force > e.force_limit
            if self.limited or state.contact >= e.firmness * state.force > 0:
                break
        return found

    def unloaded(self) -> Iterator[Row]:
        """From rest to the end of the pinch, the tube straight."""
        for stage, share in [("rest", 0.0), *(("pinch", share) for share in self.shares())]:
            state, chain = self.at(share, pinching=True)
            yield Row(stage, share, state, chain, Bent(chain.slack, 0.0))

    def force(self, row: Row) -> float:
        """F_p, N, with the part of the bend: 1/2 theta . dK/dq theta at a held travel q."""
        if row.state is None or self.curves is None or row.share == 0.0:
            return 0.0
        turn, alpha = pose(row.chain, row.bent.joints, self.tube.length)[3:5], self.experiment.pinch_angle
        high = min(row.share, TOUCH)
        low = max(high - _SPAN, 0.0)
        after, before = (self.curves.state(alpha, share, pinching=True) for share in (high, low))
        if after.travel <= before.travel:
            return row.state.force
        slope = (after.bending - before.bending) / (after.travel - before.travel)
        return row.state.force + float(turn @ slope @ turn) / 2
