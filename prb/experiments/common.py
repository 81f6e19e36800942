"""What the records of this performer have in common."""

from typing import Any

import mujoco
from pydantic import BaseModel

from lab.specimens import Specimen
from prb.model import PrbModel

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
