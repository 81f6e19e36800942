"""Natural frequencies as tables: against a performer, and against beam theory."""

import math
from collections.abc import Iterator, Sequence
from functools import cache

from lab.beam_theory import Mode, natural_modes
from lab.experiments import NaturalModes
from lab.records import Scalar
from lab.specimens import TwistedBeam
from results.accuracy import Entry, Row, against_scalars
from results.summary import errors_by_quantity
from results.tables import Table

THEORY, ORIGIN = "beam-theory", "theory"
_LONG = (
    "frequency in Hz with its error against the reference in %, modes in the order of their frequencies; b, t, s: what "
    "moves a side of the tip face most is bending, torsion or stretch (of the theory: what holds most energy, m: mixed)"
)


def theory_rows(entries: Sequence[Entry]) -> Iterator[Row]:
    """Natural frequencies of all records against beam theory, each for the specimen that its record tells."""
    for entry in entries:
        if isinstance(entry.experiment, NaturalModes) and entry.record.specimen.get("kind") != "PinchedTube":
            values = {f"f_{i}": Scalar(mode.frequency, "Hz") for i, mode in enumerate(_theory(entry), 1)}
            yield from against_scalars(entry, [(name, "Hz") for name in values], THEORY, ORIGIN, values, entry.slug)


def mode_tables(title: str, rows: Sequence[Row], entries: Sequence[Entry]) -> list[Table]:
    """One line per model, then every frequency of every sample.

    Parameters
    ----------
    rows
        Natural frequencies of one campaign against one reference.
    entries
        Records of the campaign, for the kinds of the modes.
    """
    return [errors_by_quantity(title, rows), _long(title, rows, {(e.performer, e.slug): e for e in entries})]


def _long(title: str, rows: Sequence[Row], entries: dict[tuple[str, str], Entry]) -> Table:
    names = _names(rows)
    cells = {(row.sample, row.model, row.quantity): row for row in rows}
    lines: list[tuple[str, ...]] = []
    for sample in dict.fromkeys(row.sample for row in rows):
        models = [m for m in dict.fromkeys(row.model for row in rows) if (sample, m, names[0]) in cells]
        found = {m: [cells[sample, m, name] for name in names if (sample, m, name) in cells] for m in models}
        lines += _references(sample, found, entries)
        for model, own in found.items():
            kinds = _kinds(entries[model, sample])
            lines.append((sample, model, *(_cell(row, kind) for row, kind in zip(own, kinds, strict=False))))
    width = len(names) + 2
    padded = tuple((*line, *["-"] * (width - len(line))) for line in lines)
    return Table(title, ("sample", "model", *(f"{name} [Hz]" for name in names)), padded, (_LONG,), detail=True)


def _references(
    sample: str, found: dict[str, list[Row]], entries: dict[tuple[str, str], Entry]
) -> Iterator[tuple[str, ...]]:
    """The reference's line; several where models were given different specimens, as fits may change the material."""
    shared: dict[tuple[float, ...], list[str]] = {}
    for model, rows in found.items():
        shared.setdefault(tuple(round(row.reference_value, 6) for row in rows), []).append(model)
    for values, models in shared.items():
        row = found[models[0]][0]
        of = entries.get((row.reference, sample))
        kinds = _kinds(of) if of else [mode.kind[0] for mode in _theory(entries[models[0], sample])]
        name = row.reference if len(shared) == 1 else f"{row.reference} for {', '.join(models)}"
        yield (sample, name, *(f"{f:.4g} {k}" for f, k in zip(values, kinds, strict=False)))


def _cell(row: Row, kind: str) -> str:
    error = f" ({100 * row.relative_error:+.1f})" if math.isfinite(row.relative_error) else ""
    return f"{row.value:.4g} {kind}{error}"


def _kinds(entry: Entry) -> list[str]:
    """First letter of every mode's kind; none where there is no result."""
    return [kind[0] for kind in NaturalModes.kinds(entry.record)] if entry.record.completed else []


def _theory(entry: Entry) -> tuple[Mode, ...]:
    specimen = entry.tested()
    assert isinstance(entry.experiment, NaturalModes)
    assert isinstance(specimen, TwistedBeam)
    return _modes(specimen, entry.experiment.count)


@cache
def _modes(specimen: TwistedBeam, count: int) -> tuple[Mode, ...]:
    return tuple(natural_modes(specimen, count))


def _names(rows: Sequence[Row]) -> list[str]:
    return list(dict.fromkeys(row.quantity for row in rows))
