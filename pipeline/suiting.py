"""What only the parts of a sample together can get wrong, found before anything is meshed."""

from typing import get_args

from fea.model import FeaModel
from lab.experiments import Experiment, PaddleThrust
from lab.experiments.fin_drive import FinDrive
from lab.experiments.pinch_drive import PinchDrive
from lab.materials import Frozen
from lab.specimens import FinnedTube, PinchedTube, Specimen, TwistedBeam
from meshes.making import Element
from meshes.options import MeshOptions
from prb.model import PrbModel

#: Experiments that are for one kind of specimen only; all others are for beams.
_FOR: dict[type[Frozen], type[Frozen]] = {PinchDrive: PinchedTube, FinDrive: FinnedTube, PaddleThrust: FinnedTube}


def misfit(specimen: Specimen, experiment: Experiment) -> str:
    """Why an experiment is none for this specimen (tubes are pinched, beams are not); empty where it is one."""
    if isinstance(specimen, _meant_for(type(experiment))):
        return ""
    kinds = [kind for kind in get_args(get_args(Experiment)[0]) if isinstance(specimen, _meant_for(kind))]
    there = ", ".join(kind.__name__ for kind in kinds)
    return f"{experiment.kind} is no experiment for a {specimen.kind}; there is {there}"


def _meant_for(experiment: type[Frozen]) -> type[Frozen]:
    return next((specimen for kind, specimen in _FOR.items() if issubclass(experiment, kind)), TwistedBeam)


def check_sample(specimen: Specimen, experiment: Experiment, model: Frozen) -> None:
    """ValueError, in one line, for parts that each are right and do not go together."""
    if isinstance(specimen, PinchedTube) and isinstance(experiment, PinchDrive):
        experiment.shares(specimen.pairs)
    if isinstance(specimen, FinnedTube) and isinstance(experiment, FinDrive) and (why := experiment.misfit(specimen)):
        raise ValueError(why)
    if isinstance(model, FeaModel):
        _check_mesh(model.applied_to(specimen), model.mesh_for(experiment), model.element)
    if isinstance(model, PrbModel):
        check_topology(specimen, model)


def check_topology(specimen: Specimen, model: PrbModel) -> None:
    """ValueError for a model that is declared for another kind of specimen."""
    if (kind := model.topology.specimen) != specimen.kind:
        raise ValueError(f"topology {model.topology.name} is declared for a {kind}, not for a {specimen.kind}")


def _check_mesh(specimen: Specimen, options: MeshOptions, element: Element) -> None:
    """Whether there is such a mesh, and so few elements can follow a tube's pads or a fin's crease."""
    if isinstance(specimen, PinchedTube):
        from meshes.tube_grid import stations_along, stations_around

        stations_along(specimen, options)
        stations_around(specimen, options)
    if isinstance(specimen, FinnedTube):
        from meshes.finned_grid import quarter_grid

        if element == "solid":
            raise ValueError("a FinnedTube has no mesh of hexahedra: set element: shell in the performer")
        quarter_grid(specimen, options)
