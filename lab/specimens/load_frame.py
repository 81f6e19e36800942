"""Rigid frame on the tip of a shaken beam, which holds a weight at one of its corners (5.6.2, fig. 5.7b)."""

from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from lab.materials import Frozen
from lab.units import Quantity

Corner = Literal["lower-left", "lower-right", "upper-left", "upper-right"]


class LoadFrame(Frozen):
    """Rigid rectangle in the plane of the tip face, its sides along y and z, its centre on the beam's axis.

    Its own mass is spread evenly along its four sides; the weight is a point at a corner.  Only the weight's 20 g are
    published.  ASSUMED, since the text gives neither size nor mass: sides of 40 mm and 10 g, which a printed plastic
    frame around a 20 mm beam may have; and that left and right are seen from the tip towards the clamp with y up, so
    that left is +z.  Both senses of twist are shaken with all corners, hence another view only exchanges names.
    """

    width: Annotated[float, Quantity("m", "mm"), Field(gt=0, description="Side along z.")] = 0.040
    height: Annotated[float, Quantity("m", "mm"), Field(gt=0, description="Side along y.")] = 0.040
    mass: Annotated[float, Quantity("kg", "g"), Field(gt=0, description="Of the frame without the weight.")] = 0.010
    load: Annotated[float, Quantity("kg", "g"), Field(ge=0, description="The weight.")] = 0.020
    corner: Corner = "lower-left"

    @property
    def load_place(self) -> tuple[float, float, float]:
        """The weight's place from the tip's centre in the fixed axes of the beam at rest, m."""
        up, left = self.corner.startswith("upper"), self.corner.endswith("left")
        return (0.0, (0.5 if up else -0.5) * self.height, (0.5 if left else -0.5) * self.width)

    @property
    def total_mass(self) -> float:
        """Mass of frame and weight, kg."""
        return self.mass + self.load

    def moments(self) -> NDArray[np.float64]:
        """Integral of (1, y, z)(1, y, z)^T over the mass (3, 3), kg, kg m, kg m^2, about the tip's centre."""
        along_y, along_z = self.height, self.width
        around = 2.0 * (along_y + along_z)
        # Two sides along y at z = +-width/2 and two along z at y = +-height/2.
        yy = (2.0 * along_y**3 / 12.0 + 2.0 * along_z * along_y**2 / 4.0) / around
        zz = (2.0 * along_z**3 / 12.0 + 2.0 * along_y * along_z**2 / 4.0) / around
        place = np.array([1.0, *self.load_place[1:]])
        return self.mass * np.diag([1.0, yy, zz]) + self.load * np.outer(place, place)

    def mirrored(self) -> "LoadFrame":
        """The frame as a mirror in the plane z = 0 shows it."""
        swap = {"left": "right", "right": "left"}
        height, _, side = self.corner.partition("-")
        return self.model_copy(update={"corner": f"{height}-{swap[side]}"})
