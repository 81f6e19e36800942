"""Whether a pinched tube comes back (3.6)."""

from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from lab.experiments.pinch_drive import STAGES, PinchDrive
from lab.hinge import section_shape
from lab.records import Record, Scalar
from lab.units import Quantity


class ShapeRecovery(PinchDrive):
    """A tube under a hanging weight is pinched, let go, and, where asked, pinched across to bring it back (3.6).

    Stages: load, pinch, release of the tendons; with ``recover``, the other pairs are pulled until their forces
    are ``recover_force`` times the closing force, and let go.

    Sensed as in ``PinchedBending``.
    """

    kind: Literal["ShapeRecovery"] = "ShapeRecovery"
    in_motion: ClassVar[bool] = False
    load: Annotated[float, Quantity("N", "N"), Field(gt=0, description="500 g weigh 4.905 N.")] = 4.905
    direction: Annotated[float, Quantity("rad", "deg")] = -np.pi / 2
    place: Annotated[float, Quantity("m", "mm"), Field(description="Beyond the block's face.")] = 0.0
    recover: bool = True
    recover_force: float = Field(0.5, gt=0, le=2, description="Force of the other pairs over F_p at closing.")
    bend_duration: Annotated[float, Quantity("s", "s"), Field(gt=0)] = 1.0
    bend_increments: int = Field(10, ge=2, le=1000, description="Recorded per stage but the pinch.")

    def reduce(self, record: Record) -> dict[str, Scalar]:
        """Flattening left after every stage: 0 is what the loaded tube had before the pinch, 1 the closed one."""
        stage = record["stage"]

        def width(name: str) -> float:
            places = np.flatnonzero(stage == STAGES.index(name))
            return section_shape(record["section"][places[-1]]).width if len(places) else float("nan")

        before, closed = width("load"), width("pinch")
        left = {name: (before - width(name)) / (before - closed) for name in ("release", "recover", "let go")}
        drop = {
            name: record["pushed"][np.flatnonzero(stage == STAGES.index(name))[-1]]
            for name in ("load", "pinch", "release", "let go") if (stage == STAGES.index(name)).any()
        }  # fmt: skip
        words = {"release": "release", "recover": "active pinch", "let go": "active pinch was let go"}
        return {
            **{f"flat_after_{name.replace(' ', '_')}": Scalar(value, "1", f"flattening left after the {words[name]}")
               for name, value in left.items()},
            **{f"drop_{name.replace(' ', '_')}": Scalar(float(value), "m", f"motion of the weight, stage {name}")
               for name, value in drop.items()},
        }  # fmt: skip
