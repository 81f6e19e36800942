"""The thin tube of chapter 3, which becomes a hinge where it is pinched."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, GetJsonSchemaHandler, model_validator
from pydantic_core import CoreSchema

from lab.materials import Frozen, Material
from lab.pinching import pair_directions
from lab.units import Quantity

#: The tubes of the text by name: ``size: printed-tpu`` in a study stands for these fields, and others may follow it.
SIZES: Mapping[str, Mapping[str, Any]] = {
    # 3.2: "0.1 m radius, 0.3 m length, 0.001 m wall thickness and 2.96 GPa"; the pads grow with the radius.
    "fea-tube": {
        "radius": "100 mm", "length": "300 mm", "wall": "1 mm", "material": "pet", "pad_width": "24 mm",
        "pad_height": "4 mm", "pad_fillet": "12 mm", "block_length": "20 mm",
    },
    # 3.3.2: "100 mm long, 50 mm diameter and 1 mm wall thickness"
    "printed-tpu": {"radius": "25 mm", "length": "100 mm", "wall": "1 mm", "material": "tpu-95a"},
    # 3.3.1: "at 180 mm length, 72 mm diameter and 1 mm wall thickness"
    "pet": {
        "radius": "36 mm", "length": "180 mm", "wall": "1 mm", "material": "pet", "pad_width": "8 mm",
        "pad_fillet": "4 mm",
    },
}  # fmt: skip


class PinchedTube(Frozen):
    """Circular tube between two rigid end blocks, with 2 n pads inside its wall at mid-length.

    The axis is z, from the proximal block's face at z = 0 to the distal one's at z = ``length``.  The first pair of
    pads lies on the y axis, the others follow at 360 / (2 n) deg (eq. 3.1) about +z.

    ASSUMED, since the text gives no drawing: the published radius is that of the outside (``radius``); size, height
    and transition of the pads; that blocks lie outside the given length; and the size of ``imperfection``, the largest
    deviation from the circle, which decides which way the tube buckles where more than one is open to it.
    """

    kind: Literal["PinchedTube"] = "PinchedTube"
    radius: Annotated[float, Quantity("m", "mm"), Field(gt=0, description="Of the outside.")] = 0.025
    length: Annotated[float, Quantity("m", "mm"), Field(gt=0, description="Between the end blocks.")] = 0.100
    wall: Annotated[float, Quantity("m", "mm"), Field(gt=0)] = 0.001
    pairs: int = Field(3, ge=1, le=12, description="n, pairs of pads.")
    pad_width: Annotated[float, Quantity("m", "mm"), Field(gt=0, description="Around and along.")] = 0.006
    pad_height: Annotated[float, Quantity("m", "mm"), Field(ge=0, description="Inwards, beyond the wall.")] = 0.002
    pad_fillet: Annotated[float, Quantity("m", "mm"), Field(gt=0, description="Width of the transition.")] = 0.003
    pad_stiffening: float = Field(20.0, ge=1, description="Stiffness of the pads (grommets) over the material's.")
    block_length: Annotated[float, Quantity("m", "mm"), Field(gt=0, description="Of each end block.")] = 0.010
    imperfection: Annotated[float, Quantity("m", "mm"), Field(ge=0)] = 0.00005
    #: Turns the imperfection about the axis.
    imperfection_angle: Annotated[float, Quantity("rad", "deg")] = 0.0
    material: Material = Material()

    @model_validator(mode="before")
    @classmethod
    def _by_size(cls, value: Any) -> Any:
        if not isinstance(value, Mapping) or "size" not in value:
            return value
        given = dict(value)
        size = given.pop("size")
        if size not in SIZES:
            raise ValueError(f"size {size!r} is unknown; there are {', '.join(SIZES)}")
        return {**SIZES[size], **given}

    @classmethod
    def __get_pydantic_json_schema__(cls, core_schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        schema = handler(core_schema)
        handler.resolve_ref_schema(schema)["properties"]["size"] = {
            "enum": list(SIZES), "description": "A tube of the text; other fields change it.",
        }  # fmt: skip
        return schema

    @model_validator(mode="after")
    def _fits_together(self) -> "PinchedTube":
        mm = 1e3
        if self.wall > self.radius / 5:
            raise ValueError(
                f"wall {mm * self.wall:g} mm is too thick for radius {mm * self.radius:g} mm: at most a fifth of it, "
                "beyond which it is no thin tube"
            )
        inside = self.radius - self.wall
        room, needed = 2 * np.pi * inside / (2 * self.pairs), self.pad_width + 2 * self.pad_fillet
        if needed > room:
            raise ValueError(
                f"pads overlap: {2 * self.pairs} pads of {mm * self.pad_width:g} mm with transitions of "
                f"{mm * self.pad_fillet:g} mm need {mm * needed:.3g} mm each, and there are {mm * room:.3g} mm"
            )
        if self.pad_height > 0.5 * inside:
            raise ValueError(
                f"pad_height {mm * self.pad_height:g} mm must be at most half the inner radius, "
                f"{mm * inside / 2:.3g} mm"
            )
        if needed > 0.5 * self.length:
            raise ValueError(
                f"pads with transitions, {mm * needed:.3g} mm, must not exceed half the length, "
                f"{mm * self.length / 2:.3g} mm"
            )
        if self.imperfection > 0.5 * self.wall:
            raise ValueError(
                f"imperfection {mm * self.imperfection:g} mm must be at most half the wall, {mm * self.wall / 2:g} mm"
            )
        return self

    @property
    def mid_radius(self) -> float:
        """Of the middle of the wall, m."""
        return self.radius - self.wall / 2

    def pad_directions(self) -> NDArray[np.float64]:
        """Angle of every pad from +x, rad (2 pairs,): pad k and pad k + pairs are the k-th pair."""
        one = pair_directions(self.pairs)
        return np.concatenate([one, one + np.pi])

    def geometry(self) -> dict[str, float]:
        """The fields that a mesh depends on, SI."""
        return self.model_dump(exclude={"kind", "material", "pad_stiffening", "block_length"})
