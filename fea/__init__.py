"""Finite elements: large-deformation solids on scikit-fem, and the performing of experiments with them."""

from collections.abc import Callable
from importlib import import_module
from typing import TYPE_CHECKING

from fea.model import FeaModel
from lab.experiments import Experiment
from lab.records import Record
from lab.specimens import Specimen

if TYPE_CHECKING:
    from skfem import MeshHex2

#: Experiment kind to the module that performs it.
PERFORMERS = {"StaticStiffness": "fea.static_stiffness", "RingDown": "fea.ring_down"}

__all__ = ["PERFORMERS", "FeaModel", "perform"]


def perform(specimen: Specimen, experiment: Experiment, model: FeaModel, mesh: "MeshHex2") -> Record:
    """Put a specimen through an experiment by finite elements.

    Parameters
    ----------
    specimen
        The device; SI.
    experiment
        Load case and sensors.
    model
        Material changes, solver, time step.  Its mesh options are not used here.
    mesh
        Mesh of the specimen, as from ``meshes.read_mesh``.

    Returns
    -------
    Record
        Status ``diverged`` with the reason and what was reached when equilibrium was lost,
        ``unsupported`` for an experiment that this performer does not know.
    """
    module = PERFORMERS.get(experiment.kind)
    if module is None:
        return Record(
            model.origin, model.kind, specimen.model_dump(), experiment.model_dump(), status="unsupported",
            reason=f"no finite-element performer for {experiment.kind}; there are {', '.join(PERFORMERS)}",
        )  # fmt: skip
    # numba and scikit-fem load only when there is work for them.
    performer: Callable[..., Record] = import_module(module).perform
    return performer(specimen, experiment, model, mesh)
