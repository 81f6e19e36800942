"""Everything about a sample that a sweep may vary, by dotted path: the common ground of series and sensitivities."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from lab.fields import quantity_of
from lab.materials import Frozen
from lab.units import Quantity
from results.accuracy import Entry
from results.slugs import words


@dataclass(frozen=True)
class Bench:
    """Specimen and experiment of a sample, and all that may be swept by dotted path.

    Swept settings of the performer stand in no record; their ``fields`` are the words of the slug.
    """

    parts: dict[str, Frozen]
    fields: dict[str, Any]

    @classmethod
    def of(cls, entry: Entry) -> "Bench":
        """The bench of one entry, without settings of its performer."""
        parts: dict[str, Frozen] = {"specimen": entry.tested(), "experiment": entry.experiment}
        return cls(parts, dict(field for part, model in parts.items() for field in fields_of(model, part)))

    @classmethod
    def whole(cls, entry: Entry) -> "Bench":
        """The same with the settings: those words of the slug that name no field; plain numbers as such."""
        bench = cls.of(entry)
        names = {path.rpartition(".")[2] for path in bench.fields}
        swept = {f"performer.{name}": _read(text) for name, text in words(entry.slug).items() if name not in names}
        return cls(bench.parts, {**bench.fields, **swept})

    def quantity(self, path: str) -> Quantity | None:
        """Units of the field at a dotted path."""
        *way, name = path.split(".")
        here: Any = self.parts.get(way[0])
        for step in way[1:]:
            here = getattr(here, step)
        return quantity_of(type(here), name) if here is not None else None


def _read(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text


def fields_of(model: Frozen, prefix: str) -> Iterator[tuple[str, Any]]:
    """Dotted path and value of every field, nested ones too."""
    for name in type(model).model_fields:
        value = getattr(model, name)
        if isinstance(value, Frozen):
            yield from fields_of(value, f"{prefix}.{name}")
        else:
            yield f"{prefix}.{name}", value


def is_number(value: Any) -> bool:
    """Whether a field holds a number, which a sweep may vary evenly."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def text_of(value: Any, quantity: Quantity | None) -> str:
    """A value as a person reads it: ``15 Hz``."""
    if quantity and is_number(value):
        return quantity.show(value)
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def words_of(path: str) -> str:
    """Name of a field in words: ``rig stiffness``."""
    return path.rpartition(".")[2].replace("_", " ")
