"""Readers of measurement files: each gives a ``Recording`` in SI units, or one clear line on what is wrong."""

from collections.abc import Sequence
from pathlib import Path

from lab.readers.c3d import read_c3d
from lab.readers.force_torque import read_force_torque
from lab.readers.marker_table import read_marker_table
from lab.readers.motive import read_motive
from lab.readers.options import (
    C3dOptions,
    ForceTorqueOptions,
    MarkerTableOptions,
    MotiveOptions,
    ReaderOptions,
    sidecar_of,
)
from lab.readers.recording import Recording, Release

__all__ = [
    "C3dOptions", "ForceTorqueOptions", "MarkerTableOptions", "MotiveOptions", "ReaderOptions", "Recording",
    "Release", "read", "sidecar_of",
]  # fmt: skip


def read(path: Path, options: ReaderOptions, names: Sequence[str] | None = None) -> Recording:
    """Read a measurement file.

    Parameters
    ----------
    path
        The file; a YAML sidecar beside it adds to ``options``.
    options
        What kind of file it is, and what it does not say itself.
    names
        Markers that are needed; None: all that are there.

    Raises
    ------
    ValueError
        One line that names the file, and row and column where there are any.
    """
    if isinstance(options, MotiveOptions):
        return read_motive(path, options, names)
    if isinstance(options, C3dOptions):
        return read_c3d(path, options, names)
    if isinstance(options, MarkerTableOptions):
        return read_marker_table(path, options, names)
    return read_force_torque(path, options)
