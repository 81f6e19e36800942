"""Deformed states of a body in VTK's order, for the record's fields."""

import numpy as np
from numpy.typing import NDArray

from fea.parts import Deformable
from lab.records import Channel, Fields, channels

Array = NDArray[np.float64]


def fields(part: Deformable, values: list[float], displacements: list[Array]) -> Fields:
    """States with displacement and strain energy density.

    Parameters
    ----------
    part
        Body or shell.
    values
        The record's index at every state.
    displacements
        (nodes, 3) each, m.
    """
    points, cells, cell_type, carry = part.picture()
    density = np.array([part.strain_energy(u) / part.volumes for u in displacements])
    moved = np.array([carry(u) for u in displacements])
    return Fields(
        points=np.ascontiguousarray(points),
        cells=np.ascontiguousarray(cells),
        cell_type=cell_type,
        values=np.array(values, dtype=float),
        point_data=channels(
            Channel("displacement", "m", moved, ("state", "point", "axis"), "displacement from rest"),
        ),
        cell_data=channels(
            Channel("strain_energy_density", "J/m^3", density, ("state", "cell"), "mean strain energy density"),
        ),
    )
