"""How a tube is pinched: the part that all experiments with pinched tubes share."""

from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from lab.materials import Frozen
from lab.pinching import ForceLaw, pair_shares
from lab.units import Quantity

#: What goes on at an increment: channel ``stage`` holds the place in this list.
STAGES = ("rest", "load", "pinch", "bend", "return", "release", "recover", "let go", "settle")


class PinchDrive(Frozen):
    """Tendons along the lines between opposite pads, pulled so that their forces keep a fixed ratio.

    Forces are shared by ``lab.pinching.pair_shares``, or as ``pair_forces`` says.  Each tendon pulls its two pads
    towards one another along the line between them (ASSUMED: the text has collinear forces; a tendon follows its
    pads).  What is moved steadily is the travel that F_p works on: the shortenings of all tendons times their shares.
    F_p follows; the walls or pads touch when contact carries ``firmness`` times F_p.
    """

    pinch_angle: Annotated[float, Quantity("rad", "deg"), Field(ge=0, le=2 * np.pi, description="alpha.")] = 0.0
    law: ForceLaw = "published"
    #: Force of every pair over F_p in place of a law, as 1, 1, 1 for the dimples of fig. 3.2(c).
    pair_forces: tuple[Annotated[float, Field(ge=0)], ...] | None = None
    firmness: float = Field(0.1, gt=0, le=10, description="Contact force over F_p that ends the pinch.")
    #: A pinch that has not closed at this F_p never does; None: no limit but the travel.
    force_limit: Annotated[float, Quantity("N", "N"), Field(gt=0)] | None = None
    #: Time of a whole pinch; the text has "constant speed".  ASSUMED; only viscous materials feel it.
    duration: Annotated[float, Quantity("s", "s"), Field(gt=0)] = 1.0
    increments: int = Field(40, ge=4, le=1000, description="Recorded while the pads of one pair would just meet.")

    @model_validator(mode="after")
    def _one_way(self) -> Any:
        if self.pair_forces is not None:
            if not any(self.pair_forces):
                raise ValueError("pair_forces: at least one must be positive")
            if self.pinch_angle:
                raise ValueError("give either pinch_angle or pair_forces, which stand in its place")
        return self

    def shares(self, pairs: int) -> NDArray[np.float64]:
        """Force of every pair over F_p (pairs,).

        Raises
        ------
        ValueError
            When ``pair_forces`` are not as many, or the law does not know this number of pairs.
        """
        if self.pair_forces is None:
            return pair_shares(self.pinch_angle, pairs, self.law)
        if len(self.pair_forces) != pairs:
            raise ValueError(f"pair_forces: {len(self.pair_forces)} numbers for {pairs} pairs of pads")
        return np.array(self.pair_forces)
