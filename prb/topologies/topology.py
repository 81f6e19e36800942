"""What every topology declares: its free numbers, and how they become a mechanism."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from lab.specimens import TwistedBeam
from lab.units import Quantity
from prb.mechanism import Mechanism

#: A number in SI units, or a multiple of one of ``SPECIMEN_QUANTITIES``.
Declared = float | tuple[float, str]
#: ``Declared`` as long as no specimen is known, ``float`` then.
Number = TypeVar("Number", float | tuple[float, str], float)


def torsion_constant(width: float, thickness: float) -> float:
    """Saint-Venant torsion constant of a rectangle, m^4 (Timoshenko & Goodier, art. 109)."""
    odd = np.arange(1, 40, 2)
    series = float(np.sum(np.tanh(odd * np.pi * width / (2 * thickness)) / odd**5.0))
    return width * thickness**3 / 3.0 * (1.0 - 192.0 / np.pi**5 * thickness / width * series)


def torsional_rigidity(specimen: TwistedBeam) -> float:
    """Torsional rigidity of the twisted beam with its length held, N*m^2.

    G J + E (phi / L)^2 W^5 T / 80.  The second term is the pull of the fibres: at the distance r
    from the axis, a twist rate kappa stretches them by r^2 kappa phi / L, and the integral of r^4
    over a thin section is W^5 T / 80.  A tip that is free to move along x would leave W^5 T / 180
    (the mean stretch relaxes); torsion hardly shows in a free ring-down, so the held value is taken.
    """
    material, rate = specimen.material, specimen.twist / specimen.length
    plain = material.shear_modulus * torsion_constant(specimen.width, specimen.thickness)
    return plain + material.youngs_modulus * rate**2 * specimen.width**5 * specimen.thickness / 80.0


#: Quantities of the specimen that a declared number may be a multiple of, SI units.
SPECIMEN_QUANTITIES: Mapping[str, Callable[[TwistedBeam], float]] = {
    "length": lambda specimen: specimen.length,
    "youngs_modulus": lambda specimen: specimen.material.youngs_modulus,
    "viscous_time": lambda specimen: specimen.material.viscous_time,
    "torsional_rigidity": torsional_rigidity,
}


@dataclass(frozen=True)
class Parameter(Generic[Number]):
    """A free number of a topology.

    Parameters
    ----------
    name, meaning
        Identifier, and a phrase for readers.
    unit, shown_in
        SI unit of the values, and the unit in which a person reads them.
    nominal, lower, upper
        Value when nothing is known, and the bounds that a value must respect (inclusive).
    """

    name: str
    unit: str
    shown_in: str
    nominal: Number
    lower: Number
    upper: Number
    meaning: str

    def of(self, specimen: TwistedBeam) -> "Parameter[float]":
        """The same parameter with its three numbers in SI units for ``specimen``."""
        nominal, lower, upper = (_number(declared, specimen) for declared in (self.nominal, self.lower, self.upper))
        return Parameter(self.name, self.unit, self.shown_in, nominal, lower, upper, self.meaning)

    def show(self, value: float) -> str:
        """``value`` (SI) as text in the unit a person reads."""
        return Quantity(self.unit, self.shown_in).show(value)

    def check(self, value: float) -> None:
        """Refuse a value outside the bounds that are known without a specimen."""
        low = self.lower if isinstance(self.lower, float) else -np.inf
        high = self.upper if isinstance(self.upper, float) else np.inf
        if not low <= value <= high:
            allowed = f"{self._show_bound(self.lower)} to {self._show_bound(self.upper)}"
            raise ValueError(f"parameter {self.name} = {self.show(value)} is out of bounds; allowed: {allowed}")

    def _show_bound(self, bound: Declared) -> str:
        return self.show(bound) if isinstance(bound, float) else f"{bound[0]:g} x {bound[1].replace('_', ' ')}"


def _number(declared: Declared, specimen: TwistedBeam) -> float:
    if isinstance(declared, tuple):
        return declared[0] * SPECIMEN_QUANTITIES[declared[1]](specimen)
    return float(declared)


@dataclass(frozen=True)
class Topology:
    """A kind of mechanism.

    Parameters
    ----------
    name
        As a study names it.
    parameters
        The free numbers, in the order of value arrays.
    build
        ``(specimen, values by name in SI units) -> Mechanism``.
    """

    name: str
    parameters: tuple[Parameter[Declared], ...]
    build: Callable[[TwistedBeam, Mapping[str, float]], Mechanism]

    @property
    def names(self) -> tuple[str, ...]:
        """Parameter names in order."""
        return tuple(parameter.name for parameter in self.parameters)

    def parameter(self, name: str) -> Parameter[Declared]:
        """The declared parameter ``name``; ValueError naming the known ones otherwise."""
        for parameter in self.parameters:
            if parameter.name == name:
                return parameter
        raise ValueError(f"topology {self.name} has no parameter {name!r}; it has {', '.join(self.names)}")

    def declare(self, specimen: TwistedBeam) -> tuple[Parameter[float], ...]:
        """The parameters with their numbers for ``specimen``."""
        return tuple(parameter.of(specimen) for parameter in self.parameters)

    def values(self, specimen: TwistedBeam, given: Mapping[str, float]) -> dict[str, float]:
        """Every parameter's value: the ``given`` ones (SI) checked, the nominal one elsewhere."""
        for name in given:
            self.parameter(name)
        values = {}
        for parameter in self.declare(specimen):
            values[parameter.name] = float(given.get(parameter.name, parameter.nominal))
            parameter.check(values[parameter.name])
        return values
