"""Pinching a tube until its walls or pads touch (3.2, 3.4)."""

from typing import ClassVar, Literal

import numpy as np

from lab.experiments.pinch_drive import STAGES, PinchDrive
from lab.hinge import bending_stiffness, section_shape
from lab.pinching import axis_difference, ideal_axis
from lab.records import Record, Scalar


class Pinch(PinchDrive):
    """A tube held at its proximal block, its distal one free, is pinched until it closes.

    Sensed at every increment, rest first (index ``increment``):

    ``stage`` (n,), place in ``STAGES``; ``travel`` (n,), m; ``force`` (n,), F_p, N; ``pair_force`` (n, pairs), N;
    ``shortening`` (n, pairs), of the tendons, m; ``gap`` (n,), smallest between inner walls, m, NaN where far;
    ``contact_force`` (n,), N; ``pose`` (n, 6), of the distal block's face, m and rotation vector, rad; ``section``
    (n, m, 2), x and y of the middle of the wall at mid-length, in order, m; ``flexibility`` (n, 6, 6), change of the
    pose by a small wrench at the face's centre, the tendons' lengths held, m/N and so on; ``strain`` (n,), largest
    principal strain of the wall outside the pads; ``unstable`` (n,), negative eigenvalues, -1 unknown.
    """

    kind: Literal["Pinch"] = "Pinch"
    in_motion: ClassVar[bool] = False

    def reduce(self, record: Record) -> dict[str, Scalar]:
        """Closing force, and shape and stiffness of the closed section; NaN with the reason where there is none."""
        found = closing(record)
        shape, stiffness = section_shape(record["section"][-1]), bending_stiffness(record["flexibility"][-1])
        ideal = ideal_axis(self.pinch_angle) if self.pair_forces is None else float("nan")
        no_axis = "not defined: no direction differs from the others"
        torsion = 1.0 / record["flexibility"][-1][5, 5]
        closed = np.isfinite(found["touch_force"].value)
        return {
            **found,
            "deformation_axis": Scalar(shape.axis, "rad", "line of largest extent of the section"
                                       + ("" if np.isfinite(shape.axis) else f" {no_axis}")),
            "deformation_axis_error": Scalar(axis_difference(shape.axis, ideal), "rad", "from alpha / 2"),
            "hinge_axis": Scalar(stiffness.axis, "rad", "axis of least bending stiffness"
                                 + ("" if np.isfinite(stiffness.axis) else f" {no_axis}")),
            "hinge_axis_error": Scalar(axis_difference(stiffness.axis, ideal), "rad", "from alpha / 2"),
            "k_soft": Scalar(stiffness.soft, "N*m/rad", "bending stiffness about the hinge axis"),
            "k_stiff": Scalar(stiffness.stiff, "N*m/rad", "bending stiffness across the hinge axis"),
            "k_torsion": Scalar(torsion, "N*m/rad", "torsional stiffness"),
            "anisotropy": Scalar(stiffness.stiff / stiffness.soft, "1", "k_stiff over k_soft"),
            "flattening": Scalar(1.0 - shape.width / section_shape(record["section"][0]).width, "1",
                                 "share of the section's width that is gone" + ("" if closed else ", not closed")),
            "largest_strain": Scalar(float(np.nanmax(record["strain"])), "1", "largest principal strain of the wall"),
        }  # fmt: skip


def closing(record: Record) -> dict[str, Scalar]:
    """Force and travel at which the pinch first touches, and the largest force up to there, which it takes to close.

    The touch is where the last two open states lead to, by their gaps; of one gap alone, the last open state.

    Needs ``stage``, ``force``, ``travel``, ``gap`` and ``contact_force`` (n,); NaN where it never touched.
    """
    pinching = record["stage"] <= STAGES.index("pinch")
    force, travel, gap, contact = (record[name][pinching] for name in ("force", "travel", "gap", "contact_force"))
    touching = np.flatnonzero(contact > 0)
    if not len(touching):
        force_words = touch_words = travel_words = "the walls never touched"
        at, first, largest = (float("nan"),) * 3
    else:
        here = int(touching[0])
        force_words = "largest F_p up to the first touch"
        touch_words, travel_words = "F_p at the first touch", "travel of F_p at the first touch"
        # Contact of stiff pads lets F_p jump within micrometres: what led there tells of the touch, not what follows.
        last, before = max(here - 1, 0), max(here - 2, 0)
        closed = gap[before] - gap[last]
        share = float(np.clip(gap[last] / closed, 0.0, 1.0)) if closed > 0 else 0.0
        # Contact only adds to it.
        first = float(min(force[last] + share * (force[last] - force[before]), max(force[last], force[here])))
        at = float(min(travel[last] + share * (travel[last] - travel[before]), travel[here]))
        largest = max(float(force[:here].max(initial=0.0)), first)
    return {
        "closing_force": Scalar(largest, "N", force_words),
        "touch_force": Scalar(first, "N", touch_words),
        "touch_travel": Scalar(at, "m", travel_words),
    }
