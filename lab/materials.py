"""Materials as a specimen carries them; the laws themselves are in ``fea``."""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from lab.units import Quantity


class Frozen(BaseModel):
    """Base of every input of the bench: immutable, and an unknown key is an error."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Material(Frozen):
    """Isotropic elastic solid with linear damping.

    Defaults are Ultimaker TPU 95A as the dissertation quotes its datasheet (5.5: 26 MPa; 5.4.2:
    1210 kg/m^3).  Poisson's ratio and both damping figures are nowhere published: ASSUMED values.
    """

    law: Literal["saint-venant-kirchhoff", "neo-hookean"] = Field(
        "saint-venant-kirchhoff", description="Hyperelastic law; both agree with Hooke's at small strain."
    )
    youngs_modulus: Annotated[float, Quantity("Pa", "MPa"), Field(gt=0)] = 26e6
    poisson_ratio: float = Field(0.45, gt=-1, lt=0.5, description="ASSUMED: not published; usual for TPU.")
    density: Annotated[float, Quantity("kg/m^3", "kg/m^3"), Field(gt=0)] = 1210.0
    #: Kelvin-Voigt time tau: viscous stress = tau * elasticity : strain rate.
    viscous_time: Annotated[float, Quantity("s", "ms"), Field(ge=0)] = 1e-3
    #: Mass-proportional (Rayleigh alpha) damping rate.
    mass_damping: Annotated[float, Quantity("1/s", "1/s"), Field(ge=0)] = 0.0

    @property
    def shear_modulus(self) -> float:
        """mu = E / (2 (1 + nu)), Pa."""
        return self.youngs_modulus / (2.0 * (1.0 + self.poisson_ratio))

    @property
    def lame_lambda(self) -> float:
        """lambda = E nu / ((1 + nu)(1 - 2 nu)), Pa."""
        nu = self.poisson_ratio
        return self.youngs_modulus * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))
