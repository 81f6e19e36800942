"""What a study may choose about the finite-element performer."""

from typing import Annotated, Literal

from pydantic import Field

from lab.experiments import Experiment
from lab.materials import Frozen
from lab.specimens import Specimen
from lab.units import Quantity
from meshes.options import MeshOptions


class MaterialChange(Frozen):
    """Material figures of the specimen that this performer replaces; None keeps the specimen's."""

    law: Literal["saint-venant-kirchhoff", "neo-hookean"] | None = None
    youngs_modulus: Annotated[float, Quantity("Pa", "MPa"), Field(gt=0)] | None = None
    poisson_ratio: Annotated[float, Field(gt=-1, lt=0.5)] | None = None
    viscous_time: Annotated[float, Quantity("s", "ms"), Field(ge=0)] | None = None
    mass_damping: Annotated[float, Quantity("1/s", "1/s"), Field(ge=0)] | None = None


class FeaModel(Frozen):
    """Finite-element performer: mesh, solver and what it assumes about the material."""

    kind: Literal["fea"] = "fea"
    mesh: MeshOptions = MeshOptions()
    #: Mesh of experiments in motion. Coarser by default: deflections and frequencies of a free beam feel
    #: the singular edges of the clamp less than the reactions of a held one.
    motion_mesh: MeshOptions = MeshOptions(along=12, across=4, through=1)
    material: MaterialChange = MaterialChange()
    linear_solver: Literal["auto", "pardiso", "superlu"] = Field(
        "auto", description="auto: MKL Pardiso where its wheel is installed, SciPy's SuperLU elsewhere."
    )
    tolerance: float = Field(1e-8, gt=0, lt=1e-2, description="Newton residual relative to the reactions.")
    #: Time step of implicit dynamics; the sampling interval is divided into whole steps not longer than this.
    #: Longer steps need fewer of them, but turn the beam so far that the tangent must be renewed more often.
    time_step: Annotated[float, Quantity("s", "ms"), Field(gt=0)] = 0.28e-3
    #: A finer model that plays the lab, with known truth, is labelled so.
    origin: Literal["fea", "virtual-lab"] = "fea"
    #: Standard deviation of Gaussian noise on marker coordinates (virtual lab only).
    noise: Annotated[float, Quantity("m", "mm"), Field(ge=0)] = 0.0
    seed: int = Field(0, ge=0)

    def mesh_for(self, experiment: Experiment) -> MeshOptions:
        """Mesh options for an experiment."""
        return self.motion_mesh if experiment.in_motion else self.mesh

    def applied_to(self, specimen: Specimen) -> Specimen:
        """The specimen with this performer's material figures."""
        change = self.material.model_dump(exclude_none=True)
        return specimen.model_copy(update={"material": specimen.material.model_copy(update=change)})
