"""What the records of this performer have in common."""

from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel

from lab.records import Channel, Fields
from lab.specimens import Specimen
from prb.model import PrbModel
from prb.statics import Chain

Array = NDArray[np.float64]
_VTK_LINE = 3

DOFS = "translations along x, y, z, then rotations about them"


def heading(specimen: Specimen, experiment: BaseModel, model: PrbModel) -> dict[str, Any]:
    """Origin, name, specimen and experiment of a record."""
    return {
        "origin": "prb",
        "model": model.topology.name,
        "specimen": specimen.model_dump(mode="json"),
        "experiment": experiment.model_dump(mode="json"),
    }


def how(specimen: Specimen, model: PrbModel, wall_time: float, **more: Any) -> dict[str, Any]:
    """How a record came about; ``wall_time`` (s) is that of the simulation, the model being built."""
    values = model.values(specimen)
    parameters = {name: {"value": values[name], "unit": model.topology.parameter(name).unit} for name in values}
    return {
        "topology": model.topology.name,
        "settings": model.topology.chosen,
        "parameters": parameters,
        "wall_time_s": wall_time,
        "mujoco": mujoco.__version__,
        **more,
    }


def links_as_lines(chain: Chain, time: Array, joints: Array, rest: Array, count: int) -> Fields:
    """Picture of a motion, the links being lines.

    Parameters
    ----------
    time, joints
        Times (n,), s, and joint coordinates (n, joints), rad or m.
    rest
        Joint coordinates from which displacements count, (joints,).
    count
        States that are kept, spread evenly over all.
    """
    shown = np.unique(np.linspace(0, len(time) - 1, count).round().astype(int))
    nodes = chain.nodes(rest)
    displacement = np.array([chain.nodes(joints[i]) - nodes for i in shown])
    cells = np.arange(len(nodes), dtype=np.int64).reshape(-1, 2)
    channel = Channel("displacement", "m", displacement, ("state", "point", "axis"), "displacement of the links' ends")
    return Fields(nodes, cells, _VTK_LINE, time[shown], {"displacement": channel})
