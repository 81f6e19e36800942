"""Pushing a fin with a plate until it buckles (4.5.1)."""

from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from lab.experiments.fin_drive import FIN_STAGES, FinDrive
from lab.records import Record, Scalar
from lab.units import Quantity

#: Fall of the force from its peak, relative to it, that counts as buckling and not as noise of the contact.
_FALL = 0.01
#: Share of the push over which the initial stiffness is taken.
_INITIAL = 0.1


class FinPush(FinDrive):
    """The tube is flattened and held, then a rigid plate pushes the fin at +x, in the x-z plane.

    Sense ``opposite``: the plate pushes the concave face away from the tube, as water does that resists the fin while
    it closes (power stroke).  The fin bends with the centre of its lengthwise curvature on the other side than that
    of its arc, its free edges in tension.  Sense ``equal``: the plate pushes the convex face towards the tube, as
    water does in the recovery stroke; the edges are compressed and buckle.

    The plate is perpendicular to its way, which is along the fin's crown normal after the flattening (or against it).
    Its edge lies ``place`` times the fin's length from the crease, and it reaches from there beyond the tip: a fin
    that turns about its crease runs ahead of the plate further out, so that the edge is what pushes.  ASSUMED: the
    text says neither where nor along what line, only that the plate ran on a linear rail over 20 mm from the fin's
    neutral configuration.

    Sensed at every increment, rest first (index ``increment``): ``stage`` (n,), place in ``FIN_STAGES``; ``travel``
    (n,), of the pinch, m; ``push`` (n,), way of the plate from first touch, m; ``force`` (n,), of the plate along its
    way, N; ``p``, ``tip`` (n, 3), displacements of P and of the middle of the tip, m; ``contact`` (n,), distance of
    the contact force from the crease's middle along the fin's crown line, m, NaN where nothing touches;
    ``fin_radius``, ``fin_angle``, ``energy``, ``strain`` (n,) as in ``ShapePropagation``.
    """

    kind: Literal["FinPush"] = "FinPush"
    in_motion: ClassVar[bool] = False
    increments: int = Field(40, ge=4, le=5000, description="Recorded on the way to the pinched state.")
    push: Annotated[float, Quantity("m", "mm"), Field(gt=0, description="Way of the plate.")] = 0.020
    sense: Literal["opposite", "equal"] = "opposite"
    place: float = Field(0.85, gt=0, le=1, description="Of the plate's edge from the crease, over the fin's length.")
    push_increments: int = Field(80, ge=4, le=5000, description="Recorded while the plate pushes.")

    def reduce(self, record: Record) -> dict[str, Scalar]:
        """Limit load, stiffness at first touch and torque about the crease.

        The limit is the first peak of the force from which it falls by a hundredth before it rises above it again;
        NaN where it only rises.  The text takes the largest force over the push, ``force_max``, whichever it is.
        """
        pushing = record["stage"] == FIN_STAGES.index("push")
        way, force = record["push"][pushing], record["force"][pushing]
        if not len(way):
            why = "the plate was never reached"
            nothing = Scalar(float("nan"), "N", why)
            return {
                "force_max": nothing, "limit_load": nothing, "push_at_limit": Scalar(float("nan"), "m", why),
                "stiffness_initial": Scalar(float("nan"), "N/m", why), "torque": Scalar(float("nan"), "N*m", why),
            }  # fmt: skip
        peak = first_peak(force)
        buckled = "first peak of the force" if peak >= 0 else "the force never fell"
        lever = self.place * float(record.specimen["fin_length"])
        early = max(int(np.searchsorted(way, way[0] + _INITIAL * self.push)), 2)
        stiffness = float(np.polyfit(way[:early], force[:early], 1)[0]) if len(way) > 1 else float("nan")
        largest = float(force.max())
        return {
            "force_max": Scalar(largest, "N", "largest force of the plate"),
            "limit_load": Scalar(float(force[peak]) if peak >= 0 else float("nan"), "N", buckled),
            "push_at_limit": Scalar(
                float(way[peak]) if peak >= 0 else float("nan"), "m", f"way at the limit; {buckled}"
            ),
            "stiffness_initial": Scalar(stiffness, "N/m", "slope over the first tenth of the push"),
            "torque": Scalar(largest * lever, "N*m", "of the largest force about the middle of the crease"),
            "torsional_stiffness": Scalar(
                stiffness * lever**2, "N*m/rad", "initial, of a hinge at the crease's middle"
            ),
        }


def first_peak(force: NDArray[np.float64], fall: float = _FALL) -> int:
    """Number of the first peak of a force (n,) that then falls by ``fall`` of it before it is exceeded; -1: none.

    Examples
    --------
    >>> import numpy as np
    >>> first_peak(np.array([0.0, 1.0, 2.0, 1.5, 3.0, 0.0])), first_peak(np.array([0.0, 1.0, 2.0]))
    (2, -1)
    """
    best = 0
    for here, value in enumerate(force):
        if value > force[best]:
            best = here
        elif force[best] > 0 and value < (1 - fall) * force[best]:
            return best
    return -1
