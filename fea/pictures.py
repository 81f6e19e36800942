"""Deformed states of a body in VTK's order, for the record's fields."""

import numpy as np
from numpy.typing import NDArray

from fea.body import Body
from lab.records import Channel, Fields, channels
from meshes.node_order import VTK_CELL_TYPE, skfem_to_vtk

Array = NDArray[np.float64]


def fields(body: Body, values: list[float], displacements: list[Array]) -> Fields:
    """States with displacement and strain energy density.

    Parameters
    ----------
    body
        Solid.
    values
        The record's index at every state.
    displacements
        (nodes, 3) each, m.
    """
    volumes = body.weights.sum(axis=1)
    density = np.array([body.strain_energy(u) / volumes for u in displacements])
    moved = Channel("displacement", "m", np.array(displacements), ("state", "point", "axis"), "displacement from rest")
    dense = Channel("strain_energy_density", "J/m^3", density, ("state", "cell"), "mean strain energy density")
    return Fields(
        points=np.ascontiguousarray(body.points),
        cells=np.ascontiguousarray(body.cells[:, skfem_to_vtk()]),
        cell_type=VTK_CELL_TYPE,
        values=np.array(values, dtype=float),
        point_data=channels(moved),
        cell_data=channels(dense),
    )
