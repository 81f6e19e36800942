"""How a tube with fins is flattened: the part that its static experiments share."""

from typing import Annotated, Literal

from pydantic import Field

from lab.materials import Frozen
from lab.specimens import FinnedTube
from lab.units import Quantity

#: What goes on at an increment of ``FinPush``: channel ``stage`` holds the place in this list.
FIN_STAGES = ("rest", "pinch", "push")
#: 40 psi, the highest of the buckling test (4.5.1), Pa.
FLAT_PRESSURE = 275790.29


class FinDrive(Frozen):
    """The tube's top and bottom approach one another along y, or its chambers are inflated.

    A pinch moves the crest lines y = +-R within ``pinch_length`` about mid-length, each half-way, and leaves them free
    in x and z.  ASSUMED: the text pinches "at the midpoint of the tube" and no more; the lines are as long as the
    chambers.  With ``drive`` pinch ``pressure`` has no part in it, with pressure neither ``travel`` nor
    ``pinch_length`` has: the tube goes where the air takes it.
    """

    travel: Annotated[float, Quantity("m", "mm"), Field(ge=0, description="Approach of top and bottom.")] = 0.033
    #: None: of the chambers.
    pinch_length: Annotated[float, Quantity("m", "mm"), Field(gt=0)] | None = None
    drive: Literal["pinch", "pressure"] = "pinch"
    pressure: Annotated[float, Quantity("Pa", "kPa"), Field(ge=0, description="In the chambers, over outside.")] = (
        FLAT_PRESSURE
    )
    increments: int = Field(200, ge=4, le=5000, description="Recorded on the way to the full pinch or pressure.")

    def pinched_length(self, specimen: FinnedTube) -> float:
        """Length of the crest lines that are moved, m."""
        return specimen.chambers.length if self.pinch_length is None else self.pinch_length

    def misfit(self, specimen: FinnedTube) -> str:
        """Why this cannot be done to ``specimen``; empty where it can."""
        if self.drive == "pressure":
            return "" if specimen.chambers.number else "drive 'pressure' needs chambers, and this tube has none"
        if self.travel >= 2 * specimen.inner_radius:
            return (
                f"travel {1e3 * self.travel:g} mm is more than the inside of the tube has, "
                f"{2e3 * specimen.inner_radius:g} mm"
            )
        if self.pinched_length(specimen) > specimen.length:
            return (
                f"pinch_length {1e3 * self.pinched_length(specimen):g} mm exceeds the tube's length, "
                f"{1e3 * specimen.length:g} mm"
            )
        return ""
