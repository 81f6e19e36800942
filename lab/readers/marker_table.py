"""Marker coordinates as columns of a CSV that a sidecar or the study explains."""

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lab.readers.clock import clock
from lab.readers.limits import refuse_saturated
from lab.readers.markers import collect, occlusions, wanted
from lab.readers.options import MarkerTableOptions, TableOptions, factor, with_sidecar
from lab.readers.recording import Array, Recording
from lab.readers.rotations import axis_of
from lab.readers.table import Table, table


def read_marker_table(path: Path, options: MarkerTableOptions, names: Sequence[str] | None = None) -> Recording:
    """Read a table of marker coordinates; see ``lab.readers.read``.

    Raises
    ------
    ValueError
        In one line with file, row and column.
    """
    options = with_sidecar(options, path)
    if options.columns is None or options.unit is None:
        lacking = "columns" if options.columns is None else "unit"
        raise ValueError(f"{path.name}: {lacking!r} is given neither in the study nor in a sidecar {path.name}.yaml")
    scale = factor(path.name, options.unit, "m")
    cells = table(path, options.delimiter)
    triples = _triples(cells, options.columns)
    chosen = wanted(path.name, triples, names)
    time, rate, source = clock(path.name, cells.rows, time_column(cells, options), options.rate)
    raw = {name: collect(cells, name, triples[name], options.missing) for name in chosen}
    units = {cells.header[column]: options.unit for columns in triples.values() for column in columns}
    refuse_saturated(cells, options.limits, units, options.missing)
    markers = {name: values * scale for name, values in raw.items()}
    return Recording(
        source=path.name, time=time, rate=rate, rows=cells.rows, markers=markers, up=axis_of(options.up),
        specimen=options.specimen, declared=options.declared,
    ).noted(
        f"read {path.name}: table of markers in {options.unit}, {len(time)} samples, {source}, {occlusions(markers)}"
    )  # fmt: skip


def time_column(cells: Table, options: TableOptions) -> Array | None:
    """The time column in s, if the options name one."""
    if options.time is None:
        return None
    number = cells.column(options.time)
    return cells.numbers([number])[:, 0] * factor(cells.name, options.time_unit, "s")


def _triples(cells: Table, pattern: str) -> dict[str, NDArray[np.int64]]:
    """Marker to its columns along x, y and z, by a pattern as ``{marker}_{axis}_m``."""
    if pattern.count("{marker}") != 1 or pattern.count("{axis}") != 1:
        raise ValueError(
            f"{cells.name}: the pattern {pattern!r} of the columns needs {{marker}} and {{axis}} once each"
        )
    expression = re.escape(pattern).replace(r"\{marker\}", "(?P<marker>.+)").replace(r"\{axis\}", "(?P<axis>[xyzXYZ])")
    found: dict[str, dict[str, int]] = {}
    for number, title in enumerate(cells.header):
        match = re.fullmatch(expression, title)
        if match is None:
            continue
        axes = found.setdefault(match["marker"], {})
        if match["axis"].lower() in axes:
            raise ValueError(f"{cells.name}: two columns are {title!r} by the pattern {pattern!r}")
        axes[match["axis"].lower()] = number
    if not found:
        raise ValueError(f"{cells.name}: no column fits the pattern {pattern!r}; it has {', '.join(cells.header)}")
    for marker, axes in found.items():
        if len(axes) < 3:
            lacking = next(axis for axis in "xyz" if axis not in axes)
            raise ValueError(f"{cells.name}: marker {marker!r} has no column for {lacking}")
    return {marker: np.array([axes[axis] for axis in "xyz"]) for marker, axes in found.items()}
