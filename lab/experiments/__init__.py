"""Defined load cases with defined sensors: one file each, and how a record is reduced to numbers."""

from typing import Annotated

from pydantic import Field

from lab.experiments.base_shake import BaseShake
from lab.experiments.fin_push import FinPush
from lab.experiments.natural_modes import NaturalModes
from lab.experiments.paddle_thrust import PaddleThrust
from lab.experiments.pinch import Pinch
from lab.experiments.pinched_bending import PinchedBending
from lab.experiments.ring_down import RingDown
from lab.experiments.shape_propagation import ShapePropagation
from lab.experiments.shape_recovery import ShapeRecovery
from lab.experiments.static_stiffness import KPRIME_ENTRIES, QPRIME_ENTRIES, StaticStiffness

Experiment = Annotated[
    StaticStiffness
    | RingDown
    | BaseShake
    | NaturalModes
    | Pinch
    | PinchedBending
    | ShapeRecovery
    | ShapePropagation
    | FinPush
    | PaddleThrust,
    Field(discriminator="kind"),
]

__all__ = [
    "KPRIME_ENTRIES", "QPRIME_ENTRIES", "BaseShake", "Experiment", "FinPush", "NaturalModes", "PaddleThrust", "Pinch",
    "PinchedBending", "RingDown", "ShapePropagation", "ShapeRecovery", "StaticStiffness",
]  # fmt: skip
