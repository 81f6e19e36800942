"""The pre-twisted beam of chapter 5."""

from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from lab.materials import Frozen, Material
from lab.specimens.load_frame import LoadFrame
from lab.units import Quantity


class TwistedBeam(Frozen):
    """Straight beam of rectangular section that turns steadily along its axis (table 5.2).

    x runs along the axis from the clamp to the tip, y across, z is the shaking direction.  The
    section's width lies at the angle ``root_angle + twist * x / length`` from +y, right-handed
    about +x: with both zero the width is along y.
    """

    kind: Literal["TwistedBeam"] = "TwistedBeam"
    length: Annotated[float, Quantity("m", "mm"), Field(gt=0)] = 0.050
    width: Annotated[float, Quantity("m", "mm"), Field(gt=0)] = 0.020
    thickness: Annotated[float, Quantity("m", "mm"), Field(gt=0)] = 0.003
    #: phi, right-handed about +x when positive.
    twist: Annotated[float, Quantity("rad", "deg"), Field(ge=-2 * np.pi, le=2 * np.pi)] = np.pi / 2
    #: How the clamp is turned about +x.  Table 5.1 does not say, see the study's readings.
    root_angle: Annotated[float, Quantity("rad", "deg"), Field(ge=-np.pi, le=np.pi)] = 0.0
    #: Weighed mass.  None: density times volume.  The text gives both 5.17 g and 1210 kg/m^3, which
    #: is 3.63 g for this volume; when given, the mass wins and is spread evenly.
    mass: Annotated[float, Quantity("kg", "g"), Field(gt=0)] | None = None
    #: Mass glued to the tip face (markers and their carrier).
    tip_mass: Annotated[float, Quantity("kg", "g"), Field(ge=0)] = 0.0
    #: Frame on the tip face with a weight at a corner; None: nothing but ``tip_mass``.
    load_frame: LoadFrame | None = None
    material: Material = Material()

    @model_validator(mode="after")
    def _is_thin(self) -> "TwistedBeam":
        if self.thickness > self.width:
            raise ValueError(
                f"thickness {self.thickness} m exceeds width {self.width} m; exchange them or turn the root"
            )
        return self

    @property
    def area(self) -> float:
        """Section area, m^2."""
        return self.width * self.thickness

    @property
    def beam_mass(self) -> float:
        """Mass of the beam without what the tip carries, kg."""
        return self.material.density * self.area * self.length if self.mass is None else self.mass

    @property
    def effective_density(self) -> float:
        """Density that gives ``beam_mass``, kg/m^3."""
        return self.beam_mass / (self.area * self.length)

    def section_angle(self, x: float | NDArray[np.float64]) -> float | NDArray[np.float64]:
        """Angle of the width direction from +y at ``x`` (m), rad."""
        return self.root_angle + self.twist * x / self.length

    def mirrored(self) -> "TwistedBeam":
        """The beam as a mirror in the plane z = 0 shows it: the opposite chirality."""
        frame = self.load_frame.mirrored() if self.load_frame else None
        return self.model_copy(update={"twist": -self.twist, "root_angle": -self.root_angle, "load_frame": frame})

    def geometry(self) -> dict[str, float]:
        """The fields that a mesh depends on, SI."""
        return self.model_dump(include={"length", "width", "thickness", "twist", "root_angle"})
