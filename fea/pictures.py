"""Deformed states of a body in VTK's order, for the record's fields."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fea.parts import Deformable
from lab.records import Channel, Fields, channels

Array = NDArray[np.float64]

#: Share of a shape at which its strain energy is evaluated: small enough to be that of linear strains.
_SMALL = 1e-4


def fields(part: Deformable, values: Sequence[float], displacements: Sequence[Array]) -> Fields:
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
    density = np.array([part.strain_energy(u) / part.volumes for u in displacements])
    return _fields(part, values, displacements, density, "mean strain energy density")


def shape_fields(part: Deformable, values: Sequence[float], shapes: Array) -> Fields:
    """States that show shapes (states, nodes, 3), m, of linear vibrations; arguments as in ``fields``."""
    density = np.array([part.strain_energy(_SMALL * u) / part.volumes / _SMALL**2 for u in shapes])
    return _fields(part, values, list(shapes), density, "mean strain energy density of linear strains")


def together(pictures: Sequence[Fields]) -> Fields:
    """The same states of several parts in one picture; all cells are of one type."""
    starts = np.cumsum([0, *(len(one.points) for one in pictures[:-1])])

    def joined(of: Callable[[Fields], Mapping[str, Channel]]) -> dict[str, Channel]:
        first = of(pictures[0])
        return {
            name: replace(channel, values=np.concatenate([of(one)[name].values for one in pictures], axis=1))
            for name, channel in first.items()
        }

    return replace(
        pictures[0],
        points=np.concatenate([one.points for one in pictures]),
        cells=np.concatenate([one.cells + start for one, start in zip(pictures, starts, strict=True)]),
        point_data=joined(lambda one: one.point_data),
        cell_data=joined(lambda one: one.cell_data),
    )


def _fields(
    part: Deformable, values: Sequence[float], displacements: Sequence[Array], density: Array, words: str
) -> Fields:
    points, cells, cell_type, carry = part.picture()
    moved = np.array([carry(u) for u in displacements])
    return Fields(
        points=np.ascontiguousarray(points),
        cells=np.ascontiguousarray(cells),
        cell_type=cell_type,
        values=np.array(values, dtype=float),
        point_data=channels(
            Channel("displacement", "m", moved, ("state", "point", "axis"), "displacement from rest"),
        ),
        cell_data=channels(Channel("strain_energy_density", "J/m^3", density, ("state", "cell"), words)),
    )
