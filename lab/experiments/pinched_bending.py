"""Bending a tube about its hinge: dead load, hanging weight, push test (3.2, 3.5)."""

from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from lab.experiments.pinch_drive import STAGES, PinchDrive
from lab.records import Record, Scalar
from lab.units import Quantity


class PinchedBending(PinchDrive):
    """The tube is pinched until it closes, the tendons' lengths are held, and the distal block is loaded.

    Either a dead ``load`` or a ``push``, a motion at constant speed that leaves the block free in everything else.
    Both act along ``direction``, on the point of the block's middle line ``place`` beyond its face.  Fig. 3.2(d) loads
    along -y; where the pusher of fig. 3.6 touched and how far it went is not published: ASSUMED.

    Sensed as in ``Pinch``, and ``load`` (n,), N, and ``pushed`` (n,), m, force on and motion of the point along
    ``direction`` (motion counted from rest).
    """

    kind: Literal["PinchedBending"] = "PinchedBending"
    in_motion: ClassVar[bool] = False
    pinched: bool = Field(True, description="False: the open tube is bent.")
    load: Annotated[float, Quantity("N", "N"), Field(gt=0)] | None = None
    push: Annotated[float, Quantity("m", "mm"), Field(gt=0)] | None = None
    #: From +x, about +z.
    direction: Annotated[float, Quantity("rad", "deg")] = -np.pi / 2
    place: Annotated[float, Quantity("m", "mm"), Field(description="Beyond the block's face; negative inwards.")] = 0.0
    order: Literal["pinch first", "load first"] = "pinch first"
    returns: bool = Field(False, description="Back to where the bending began: for hysteresis.")
    bend_increments: int = Field(10, ge=2, le=1000, description="Recorded on the way there, and on the way back.")
    #: Time of the bending, and of the return.
    bend_duration: Annotated[float, Quantity("s", "s"), Field(gt=0)] = 1.0
    #: Time that the closed tube is given to come to rest before the bending: folds still creep as the pinch ends.
    pause: Annotated[float, Quantity("s", "s"), Field(gt=0)] = 0.25
    #: Stiffness of what pushes, in series with the tube; None: rigid.
    rig_stiffness: Annotated[float, Quantity("N/m", "N/mm"), Field(gt=0)] | None = None

    @model_validator(mode="after")
    def _one_load(self) -> "PinchedBending":
        if (self.load is None) == (self.push is None):
            raise ValueError("give either load or push")
        if self.order == "load first" and (self.load is None or not self.pinched or self.returns):
            raise ValueError("order 'load first' needs a dead load, a pinch, and no return")
        if self.rig_stiffness is not None and self.push is None:
            raise ValueError("rig_stiffness belongs to a push")
        return self

    def reduce(self, record: Record) -> dict[str, Scalar]:
        """Slope of load against motion, where the block went, and what a return left.

        With a compliant rig the motion is that of the stage that pushes, as a lab reads it.

        Needs ``stage``, ``load``, ``pushed`` (n,) and ``pose`` (n, 6).
        """
        stage, load, pose = (record[name] for name in ("stage", "load", "pose"))
        # What a lab reads is the stage's travel, in which its own compliance lies.
        pushed = record["pushed"] + (load / self.rig_stiffness if self.rig_stiffness else 0.0)
        found: dict[str, Scalar] = {}
        bending = np.flatnonzero(stage == STAGES.index("bend"))
        if len(bending):
            # The bending starts from the last state before it.
            path = np.concatenate([[bending[0] - 1], bending])
            slope = np.polyfit(pushed[path], load[path], 1)[0]
            first = slice(0, max(len(path) // 4, 2))
            initial = np.polyfit(pushed[path][first], load[path][first], 1)[0]
            found["k"] = Scalar(float(slope), "N/m", "slope of load against motion of its point, least squares")
            found["k_initial"] = Scalar(float(initial), "N/m", "the same over the first quarter")
        last = bending[-1] if len(bending) else len(stage) - 1
        start = bending[0] - 1 if len(bending) else 0
        moved = pose[last] - pose[start]
        for number, axis in enumerate("xyz"):
            found[f"move_{axis}"] = Scalar(float(moved[number]), "m", "motion of the block's face by the load")
        found["turn"] = Scalar(float(np.linalg.norm(moved[3:])), "rad", "turn of the block by the load")
        axis = np.arctan2(moved[4], moved[3]) % np.pi
        found["turn_axis"] = Scalar(float(axis), "rad", "axis of that turn from +x, across the tube")
        back = np.flatnonzero(stage == STAGES.index("return"))
        if len(back) and len(bending):
            there, again = np.concatenate([[bending[0] - 1], bending]), np.concatenate([[bending[-1]], back])
            given, returned = (float(np.trapezoid(load[way], pushed[way])) for way in (there, again))
            found["loss"] = Scalar((given + returned) / given, "1", "share of the work of bending that is not returned")
        return found
