"""``NaturalModes`` by finite elements."""

from time import perf_counter

import numpy as np

from fea.carrier import Carrier
from fea.case import Case
from fea.linear import SingularMatrixError, solver_class
from fea.model import FeaModel
from fea.pictures import shape_fields
from fea.setting_up import Mesh, how, make_part, said, warm_up
from fea.vibration import vibrations
from lab.experiments import NaturalModes
from lab.experiments.natural_modes import senses
from lab.records import Channel, Record, channels
from lab.specimens import TwistedBeam

#: Largest displacement of the shapes in pictures, as a share of the beam's length.
_SHOWN = 0.1


def perform(specimen: TwistedBeam, experiment: NaturalModes, model: FeaModel, mesh: Mesh) -> Record:
    """Natural vibrations about the unloaded shape, with shapes as states of the picture; see ``fea.perform``."""
    warm_up(model.linear_solver, model.element)
    began = perf_counter()
    part = make_part(specimen, model, mesh)
    case = Case(part, solver=model.linear_solver).fix("root").mass("tip", specimen.tip_mass)
    try:
        found = vibrations(case, experiment.count)
    except (ValueError, SingularMatrixError) as error:
        return Record(**said(specimen, experiment, model), status="failed", reason=f"no natural modes: {error}")
    carrier = Carrier(part, np.zeros((1, 3)))
    tip = np.array([carrier.velocity(shape) for shape in found.shapes])
    sense = senses(tip, specimen.width)
    tip, shapes = sense[:, None] * tip, sense[:, None, None] * found.shapes
    numbers = np.arange(1, len(tip) + 1)
    largest = np.linalg.norm(shapes, axis=2).max(axis=1)
    shown = shapes * (_SHOWN * specimen.length / largest)[:, None, None]
    seconds = perf_counter() - began
    history = {"missed": found.missed, "shapes": f"largest displacement {_SHOWN:g} of the length"}
    return Record(
        **said(specimen, experiment, model),
        channels=channels(
            Channel("mode", "1", numbers, ("mode",), "number of the mode"),
            Channel("frequency", "Hz", found.frequencies, ("mode",), "natural frequency"),
            Channel("tip", "m, rad", tip, ("mode", "dof"),
                    "motion of the tip's centre and mean rotation of its face, for a modal mass of 1 kg"),
        ),
        how=how(part, model, solver_class(model.linear_solver).name, seconds, history),
        fields=shape_fields(part, numbers.tolist(), shown),
    )  # fmt: skip
