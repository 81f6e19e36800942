"""Text tables: cells with the row of the file that they stand in, numbers only where they are asked for."""

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Table:
    """Rows of cells under one header.

    Parameters
    ----------
    name
        Name of the file.
    header
        One title per column.
    cells
        Text, one list per row.
    rows
        Row of each in the file, counted from 1.
    """

    name: str
    header: Sequence[str]
    cells: Sequence[Sequence[str]]
    rows: NDArray[np.int64]

    def column(self, title: str) -> int:
        """Index of the only column with this title.

        Raises
        ------
        ValueError
            When there is none, or more than one.
        """
        found = [number for number, name in enumerate(self.header) if name == title]
        if len(found) == 1:
            return found[0]
        there = f"stands {len(found)} times" if found else "is missing"
        raise ValueError(f"{self.name}: column {title!r} {there}; the file has {', '.join(filter(None, self.header))}")

    def numbers(
        self, columns: Sequence[int], titles: Sequence[str] | None = None, missing: Sequence[str] = ()
    ) -> Array:
        """Numbers of some columns, (rows, columns); NaN where a cell says that there is none.

        Parameters
        ----------
        columns
            Indices.
        titles
            Names for messages, the header's by default.
        missing
            Texts that stand for a missing value.

        Raises
        ------
        ValueError
            Naming file, row, column and cell of what is no finite number.
        """
        text = np.array([[row[column].strip() for column in columns] for row in self.cells], dtype=str)
        text = text.reshape(len(self.cells), len(columns))
        absent = np.isin(text, list(missing))
        try:
            values = np.where(absent, "nan", text).astype(np.float64)
        except ValueError:
            values = np.vectorize(_number, otypes=[np.float64])(text)
        wrong = np.argwhere(~np.isfinite(values) & ~absent)
        if len(wrong):
            row, place = wrong[0]
            title = (titles or self.header)[place if titles else columns[place]]
            cell = f"{str(text[row, place])!r} is not a number" if text[row, place] else "the cell is empty"
            raise ValueError(f"{self.name}, row {self.rows[row]}, column {title!r}: {cell}")
        return values


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return float("nan")


def lines_of(path: Path) -> list[str]:
    """Lines of a text file.

    Raises
    ------
    ValueError
        When there is no such file, it is empty, or no UTF-8 text.
    """
    try:
        # Motive and spreadsheets put a byte-order mark in front.
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except FileNotFoundError:
        raise ValueError(f"{path.name}: no such file in {path.parent.name or '.'}/") from None
    except UnicodeDecodeError as error:
        raise ValueError(f"{path.name}: not UTF-8 text (byte {error.start}); save it as UTF-8") from None
    if not any(line.strip() for line in lines):
        raise ValueError(f"{path.name}: the file is empty")
    return lines


def table(path: Path, delimiter: str = ",", comment: str = "#") -> Table:
    """Read a table: comment lines anywhere, then one header row, then rows as wide as the header.

    Raises
    ------
    ValueError
        Naming file and row.
    """
    lines = [(number, line) for number, line in enumerate(lines_of(path), 1) if not line.startswith(comment)]
    lines = [(number, line) for number, line in lines if line.strip()]
    if not lines:
        raise ValueError(f"{path.name}: the file has no header row")
    header = [title.strip() for title in next(csv.reader([lines[0][1]], delimiter=delimiter))]
    return body(path.name, header, lines[1:], delimiter)


def body(name: str, header: Sequence[str], lines: Sequence[tuple[int, str]], delimiter: str = ",") -> Table:
    """Table of numbered lines under a known header; every row must be as wide as it."""
    if not lines:
        raise ValueError(f"{name}: no samples below the header")
    cells = list(csv.reader([line for _, line in lines], delimiter=delimiter))
    for (number, _), row in zip(lines, cells, strict=True):
        if len(row) > len(header) and not any(cell.strip() for cell in row[len(header) :]):
            del row[len(header) :]
        if len(row) != len(header):
            raise ValueError(f"{name}, row {number}: {len(row)} cells, but {len(header)} columns")
    return Table(name, header, cells, np.array([number for number, _ in lines], dtype=np.int64))
