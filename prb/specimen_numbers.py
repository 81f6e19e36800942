"""Which numbers of a specimen a formula may use, and their values."""

import types
import typing
from collections.abc import Mapping
from functools import cache, lru_cache
from typing import Any

import lab.specimens
from lab.materials import Frozen, Material
from lab.specimens import Specimen


def specimen_class(kind: str) -> type[Frozen]:
    """Class of a kind of specimen; ValueError naming those that exist."""
    known = {name: getattr(lab.specimens, name) for name in lab.specimens.__all__ if name != "Specimen"}
    if kind not in known:
        raise ValueError(f"there is no specimen {kind!r}; there are {', '.join(known)}")
    return known[kind]


@cache
def names_of(kind: str) -> frozenset[str]:
    """Names of the numbers of a kind of specimen and of its material."""
    return frozenset((*_numeric(specimen_class(kind)), *_numeric(Material)))


@lru_cache(maxsize=64)
def numbers_of(specimen: Specimen) -> Mapping[str, float]:
    """Values of the numbers, SI; those that the specimen leaves open are missing."""
    owners: tuple[Any, ...] = (specimen.material, specimen)
    found = {name: getattr(owner, name) for owner in owners for name in _numeric(owner.__class__)}
    return {name: float(value) for name, value in found.items() if value is not None}


@cache
def _numeric(cls: type[Frozen]) -> tuple[str, ...]:
    """Fields and properties that hold a float."""
    fields = [name for name, field in cls.model_fields.items() if _holds_a_float(field.annotation)]
    properties = [
        name for name, item in vars(cls).items()
        if isinstance(item, property) and typing.get_type_hints(item.fget).get("return") is float
    ]  # fmt: skip
    return (*fields, *properties)


def _holds_a_float(annotation: Any) -> bool:
    if typing.get_origin(annotation) in (typing.Union, types.UnionType):
        return any(_holds_a_float(part) for part in typing.get_args(annotation))
    if typing.get_origin(annotation) is typing.Annotated:
        return _holds_a_float(typing.get_args(annotation)[0])
    return annotation is float
