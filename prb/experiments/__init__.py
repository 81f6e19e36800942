"""How the pseudo-rigid-body performer performs each kind of experiment: one file each."""

from collections.abc import Callable, Mapping
from typing import Any

from lab.experiments import Experiment
from lab.records import Record
from lab.specimens import Specimen
from prb.experiments.base_shake import base_shake
from prb.experiments.natural_modes import natural_modes
from prb.experiments.paddling import fin_push, paddle_thrust, shape_propagation
from prb.experiments.pinched import pinch, pinched_bending, shape_recovery
from prb.experiments.ring_down import ring_down
from prb.experiments.static_stiffness import static_stiffness
from prb.model import PrbModel

#: Performer of each kind of experiment: ``(specimen, experiment, model) -> Record``.
PERFORMERS: Mapping[str, Callable[[Specimen, Any, PrbModel], Record]] = {
    "BaseShake": base_shake,
    "FinPush": fin_push,
    "NaturalModes": natural_modes,
    "PaddleThrust": paddle_thrust,
    "Pinch": pinch,
    "PinchedBending": pinched_bending,
    "RingDown": ring_down,
    "ShapePropagation": shape_propagation,
    "ShapeRecovery": shape_recovery,
    "StaticStiffness": static_stiffness,
}


def perform(specimen: Specimen, experiment: Experiment, model: PrbModel) -> Record:
    """Record of ``experiment`` on ``specimen`` as the ``model`` sees it, origin ``prb``."""
    return PERFORMERS[experiment.kind](specimen, experiment, model)
