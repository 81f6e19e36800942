"""Pseudo-rigid-body performer: declared rigid-link models, compiled to MuJoCo.

Importing this room is light; the simulator is loaded by the first call.
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lab.experiments import Experiment
    from lab.records import Record
    from lab.specimens import Specimen
    from prb.model import PrbModel

__all__ = ["perform"]


def perform(specimen: "Specimen", experiment: "Experiment", model: "PrbModel") -> "Record":
    """Perform ``experiment`` on ``specimen`` with the pseudo-rigid-body ``model``."""
    from prb.experiments import perform as run

    return run(specimen, experiment, model)
