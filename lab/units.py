"""Quantities with units at the border, plain SI floats inside.

A field declared ``Quantity("m", "mm")`` holds a float in metres.  From a study file it takes text
with a unit (``50 mm``); a bare number is refused there, because nobody can tell what it means.
Python callers and resolved studies, which are SI by definition, pass floats.
"""

import math
from dataclasses import dataclass
from functools import cache
from typing import Any

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler, ValidationInfo
from pydantic_core import CoreSchema, core_schema

#: Validation context of text that a person wrote: quantities must carry their unit.
WRITTEN_BY_HAND = {"units_required": True}


@cache
def _registry() -> Any:
    import pint  # 0.3 s, and only a study file needs it

    return pint.UnitRegistry()


def to_si(text: str, unit: str) -> float:
    """Magnitude of ``text`` in the SI ``unit``.

    Raises
    ------
    ValueError
        In one line, when the text is no quantity or has another dimension.

    Examples
    --------
    >>> to_si("50 mm", "m")
    0.05
    """
    if (common := _common(text, unit)) is not None:
        return common
    import pint

    try:
        quantity = _registry().Quantity(text)
        magnitude = quantity.to(unit).magnitude
    except pint.DimensionalityError:
        raise ValueError(f"{text!r} has the unit {quantity.units}; expected one like {unit}") from None
    except Exception:  # pint's parser raises many kinds, tokenizer errors among them
        raise ValueError(f"cannot read {text!r} as a quantity like '1 {unit}'") from None
    if not math.isfinite(magnitude):
        raise ValueError(f"{text!r} is not a finite number")
    return float(magnitude)


#: (unit, SI unit) to what the number is multiplied and divided by: the ones that studies are full of.
_COMMON = {
    ("mm", "m"): (1.0, 1e3), ("ms", "s"): (1.0, 1e3), ("g", "kg"): (1.0, 1e3), ("deg", "rad"): (math.pi, 180.0),
    ("kPa", "Pa"): (1e3, 1.0), ("MPa", "Pa"): (1e6, 1.0), ("GPa", "Pa"): (1e9, 1.0), ("N/mm", "N/m"): (1e3, 1.0),
}  # fmt: skip


def _common(text: str, unit: str) -> float | None:
    """What pint would say of a plain number in the SI unit itself or a common one, without loading it; else None."""
    number, _, given = text.strip().partition(" ")
    factor, divisor = (1.0, 1.0) if given == unit else _COMMON.get((given, unit), (math.nan, 1.0))
    try:
        value = float(number) * factor / divisor
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def from_si(value: float, unit: str, shown_in: str) -> float:
    """Magnitude of an SI ``value`` in the unit ``shown_in``, whose zero is that of ``unit``."""
    return value * _shown(unit, shown_in)


@cache
def _shown(unit: str, shown_in: str) -> float:
    """What takes a magnitude from one unit to another; pint is loaded for uncommon ones only."""
    if unit == shown_in:
        return 1.0
    if (common := _COMMON.get((shown_in, unit))) is not None:
        factor, divisor = common
        return divisor / factor
    return float(_registry().Quantity(1.0, unit).to(shown_in).magnitude)


@dataclass(frozen=True)
class Quantity:
    """Annotation of a float field: its SI unit, and the unit in which a person reads it."""

    unit: str
    shown_in: str

    def read(self, value: Any, info: ValidationInfo) -> Any:
        """SI magnitude of text; anything else as it is, unless the context asks for units."""
        if isinstance(value, str):
            return to_si(value, self.unit)
        if (info.context or {}).get("units_required"):
            raise ValueError(f"{value!r} has no unit; write it like '{value} {self.shown_in}'")
        return value

    def show(self, value: float) -> str:
        """Text of an SI ``value`` with up to 6 digits, as ``45 deg``."""
        return f"{from_si(value, self.unit, self.shown_in):.6g} {self.shown_in}"

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.with_info_before_validator_function(self.read, handler(source))

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return {"type": ["string", "number"], "description": f"Quantity with unit, as '1 {self.shown_in}'."}
