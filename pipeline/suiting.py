"""What only the parts of a sample together can get wrong, found before anything is meshed."""

from typing import get_args

from fea.model import FeaModel
from lab.experiments import Experiment
from lab.experiments.pinch_drive import PinchDrive
from lab.materials import Frozen
from lab.specimens import PinchedTube, Specimen
from meshes.options import MeshOptions
from prb.model import PrbModel


def misfit(specimen: Specimen, experiment: Experiment) -> str:
    """Why an experiment is none for this specimen (tubes are pinched, beams are not); empty where it is one."""
    tube = isinstance(specimen, PinchedTube)
    if tube == isinstance(experiment, PinchDrive):
        return ""
    kinds = [kind for kind in get_args(get_args(Experiment)[0]) if issubclass(kind, PinchDrive) == tube]
    there = ", ".join(kind.__name__ for kind in kinds)
    return f"{experiment.kind} is no experiment for a {specimen.kind}; there is {there}"


def check_sample(specimen: Specimen, experiment: Experiment, model: Frozen) -> None:
    """ValueError, in one line, for parts that each are right and do not go together."""
    if isinstance(specimen, PinchedTube) and isinstance(experiment, PinchDrive):
        experiment.shares(specimen.pairs)
    if isinstance(model, FeaModel):
        _check_mesh(model.applied_to(specimen), model.mesh_for(experiment))
    if isinstance(model, PrbModel):
        check_topology(specimen, model)


def check_topology(specimen: Specimen, model: PrbModel) -> None:
    """ValueError for a model that is declared for another kind of specimen."""
    if (kind := model.topology.specimen) != specimen.kind:
        raise ValueError(f"topology {model.topology.name} is declared for a {kind}, not for a {specimen.kind}")


def _check_mesh(specimen: Specimen, options: MeshOptions) -> None:
    """Whether so few elements can follow a tube's pads."""
    if isinstance(specimen, PinchedTube):
        from meshes.tube_grid import stations_along, stations_around

        stations_along(specimen, options)
        stations_around(specimen, options)
