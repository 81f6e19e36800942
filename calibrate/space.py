"""What a fit searches: named numbers with bounds, mapped to the unit cube."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from calibrate.spec import Bounds
from lab.units import Quantity, to_si

Array = NDArray[np.float64]
#: Bounds further apart than this ratio are searched on a logarithmic scale.
_DECADE = 10.0


@dataclass(frozen=True)
class Coordinate:
    """A number with bounds, SI units.

    Parameters
    ----------
    name
        Of a parameter, or ``TARGET: NUISANCE``.
    unit, shown_in
        SI unit, and the unit in which a person reads it.
    nominal
        Value when nothing is known.
    lower, upper
        Bounds of the search.
    """

    name: str
    unit: str
    shown_in: str
    nominal: float
    lower: float
    upper: float

    def show(self, value: float) -> str:
        """``value`` (SI) as text in the unit a person reads."""
        return Quantity(self.unit, self.shown_in).show(value)

    def within(self, written: Bounds | None) -> "Coordinate":
        """With the bounds that a study gives, which must lie inside its own; None keeps those.

        Raises
        ------
        ValueError
            In one line, for bounds that cannot be read, are not in order or go too far.
        """
        if written is None:
            return self
        try:
            low, high = (to_si(b, self.unit) if isinstance(b, str) else float(b) for b in written)
        except ValueError as error:
            raise ValueError(f"bounds of {self.name}: {error}") from None
        if not low < high:
            raise ValueError(f"bounds of {self.name}: {self.show(low)} is not below {self.show(high)}")
        for bound in (low, high):
            if not self.lower <= bound <= self.upper:
                allowed = f"{self.show(self.lower)} to {self.show(self.upper)}"
                raise ValueError(f"bounds of {self.name}: {self.show(bound)} is out of bounds; allowed: {allowed}")
        return Coordinate(self.name, self.unit, self.shown_in, float(np.clip(self.nominal, low, high)), low, high)


@dataclass(frozen=True)
class Space:
    """The unit cube of n coordinates."""

    coordinates: tuple[Coordinate, ...]

    def __len__(self) -> int:
        return len(self.coordinates)

    @property
    def names(self) -> tuple[str, ...]:
        """Of the coordinates, in order."""
        return tuple(c.name for c in self.coordinates)

    @cached_property
    def _bounds(self) -> tuple[Array, Array]:
        return np.array([c.lower for c in self.coordinates]), np.array([c.upper for c in self.coordinates])

    @cached_property
    def logarithmic(self) -> NDArray[np.bool_]:
        """Which coordinates are searched on a logarithmic scale, (n,)."""
        lower, upper = self._bounds
        return (lower > 0.0) & (upper >= _DECADE * lower)

    @cached_property
    def _ratio(self) -> Array:
        lower, upper = self._bounds
        return np.where(self.logarithmic, upper / np.where(self.logarithmic, lower, 1.0), 1.0)

    def values(self, unit: Array, *, beyond: bool = False) -> Array:
        """SI values at points of the unit cube, both (..., n); ``beyond`` goes on outside of it."""
        lower, upper = self._bounds
        found = np.where(self.logarithmic, lower * self._ratio**unit, lower + unit * (upper - lower))
        # Clipped, since a bound must not be missed by rounding: models refuse values beyond it.
        return found if beyond else np.clip(found, lower, upper)

    def place(self, values: Array) -> Array:
        """Points of the unit cube at SI values inside the bounds, both (..., n)."""
        lower, upper = self._bounds
        clipped = np.clip(values, lower, upper)
        safe = np.where(self.logarithmic, clipped / np.where(self.logarithmic, lower, 1.0), 1.0)
        steps = np.log(np.where(self.logarithmic, self._ratio, np.e))
        return np.where(self.logarithmic, np.log(safe) / steps, (clipped - lower) / (upper - lower))

    def slope(self, unit: Array) -> Array:
        """Derivative of the SI values by the coordinates of the unit cube, (n,)."""
        lower, upper = self._bounds
        return np.where(self.logarithmic, self.values(unit, beyond=True) * np.log(self._ratio), upper - lower)

    def sizes(self, unit: Array) -> Array:
        """What relative changes refer to, (n,): the value of a number with one sign, else the range."""
        lower, upper = self._bounds
        one_sign = (lower >= 0.0) | (upper <= 0.0)
        values = np.abs(self.values(unit))
        return np.where(one_sign & (values > 0.0), values, upper - lower)


def common(coordinates: Sequence[Coordinate]) -> Coordinate:
    """The coordinate with the bounds that all of its namesakes (one per specimen) allow.

    Raises
    ------
    ValueError
        When they have none in common.
    """
    first = coordinates[0]
    low, high = max(c.lower for c in coordinates), min(c.upper for c in coordinates)
    if not low < high:
        raise ValueError(f"the specimens have no range of {first.name} in common; give its bounds")
    return Coordinate(first.name, first.unit, first.shown_in, float(np.clip(first.nominal, low, high)), low, high)
