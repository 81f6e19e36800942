"""Pseudo-rigid-body performer: declared rigid-link models, compiled to MuJoCo.

Importing this room is light; the simulator is loaded by the first call.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from lab.experiments import Experiment, RingDown
    from lab.records import Record
    from lab.specimens import Specimen
    from prb.model import PrbModel

__all__ = ["perform", "ring_downs"]


def perform(specimen: "Specimen", experiment: "Experiment", model: "PrbModel") -> "Record":
    """Perform ``experiment`` on ``specimen`` with the pseudo-rigid-body ``model``."""
    from prb.experiments import perform as run

    return run(specimen, experiment, model)


def ring_downs(
    specimen: "Specimen",
    experiments: "Sequence[RingDown]",
    topology: str,
    values: "NDArray[np.float64]",
    *,
    time_step: float = 0.25e-3,
    threads: int = 1,
) -> "NDArray[np.float64]":
    """Marker displacements of many candidates, see ``prb.batch.RingDownBatch``."""
    from prb.batch import RingDownBatch

    return RingDownBatch(specimen, experiments, topology, time_step=time_step, threads=threads)(values)
