"""Sweeps: any parameter of a specimen, experiment or model as list, range or grid."""

from collections.abc import Iterator
from itertools import product

from pydantic import Field, model_validator

from lab.materials import Frozen
from lab.units import to_si

#: A swept value as a person wrote it: text with a unit, a number, or null.
Value = str | float | int | bool | None
MOST_VALUES = 100_000


class Range(Frozen):
    """Evenly spaced values, both ends included: ``{from: 0 deg, to: 90 deg, step: 15 deg}`` or ``count: 7``."""

    first: str | float = Field(alias="from")
    last: str | float = Field(alias="to")
    step: str | float | None = None
    count: int | None = Field(None, ge=2, le=MOST_VALUES)

    @model_validator(mode="after")
    def _is_complete(self) -> "Range":
        if (self.step is None) == (self.count is None):
            raise ValueError("a range needs 'step' or 'count', not both")
        self.values()
        return self

    def values(self) -> list[Value]:
        """The values with the unit of ``from``."""
        first, unit = _split(self.first)
        last = _in_unit(self.last, unit)
        if self.count is not None:
            number, step = self.count, (last - first) / (self.count - 1)
        else:
            step = _in_unit(self.step, unit)
            if step * (last - first) <= 0:
                raise ValueError(f"a range from {self.first} to {self.last} never arrives in steps of {self.step}")
            # Half a millionth of a step of slack, so that round-off does not lose the last value.
            number = int((last - first) / step + 5e-7) + 1
        if number > MOST_VALUES:
            raise ValueError(f"a range of {number} values; at most {MOST_VALUES} are allowed")
        return [_join(round(first + i * step, 12), unit) for i in range(number)]


def _split(value: str | float | None) -> tuple[float, str]:
    if isinstance(value, str):
        number, _, unit = value.strip().partition(" ")
        try:
            return float(number), unit.strip()
        except ValueError:
            raise ValueError(f"cannot read {value!r} as a number and a unit") from None
    return float(value or 0.0), ""


def _in_unit(value: str | float | None, unit: str) -> float:
    number, own = _split(value)
    if bool(own) != bool(unit):
        raise ValueError(f"{value!r}: both ends and the step of a range carry a unit, or none does")
    return to_si(f"{number!r} {own}", unit) if unit else number


def _join(number: float, unit: str) -> Value:
    return f"{number:g} {unit}" if unit else (int(number) if number == int(number) else number)


#: One grid: the product of its parameters' values.
Grid = dict[str, list[Value] | Range]


def points(grids: list[Grid]) -> Iterator[dict[str, Value]]:
    """All combinations of each grid in turn; one empty point when nothing is swept."""
    for grid in grids or [{}]:
        lists = [axis.values() if isinstance(axis, Range) else axis for axis in grid.values()]
        for combination in product(*lists):
            yield dict(zip(grid, combination, strict=True))
