"""What all readers of markers share: which are asked for, their columns, and the samples that were not seen."""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from lab.readers.recording import Array
from lab.readers.table import Table


def wanted(name: str, there: Iterable[str], names: Sequence[str] | None) -> list[str]:
    """The markers that are needed.

    Raises
    ------
    ValueError
        Naming the file and what it has, when one is missing.
    """
    found = list(there)
    for marker in names or ():
        if marker not in found:
            raise ValueError(f"{name}: marker {marker!r} is missing; the file has {', '.join(found)}")
    return found if names is None else list(names)


def collect(table: Table, marker: str, columns: NDArray[np.int64], missing: Sequence[str]) -> Array:
    """Coordinates of one marker, (n, 3), in the file's unit; NaN where it was not seen.

    Raises
    ------
    ValueError
        Naming row and column, for what is no number and for a marker that is there in part.
    """
    values = table.numbers(list(columns), [f"{marker} {axis}" for axis in "xyz"], missing)
    absent = np.isnan(values)
    torn = absent.any(axis=1) & ~absent.all(axis=1)
    if torn.any():
        row = int(np.argmax(torn))
        axis = "xyz"[int(np.argmax(absent[row]))]
        raise ValueError(
            f"{table.name}, row {table.rows[row]}, column '{marker} {axis}': empty, though the marker's other "
            "coordinates are there"
        )
    return values


def occlusions(markers: Mapping[str, Array]) -> str:
    """Samples that were not seen, as text."""
    counts = {name: int(np.isnan(values[:, 0]).sum()) for name, values in markers.items()}
    seen = ", ".join(f"{name} {count}" for name, count in counts.items() if count)
    return f"occluded samples: {seen}" if seen else f"none of {len(markers)} markers ever occluded"
