"""Fields of specimens, experiments and models by their dotted path: read, shown, changed."""

from collections.abc import Mapping
from typing import Any, TypeVar

from pydantic import ValidationError

from lab.materials import Frozen
from lab.units import Quantity, from_si, to_si

Model = TypeVar("Model", bound=Frozen)


def changed(model: Frozen, path: str, value: Any) -> Any:
    """Copy of ``model`` with the field at the dotted ``path`` replaced by a value written by hand.

    Raises
    ------
    ValueError
        In one line, when there is no such field or the value does not fit it.
    """
    head, _, rest = path.partition(".")
    if head not in type(model).model_fields:
        raise ValueError(
            f"{type(model).__name__} has no parameter {head!r}; it has {', '.join(type(model).model_fields)}"
        )
    current = getattr(model, head)
    quantity = quantity_of(type(model), head)
    if rest and isinstance(current, Frozen):
        value = changed(current, rest, value)
    elif rest and isinstance(current, dict):
        # Whole numbers count something: they have no unit.
        value = {**current, rest: value if isinstance(value, int) else _with_unit(value)}
    elif rest:
        raise ValueError(f"{head!r} has no parameter {rest!r}")
    elif quantity and value is not None:
        value = to_si(_with_unit(value), quantity.unit)
    # Set fields only: a default that was left out stays left out, so that its nominal value applies.
    kept = {name: getattr(model, name) for name in model.model_fields_set}
    try:
        return type(model).model_validate({**kept, head: value})
    except ValidationError as error:
        raise ValueError(
            "; ".join(f"{path}: {e['msg'].removeprefix('Value error, ')}" for e in error.errors())
        ) from None


def _with_unit(value: Any) -> str:
    if not isinstance(value, str):
        raise ValueError(f"{value!r} has no unit")
    return value


def shown(model: Frozen, path: str) -> str:
    """The value at ``path`` as short text with its usual unit, for names and tables."""
    head, _, rest = path.partition(".")
    value = getattr(model, head)
    if rest:
        return shown(value, rest) if isinstance(value, Frozen) else str(value.get(rest))
    unit = quantity_of(type(model), head)
    if unit and value is not None:
        return f"{round(from_si(value, unit.unit, unit.shown_in), 9):.9g}{unit.shown_in}"
    return "none" if value is None else f"{value:g}" if isinstance(value, float) else str(value)


def quantity_of(model: type[Frozen], name: str) -> Quantity | None:
    """The unit annotation of a field, or of what its unions and tuples hold, if there is one."""
    field = model.model_fields[name]
    found = [m for m in field.metadata if isinstance(m, Quantity)]
    inside = list(getattr(field.annotation, "__args__", ()))
    while inside and not found:
        argument = inside.pop(0)
        found = [m for m in getattr(argument, "__metadata__", ()) if isinstance(m, Quantity)]
        inside += getattr(argument, "__args__", ())
    return found[0] if found else None


def number_at(model: Frozen, path: str) -> tuple[float, str]:
    """SI value and SI unit of the number at the dotted ``path``; places in tuples by their index.

    Raises
    ------
    ValueError
        When there is no number at that place.

    Examples
    --------
    >>> from lab.specimens import TwistedBeam
    >>> number_at(TwistedBeam(), "material.viscous_time")
    (0.001, 's')
    """
    here: Any = model
    unit = "1"
    for name in path.split("."):
        if isinstance(here, tuple) and name.isdigit() and int(name) < len(here):
            here = here[int(name)]
        elif isinstance(here, Frozen) and name in type(here).model_fields:
            quantity = quantity_of(type(here), name)
            unit, here = quantity.unit if quantity else unit, getattr(here, name)
        else:
            raise ValueError(f"{type(model).__name__} has no number {path!r}")
    if isinstance(here, bool) or not isinstance(here, int | float):
        raise ValueError(f"{path!r} of {type(model).__name__} is {here!r}, not a number")
    return float(here), unit


def with_numbers(model: Model, numbers: Mapping[str, float]) -> Model:
    """Copy with the numbers at dotted paths replaced by SI values, checked as the fields are.

    Raises
    ------
    ValueError
        In one line, for a value that its field refuses.
    """
    data: Any = model.model_dump()
    for path, value in numbers.items():
        number_at(model, path)
        data = _replaced(data, path.split("."), value)
    try:
        return type(model).model_validate(data)
    except ValidationError as error:
        raise ValueError("; ".join(f"{'.'.join(map(str, e['loc']))}: {e['msg']}" for e in error.errors())) from None


def _replaced(data: Any, way: list[str], value: float) -> Any:
    if not way:
        return value
    head, *rest = way
    if isinstance(data, dict):
        return {**data, head: _replaced(data[head], rest, value)}
    items = list(data)
    items[int(head)] = _replaced(items[int(head)], rest, value)
    return items
