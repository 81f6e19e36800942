"""Sensors at the end of their range."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from lab.readers.recording import Array, runs
from lab.readers.table import Table
from lab.units import to_si


def refuse_saturated(
    cells: Table,
    limits: Mapping[str, str],
    units: Mapping[str, str],
    missing: Sequence[str] = (),
    flat: Sequence[str] = (),
    flat_samples: int = 0,
) -> None:
    """Look for samples at a stated limit, or that stand still at the extreme of their column.

    Parameters
    ----------
    cells
        The table.
    limits
        Column to the magnitude at which its sensor saturates, with a unit.
    units
        Unit of each column; others take their limit as a bare number.
    missing
        Texts of cells without a value.
    flat
        Columns that are looked through for flat extremes.
    flat_samples
        So many equal extreme samples in a row, while the rest of the column moves, count; 0: not looked for.

    Raises
    ------
    ValueError
        Naming file, rows, column and value.
    """
    for title, text in limits.items():
        values = cells.numbers([cells.column(title)], missing=missing)[:, 0]
        limit = _in_unit(cells, title, text, units.get(title))
        _refuse(cells, title, values, np.abs(values) >= limit * (1 - 1e-9), f"at its limit of {text}")
    for title in flat if flat_samples else ():
        values = cells.numbers([cells.column(title)])[:, 0]
        if np.ptp(values) == 0:
            continue  # a channel that never moves is not used, or the part is free of load
        for extreme in (values.max(), values.min()):
            first, last = max(runs(values == extreme), key=lambda run: run[1] - run[0])
            if last - first + 1 >= flat_samples:
                stuck = (np.arange(len(values)) >= first) & (np.arange(len(values)) <= last)
                _refuse(cells, title, values, stuck, "flat at its extreme ('flat_samples' says how long is allowed)")


def _in_unit(cells: Table, title: str, text: str, unit: str | None) -> float:
    """The limit in the unit of its column; a column that has none takes it as a bare number."""
    try:
        return to_si(text, unit) if unit else float(text)
    except ValueError as error:
        raise ValueError(f"{cells.name}: limit of column {title!r}: {error}") from None


def _refuse(cells: Table, title: str, values: Array, flags: NDArray[np.bool_], what: str) -> None:
    if not flags.any():
        return
    first, last = runs(flags)[0]
    at = f"row {cells.rows[first]}" if first == last else f"rows {cells.rows[first]} to {cells.rows[last]}"
    raise ValueError(f"{cells.name}, {at}, column {title!r}: {values[first]:g} is saturated, {what}")
