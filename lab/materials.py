"""Materials as a specimen carries them, and those that ship as data files; the laws themselves are in ``fea``."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, GetJsonSchemaHandler, model_validator
from pydantic_core import CoreSchema

from lab.units import Quantity

_SHEETS = Path(__file__).parent / "data" / "materials"

#: Hyperelastic laws; the last three are split into a part without change of volume and one of volume alone.
Law = Literal[
    "saint-venant-kirchhoff", "neo-hookean", "nearly-incompressible-neo-hookean", "mooney-rivlin", "yeoh"
]  # fmt: skip

#: Amount of simple shear up to which a Yeoh law must resist further shear: a stretch of 3.3.
_SOUND_SHEAR = 3.0


class Frozen(BaseModel):
    """Base of every input of the bench: immutable, and an unknown key is an error."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class PronyBranch(Frozen):
    """One branch of a generalised Maxwell model: a spring in series with a dashpot, beside the law itself."""

    ratio: float = Field(gt=0, description="Stiffness of the branch over the long-term stiffness of the law.")
    #: Relaxation time.
    time: Annotated[float, Quantity("s", "s"), Field(gt=0)]


class Material(Frozen):
    """Isotropic elastic solid with linear damping.

    In a study, the name of a data file of ``lab/data/materials`` stands for all its fields (``tpu-95a``).

    Young's modulus and Poisson's ratio are those of small, slow strains under every law; the laws differ
    in what large strains add.  The isochoric laws are, with the invariants I1, I2 of C / J^(2/3) and
    the bulk modulus of E and nu,

        W = c10 (I1 - 3) + c01 (I2 - 3) + c20 (I1 - 3)^2 + c30 (I1 - 3)^3 + U(J),   2 (c10 + c01) = mu

    Defaults are Ultimaker TPU 95A as the dissertation quotes its datasheet (5.5: 26 MPa; 5.4.2:
    1210 kg/m^3).  Poisson's ratio and both damping figures are nowhere published: ASSUMED values.
    """

    law: Law = Field("saint-venant-kirchhoff", description="Hyperelastic law; all agree with Hooke's at small strain.")
    youngs_modulus: Annotated[float, Quantity("Pa", "MPa"), Field(gt=0)] = 26e6
    poisson_ratio: float = Field(0.45, gt=-1, lt=0.5, description="ASSUMED: not published; usual for TPU.")
    density: Annotated[float, Quantity("kg/m^3", "kg/m^3"), Field(gt=0)] = 1210.0
    #: Kelvin-Voigt time tau: viscous stress = tau * elasticity : strain rate.
    viscous_time: Annotated[float, Quantity("s", "ms"), Field(ge=0)] = 1e-3
    #: Mass-proportional (Rayleigh alpha) damping rate.
    mass_damping: Annotated[float, Quantity("1/s", "1/s"), Field(ge=0)] = 0.0
    c01_share: float = Field(0.0, ge=0, le=1, description="mooney-rivlin: c01 / (c10 + c01).")
    c20_ratio: float = Field(0.0, description="yeoh: c20 / c10.")
    c30_ratio: float = Field(0.0, description="yeoh: c30 / c10.")
    prony: tuple[PronyBranch, ...] = Field((), description="Branches that relax: E is the long-term modulus.")

    @model_validator(mode="before")
    @classmethod
    def _by_name(cls, value: Any) -> Any:
        return dict(sheet(value).written) if isinstance(value, str) else value

    @classmethod
    def __get_pydantic_json_schema__(cls, core_schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        schema = handler.resolve_ref_schema(handler(core_schema))
        fields = dict(schema)
        schema.clear()
        schema["anyOf"] = [{"enum": list(materials()), "description": "A material that ships as a data file."}, fields]
        return schema

    @model_validator(mode="after")
    def _law_is_sound(self) -> Self:
        for law, names in (("mooney-rivlin", ("c01_share",)), ("yeoh", ("c20_ratio", "c30_ratio"))):
            for name in names:
                if getattr(self, name) and self.law != law:
                    raise ValueError(f"{name} belongs to the law {law}, not to {self.law}")
        # Stiffness in simple shear g over that at rest: 1 + 6 c20/c10 g^2 + 15 c30/c10 g^4.
        roots = np.roots([15.0 * self.c30_ratio, 6.0 * self.c20_ratio, 1.0])
        squares = [root.real for root in roots if abs(root.imag) < 1e-12 * abs(root) and root.real > 0]
        if squares and (shear := float(np.sqrt(min(squares)))) < _SOUND_SHEAR:
            raise ValueError(
                f"the yeoh law with c20_ratio {self.c20_ratio:g} and c30_ratio {self.c30_ratio:g} loses its shear "
                f"stiffness at a shear of {shear:.3g}; needed: positive up to {_SOUND_SHEAR:g}"
            )
        return self

    @classmethod
    def from_coefficients(
        cls, c10: float, *, c01: float = 0.0, c20: float = 0.0, c30: float = 0.0,
        poisson_ratio: float | None = None, bulk_modulus: float | None = None, **others: object,
    ) -> Self:  # fmt: skip
        """Mooney-Rivlin or Yeoh material from published coefficients.

        Parameters
        ----------
        c10, c01, c20, c30
            Coefficients of W, Pa.  Terms of both laws at once are refused.
        poisson_ratio, bulk_modulus
            One of the two; bulk modulus in Pa.
        others
            Further fields of the material.

        Examples
        --------
        >>> rubber = Material.from_coefficients(0.4e6, c01=0.1e6, bulk_modulus=500e6)
        >>> round(rubber.poisson_ratio, 5), round(rubber.shear_modulus)
        (0.499, 1000000)
        """
        mu = 2.0 * (c10 + c01)
        if not (mu > 0 and c10 >= 0):
            raise ValueError(f"c10 {c10:g} Pa and c01 {c01:g} Pa give no positive shear stiffness 2 (c10 + c01)")
        if (poisson_ratio is None) == (bulk_modulus is None):
            raise ValueError("give either poisson_ratio or bulk_modulus")
        if c01 and (c20 or c30):
            raise ValueError("c01 is of the law mooney-rivlin, c20 and c30 of yeoh: give one law's")
        if bulk_modulus is not None:
            if not bulk_modulus > 0:
                raise ValueError(f"bulk_modulus {bulk_modulus:g} Pa must be positive")
            poisson_ratio = (3 * bulk_modulus - 2 * mu) / (6 * bulk_modulus + 2 * mu)
        assert poisson_ratio is not None
        shape = {"c01_share": c01 / (c10 + c01)} if c01 else {"c20_ratio": c20 / c10, "c30_ratio": c30 / c10}
        law = "mooney-rivlin" if c01 else "yeoh"
        modulus = 2.0 * mu * (1.0 + poisson_ratio)
        return cls.model_validate(
            {"law": law, "youngs_modulus": modulus, "poisson_ratio": poisson_ratio, **shape, **others}
        )

    @property
    def shear_modulus(self) -> float:
        """mu = E / (2 (1 + nu)), Pa."""
        return self.youngs_modulus / (2.0 * (1.0 + self.poisson_ratio))

    @property
    def lame_lambda(self) -> float:
        """lambda = E nu / ((1 + nu)(1 - 2 nu)), Pa."""
        nu = self.poisson_ratio
        return self.youngs_modulus * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))

    @property
    def bulk_modulus(self) -> float:
        """kappa = E / (3 (1 - 2 nu)), Pa."""
        return self.youngs_modulus / (3.0 * (1.0 - 2.0 * self.poisson_ratio))


@dataclass(frozen=True)
class MaterialSheet:
    """A material as its data file gives it.

    Parameters
    ----------
    name, title, note
        File name without suffix, what it is, and what else is to be known.
    written
        Field of ``Material`` to its value, quantities as text with unit.
    sources
        Field to where its value comes from; starts with ``ASSUMED`` where nothing is published.
    figures
        Field to the id of the published figure (``lab.published.figures``) that it rests on.
    """

    name: str
    title: str
    note: str
    written: Mapping[str, Any]
    sources: Mapping[str, str]
    figures: Mapping[str, str]

    @property
    def assumptions(self) -> dict[str, str]:
        """Fields that nothing published supports, and why their values were taken."""
        return {name: text for name, text in self.sources.items() if text.startswith("ASSUMED")}


def materials() -> tuple[str, ...]:
    """Names of the materials that ship as data files."""
    return tuple(sorted(path.stem for path in _SHEETS.glob("*.yaml")))


def material(name: str) -> Material:
    """Material of a data file.

    Raises
    ------
    ValueError
        When there is none of that name.

    Examples
    --------
    >>> material("tpe-92a").youngs_modulus
    7800000.0
    """
    return Material.model_validate(name)


@cache
def sheet(name: str) -> MaterialSheet:
    """Data file of a material, with the source of every figure.

    Raises
    ------
    ValueError
        When there is none of that name, or a value has neither source nor assumption.
    """
    import yaml

    if name not in materials():
        raise ValueError(f"no material {name!r}; there are {', '.join(materials())}")
    data = yaml.safe_load((_SHEETS / f"{name}.yaml").read_text(encoding="utf-8"))
    title, note = (" ".join(data.pop(key).split()) for key in ("title", "note"))
    sources = {}
    for field, entry in data.items():
        if ("source" in entry) == ("assumed" in entry):
            raise ValueError(f"{name}.yaml, {field}: give either 'source' or 'assumed'")
        text = entry["source"] if "source" in entry else f"ASSUMED: {entry['assumed']}"
        sources[field] = " ".join(text.split())
    figures = {field: entry["figure"] for field, entry in data.items() if "figure" in entry}
    return MaterialSheet(name, title, note, {k: v["value"] for k, v in data.items()}, sources, figures)
