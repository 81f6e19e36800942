"""What the records of this performer have in common."""

from typing import Any

import mujoco
from pydantic import BaseModel

from lab.specimens import Specimen
from prb.model import PrbModel
from prb.topologies import TOPOLOGIES

DOFS = "translations along x, y, z, then rotations about them"


def heading(specimen: Specimen, experiment: BaseModel, model: PrbModel) -> dict[str, Any]:
    """Origin, name, specimen and experiment of a record."""
    return {
        "origin": "prb",
        "model": model.topology,
        "specimen": specimen.model_dump(mode="json"),
        "experiment": experiment.model_dump(mode="json"),
    }


def how(specimen: Specimen, model: PrbModel, wall_time: float, **more: Any) -> dict[str, Any]:
    """How a record came about; ``wall_time`` (s) is that of the simulation, the model being built."""
    values, declared = model.values(specimen), TOPOLOGIES[model.topology].parameters
    parameters = {p.name: {"value": values[p.name], "unit": p.unit} for p in declared}
    return {
        "topology": model.topology,
        "parameters": parameters,
        "wall_time_s": wall_time,
        "mujoco": mujoco.__version__,
        **more,
    }
