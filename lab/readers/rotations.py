"""Axes written as letters."""

import numpy as np

from lab.readers.options import Axes
from lab.readers.recording import Array


def axis_of(text: str | None) -> Array | None:
    """Unit vector of an axis written as ``y`` or ``-z``."""
    if text is None:
        return None
    return np.eye(3)["xyz".index(text[-1])] * (-1.0 if text.startswith("-") else 1.0)


def matrix_of(axes: Axes, name: str) -> Array:
    """Rotation whose rows are our axes in those of the file, (3, 3).

    Raises
    ------
    ValueError
        When an axis is left out or taken twice, or the axes are left-handed.
    """
    if sorted(axes) != ["x", "y", "z"]:
        raise ValueError(f"{name}: axes {axes}: x, y and z must each be given")
    rows = np.array([axis_of(axes[axis]) for axis in ("x", "y", "z")])
    if sorted(text[-1] for text in axes.values()) != ["x", "y", "z"]:
        raise ValueError(f"{name}: axes {axes}: x, y and z must each be used once")
    if np.linalg.det(rows) < 0:
        raise ValueError(f"{name}: axes {axes} would mirror the record; change one sign or exchange two")
    return rows
