"""What every performer of an experiment hands back: named channels with units."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

Origin = Literal["lab", "virtual-lab", "fea", "prb"]
#: ``unsupported``: the model cannot do it, for a reason of mechanics; ``diverged``: the solver gave up;
#: ``failed``: the program did.  Only ``completed`` is a result.
Status = Literal["completed", "unsupported", "diverged", "failed"]


@dataclass(frozen=True)
class Channel:
    """One named array.

    Parameters
    ----------
    name, unit, long_name
        Identifier, SI unit as text, and a sentence for readers.
    values
        Array, float64 or int64.
    dims
        Name of each axis; the record's index (``time`` or ``increment``) comes first where the
        channel runs along it.
    """

    name: str
    unit: str
    values: NDArray[Any]
    dims: tuple[str, ...]
    long_name: str = ""

    def __post_init__(self) -> None:
        if self.values.ndim != len(self.dims):
            raise ValueError(f"channel {self.name}: {self.values.ndim} axes, dims {self.dims}")


@dataclass(frozen=True)
class Scalar:
    """One number with its SI unit; NaN where it does not exist."""

    value: float
    unit: str
    long_name: str = ""


@dataclass(frozen=True)
class Fields:
    """A deforming body for pictures.

    Parameters
    ----------
    points
        Reference coordinates, (points, 3), m.
    cells, cell_type
        Connectivity (cells, nodes) in VTK order, and the VTK cell type: one for all, or (cells,).  Where cells
        differ, the shorter ones end with -1.
    values
        Value of the record's index at each stored state, (states,).
    point_data, cell_data
        Name to Channel with dims ``("state", "point", ...)`` or ``("state", "cell", ...)``;
        ``displacement`` is (states, points, 3) in m.
    """

    points: NDArray[np.float64]
    cells: NDArray[np.int64]
    cell_type: int | NDArray[np.int64]
    values: NDArray[np.float64]
    point_data: Mapping[str, Channel] = field(default_factory=dict)
    cell_data: Mapping[str, Channel] = field(default_factory=dict)


@dataclass(frozen=True)
class Record:
    """An experiment as one performer saw it.

    Parameters
    ----------
    origin
        ``lab`` (measured, published), ``virtual-lab`` (a finer model with known truth), ``fea``, ``prb``.
    model
        Name of the performer.
    specimen, experiment
        What was done, as plain JSON data in SI units.
    channels
        Arrays by name; the index is the one whose only dim is its own name.
    scalars
        Single numbers by name.
    how
        Parameters, mesh, solver statistics, wall time (``wall_time_s``): plain JSON data.
    status, reason
        Anything but ``completed`` says why in one sentence; a diverged record keeps what it reached.
    fields
        Deformed states, where the performer has any.
    """

    origin: Origin
    model: str
    specimen: Mapping[str, Any]
    experiment: Mapping[str, Any]
    channels: Mapping[str, Channel] = field(default_factory=dict)
    scalars: Mapping[str, Scalar] = field(default_factory=dict)
    how: Mapping[str, Any] = field(default_factory=dict)
    status: Status = "completed"
    reason: str = ""
    fields: Fields | None = None

    def __getitem__(self, name: str) -> NDArray[Any]:
        """Values of the channel ``name``."""
        return self.channels[name].values

    @property
    def completed(self) -> bool:
        """Whether the record is a result."""
        return self.status == "completed"


def channels(*items: Channel) -> dict[str, Channel]:
    """Channels keyed by their names."""
    return {item.name: item for item in items}
