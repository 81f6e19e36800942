"""Declared models: data that a user writes in YAML, and how they become a mechanism for a specimen."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np
from pydantic import Field, ValidationError, model_validator

from lab.materials import Frozen
from lab.specimens import Specimen
from lab.specimens.load_frame import LoadFrame
from lab.units import Quantity
from prb.assembly import Assembly
from prb.declared_parts import BodySpec, ParameterSpec, Setting, TipSpec, written_numbers
from prb.expressions import FUNCTIONS, Written, environment, read
from prb.mechanism import Ballast, Mechanism
from prb.specimen_numbers import names_of, numbers_of

_NAME = re.compile(r"[A-Za-z_]\w*")
#: What a parameter's bounds may call its nominal value.
NOMINAL = "nominal"


@dataclass(frozen=True)
class Parameter:
    """A free number of a declared model for a specimen.

    Parameters
    ----------
    name, meaning
        Identifier, and a phrase for readers.
    unit, shown_in
        SI unit of the values, and the unit in which a person reads them.
    nominal, lower, upper
        Value when nothing is known, and the bounds that a value must respect (inclusive), SI.
    """

    name: str
    unit: str
    shown_in: str
    nominal: float
    lower: float
    upper: float
    meaning: str

    def show(self, value: float) -> str:
        """``value`` (SI) as text in the unit a person reads."""
        return Quantity(self.unit, self.shown_in).show(value)

    def check(self, value: float) -> None:
        """Refuse a value outside the bounds."""
        if not self.lower <= value <= self.upper:
            allowed = f"{self.show(self.lower)} to {self.show(self.upper)}"
            raise ValueError(f"parameter {self.name} = {self.show(value)} is out of bounds; allowed: {allowed}")


@dataclass(frozen=True)
class DeclaredParameter:
    """A free number before a specimen is known: bounds may still be formulas."""

    name: str
    spec: ParameterSpec
    settings: Mapping[str, int]

    @property
    def unit(self) -> str:
        """SI unit of the values."""
        return self.spec.unit

    @property
    def shown_in(self) -> str:
        """Unit in which a person reads them."""
        return self.spec.shown_in or self.spec.unit

    @property
    def meaning(self) -> str:
        """A phrase for readers."""
        return self.spec.meaning

    def of(self, specimen: Specimen) -> Parameter:
        """The parameter with its three numbers for ``specimen``; ValueError where they are not in order."""
        known = environment(numbers_of(specimen), self.settings)
        spec = self.spec
        try:
            nominal = read(spec.nominal, spec.unit)(known)
            low, high = (read(w, spec.unit)({**known, NOMINAL: nominal}) for w in (spec.lower, spec.upper))
        except ValueError as error:
            raise ValueError(f"parameter {self.name}: {error}") from None
        found = Parameter(self.name, self.unit, self.shown_in, nominal, low, high, self.meaning)
        if not low <= nominal <= high:
            raise ValueError(
                f"parameter {self.name}: nominal {found.show(nominal)} is out of its bounds, "
                f"{found.show(low)} to {found.show(high)}, for this specimen"
            )
        return found

    def check(self, value: float) -> None:
        """Refuse a value outside the bounds that are known without a specimen."""
        low, high = (read(w, self.unit).value for w in (self.spec.lower, self.spec.upper))
        if not (-float("inf") if low is None else low) <= value <= (float("inf") if high is None else high):
            allowed = f"{self._shown(self.spec.lower, low)} to {self._shown(self.spec.upper, high)}"
            raise ValueError(f"parameter {self.name} = {self.show(value)} is out of bounds; allowed: {allowed}")

    def _shown(self, written: Written, value: float | None) -> str:
        return str(written) if value is None else self.show(value)

    def show(self, value: float) -> str:
        """``value`` (SI) as text in the unit a person reads."""
        return Quantity(self.unit, self.shown_in).show(value)


class Declaration(Frozen):
    """A declared model: everything about it, so that a resolved study needs no other file.

    Parameters
    ----------
    name, about
        As tables call it, and what it is.
    specimen
        Kind of specimen whose numbers the formulas use.
    settings, parameters
        Whole numbers that change the structure, and the free numbers of fits, by name.
    define
        Formulas by name, each may use those before it.
    bodies
        From the clamp to the tip, parents before children.
    tip
        Where the tip is: the far end of the last body unless said; and the face that carries the tip's mass.
    """

    name: str
    about: str = ""
    specimen: str = "TwistedBeam"
    settings: dict[str, Setting] = Field(default_factory=dict)
    parameters: dict[str, ParameterSpec]
    define: dict[str, Written] = Field(default_factory=dict)
    bodies: tuple[BodySpec, ...] = Field(min_length=1)
    tip: TipSpec = TipSpec()

    @model_validator(mode="after")
    def _is_sound(self) -> Self:
        taken = dict.fromkeys(names_of(self.specimen), "a number of the specimen")
        taken |= dict.fromkeys(FUNCTIONS, "a function") | {NOMINAL: "the nominal value in bounds"}
        for kind in ("settings", "parameters", "define"):
            for name in getattr(self, kind):
                if not _NAME.fullmatch(name):
                    raise ValueError(f"{kind}: {name!r} is not a name; letters, digits and _ make one")
                if name in taken:
                    raise ValueError(f"{kind}: the name {name!r} is taken; it is {taken[name]}")
                taken[name] = f"one of the {kind}"
        for where, written, unit, known in self._numbers():
            try:
                unknown = read(written, unit).names - known
            except ValueError as error:
                raise ValueError(f"{where}: {error}") from None
            if unknown:
                there = ", ".join(sorted(known))
                raise ValueError(f"{where}: unknown name {min(unknown)!r} in {written!r}; there are {there}")
        self.assembly  # noqa: B018  # finds parents that do not exist
        return self

    def _numbers(self) -> Iterator[tuple[str, Written, str, set[str]]]:
        """Every number: where it stands, what is written, its SI unit, and the names that it may use."""
        known = set(names_of(self.specimen)) | set(self.settings)
        for name, spec in self.parameters.items():
            yield f"parameters.{name}.nominal", spec.nominal, spec.unit, known
            for part in ("lower", "upper"):
                yield f"parameters.{name}.{part}", getattr(spec, part), spec.unit, known | {NOMINAL}
        settings = set(self.settings)
        known = known | set(self.parameters)
        for name, written in self.define.items():
            yield f"define.{name}", written, "1", set(known)
            known.add(name)
        for body in self.bodies:
            for name, written in body.repeat.items():
                yield f"bodies.{body.name}.repeat.{name}", written, "1", settings
            inside = known | set(body.repeat)
            for where, written, unit in written_numbers(body):
                yield f"bodies.{body.name}.{where}", written, unit, set(inside)
                if where.startswith("define."):
                    inside.add(where.removeprefix("define."))
        for i, written in enumerate(self.tip.place or ()):
            yield f"tip.place.{i}", written, "m", known
        for name, written, unit in zip(("width", "thickness", "angle"), self.tip.face, ("m", "m", "rad"), strict=True):
            yield f"tip.{name}", written, unit, known

    @cached_property
    def assembly(self) -> Assembly:
        """The structure for the settings."""
        return Assembly(self.bodies, self.tip, self.chosen)

    @property
    def chosen(self) -> dict[str, int]:
        """Settings by name."""
        return {name: setting.value for name, setting in self.settings.items()}

    def with_settings(self, chosen: Mapping[str, int]) -> "Declaration":
        """The declaration with other settings; ValueError for an unknown one or a value out of its bounds."""
        document = self.model_dump(mode="json", exclude_unset=True)
        for name, value in chosen.items():
            if name not in self.settings:
                known = ", ".join(self.settings) or "none"
                raise ValueError(f"{self.name} has no setting {name!r}; it has {known}")
            document["settings"][name]["value"] = value
        return checked(document, f"settings of {self.name}") if chosen else self

    @property
    def names(self) -> tuple[str, ...]:
        """Parameter names in order."""
        return tuple(self.parameters)

    def parameter(self, name: str) -> DeclaredParameter:
        """The declared parameter ``name``; ValueError naming the known ones otherwise."""
        if name not in self.parameters:
            raise ValueError(f"topology {self.name} has no parameter {name!r}; it has {', '.join(self.names)}")
        return DeclaredParameter(name, self.parameters[name], self.chosen)

    def declare(self, specimen: Specimen) -> tuple[Parameter, ...]:
        """The parameters with their numbers for ``specimen``."""
        self._check_kind(specimen)
        return tuple(self.parameter(name).of(specimen) for name in self.names)

    def values(self, specimen: Specimen, given: Mapping[str, float]) -> dict[str, float]:
        """Every parameter's value: the ``given`` ones (SI) checked, the nominal one elsewhere."""
        for name in given:
            self.parameter(name)
        values = {}
        for parameter in self.declare(specimen):
            values[parameter.name] = float(given.get(parameter.name, parameter.nominal))
            parameter.check(values[parameter.name])
        return values

    def build(self, specimen: Specimen, values: Mapping[str, float]) -> Mechanism:
        """Mechanism for a specimen and values of all parameters (SI); ValueError where there is none."""
        self._check_kind(specimen)
        numbers = {**numbers_of(specimen), **self.chosen, **values}
        known = environment(numbers)
        for name, written in self.define.items():
            numbers[name] = known[name] = read(written, "1")(known)
        frame = getattr(specimen, "load_frame", None)
        if not self.tip.carries:
            if frame:
                raise ValueError(
                    f"topology {self.name} has no place for the specimen's load_frame, since its tip says "
                    "'carries: false'; allowed: no load_frame, or a topology whose tip carries"
                )
            return self.assembly.build(numbers, 0.0)
        ballast = None if frame is None else _ballast(frame)
        return self.assembly.build(numbers, getattr(specimen, "tip_mass", 0.0), ballast)

    def _check_kind(self, specimen: Specimen) -> None:
        if specimen.kind != self.specimen:
            raise ValueError(f"topology {self.name} is declared for a {self.specimen}, not for a {specimen.kind}")


def _ballast(frame: LoadFrame) -> Ballast:
    """A load frame as a rigid body in the plane x = 0 of the tip."""
    moments = frame.moments()
    mass, (y, z) = moments[0, 0], moments[0, 1:] / moments[0, 0]
    about_centre = moments[1:, 1:] - mass * np.outer([y, z], [y, z])
    (yy, yz), (_, zz) = about_centre.tolist()
    return Ballast(float(mass), (0.0, float(y), float(z)), ((yy + zz, 0.0, 0.0), (0.0, zz, -yz), (0.0, -yz, yy)))


def checked(document: Any, source: str) -> Declaration:
    """Declaration of a document; ValueError in one line that names ``source`` and the fault's place."""
    try:
        return Declaration.model_validate(document)
    except ValidationError as error:
        faults = [f"{'.'.join(map(str, e['loc']))}: {e['msg'].removeprefix('Value error, ')}" for e in error.errors()]
        raise ValueError(f"{source}: {'; '.join(fault.removeprefix(': ') for fault in faults)}") from None


def read_declaration(path: Path) -> Declaration:
    """Declaration of a YAML file; ValueError in one line where there is none or it is wrong."""
    import yaml

    try:
        document = yaml.safe_load(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise ValueError(f"there is no file {path}") from None
    except yaml.YAMLError as error:
        raise ValueError(f"{path.name} is not YAML: {' '.join(str(error).split())}") from None
    return checked(document, path.name)
