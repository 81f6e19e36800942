"""What a study may choose about the finite-element performer."""

from typing import Annotated, Literal, Self, TypeVar, cast

from pydantic import Field, model_validator

from lab.experiments import Experiment, FinPush, Pinch, PinchedBending, ShapeRecovery
from lab.experiments.fin_drive import FinDrive
from lab.fields import with_numbers
from lab.materials import Frozen, Law
from lab.specimens import FinnedTube, PinchedTube, TwistedBeam
from lab.units import Quantity
from meshes.finned_tube import FinnedPart
from meshes.making import Element
from meshes.options import MeshOptions
from meshes.tube import Part

AnySpecimen = TypeVar("AnySpecimen", bound=TwistedBeam | PinchedTube | FinnedTube)

#: Meshes of held and of moving specimens by element, for what a study leaves open.  Experiments in motion
#: get coarser ones: deflections and frequencies of a free beam feel the singular edges of the clamp less
#: than the reactions of a held one.
DEFAULT_MESHES: dict[str, dict[str, MeshOptions]] = {
    "solid": {
        "mesh": MeshOptions(),
        "motion_mesh": MeshOptions(along=12, across=4, through=1),
        "tube_mesh": MeshOptions(along=24, across=8, through=1, grading_along=0.5),
        "fin_mesh": MeshOptions(along=16, across=10, through=1, grading_along=0.5),
    },
    # Elements smaller than the shell is thick resolve nothing at the clamps: evener than solids.
    "shell": {
        "mesh": MeshOptions(along=12, across=4, through=1, grading_along=0.5, grading_across=0.0),
        "motion_mesh": MeshOptions(along=8, across=4, through=1, grading_along=0.7, grading_across=0.0),
        "tube_mesh": MeshOptions(along=24, across=8, through=1, grading_along=0.5),
        "fin_mesh": MeshOptions(along=16, across=10, through=1, grading_along=0.5),
    },
}


class MaterialChange(Frozen):
    """Material figures of the specimen that this performer replaces; None keeps the specimen's."""

    law: Law | None = None
    youngs_modulus: Annotated[float, Quantity("Pa", "MPa"), Field(gt=0)] | None = None
    poisson_ratio: Annotated[float, Field(gt=-1, lt=0.5)] | None = None
    viscous_time: Annotated[float, Quantity("s", "ms"), Field(ge=0)] | None = None
    mass_damping: Annotated[float, Quantity("1/s", "1/s"), Field(ge=0)] | None = None


class FeaModel(Frozen):
    """Finite-element performer: mesh, solver and what it assumes about the material."""

    kind: Literal["fea"] = "fea"
    element: Element = Field(
        "solid", description="solid: 27-node hexahedra; shell: 18-node solid shells on the middle surface."
    )
    mesh: MeshOptions = Field(DEFAULT_MESHES["solid"]["mesh"], description="Shells have defaults of their own.")
    #: Mesh of experiments in motion.
    motion_mesh: MeshOptions = Field(
        DEFAULT_MESHES["solid"]["motion_mesh"], description="Shells have defaults of their own."
    )
    #: Mesh of pinched tubes: elements along, and from one pad to the next.
    tube_mesh: MeshOptions = Field(
        DEFAULT_MESHES["solid"]["tube_mesh"], description="Of pinched tubes: across counts from one pad to the next."
    )
    #: Mesh of tubes with fins: elements along the tube, and over a quarter of its circumference.
    fin_mesh: MeshOptions = Field(
        DEFAULT_MESHES["solid"]["fin_mesh"], description="Of tubes with fins: across counts over a quarter around."
    )
    #: A shell's joint of fin and tube gives way too much; hexahedra lock a little where fins are very thin.
    fin_element: Element = Field(
        "solid", description="Tubes with fins: elements of the fins, 27-node hexahedra or 18-node solid shells."
    )
    #: Part of a tube with fins that is solved; the rest are its mirror images.
    fin_part: FinnedPart | None = Field(
        None, description="Tubes with fins; left out: a quarter, and half (y >= 0) where one fin alone is pushed."
    )
    material: MaterialChange = MaterialChange()
    #: Replaces the specimen's; meshes of solids must be made with it (those of shells do not depend on it).
    thickness: Annotated[float, Quantity("m", "mm"), Field(gt=0)] | None = None
    linear_solver: Literal["auto", "pardiso", "superlu"] = Field(
        "auto", description="auto: MKL Pardiso where its wheel is installed, SciPy's SuperLU elsewhere."
    )
    tolerance: float = Field(1e-8, gt=0, lt=1e-2, description="Newton residual relative to the reactions.")
    #: Time step of implicit dynamics; the sampling interval is divided into whole steps not longer than this.
    #: Longer steps need fewer of them, but turn the beam so far that the tangent must be renewed more often.
    time_step: Annotated[float, Quantity("s", "ms"), Field(gt=0)] = 0.28e-3
    #: Slow shakes take longer steps than ``time_step``: so many a period of the clamp.  Inertia far below resonance is
    #: small; beside the slowest natural vibration 256 leave 1e-4 of the path.
    steps_per_period: int = Field(
        256, ge=32, description="Slow shakes take longer steps than time_step: this many a period."
    )
    #: Pinched tubes buckle on their way.  Viscous stress carries them past, and is felt little elsewhere.
    steadying: float = Field(
        1e-3,
        ge=0,
        le=0.1,
        description="Tubes: least viscous time of the material over the duration of the shortest stage.",
    )
    #: Bellows bulge instead of stretching: the truth lies between both ends.
    chamber_tops: float = Field(
        1.0, ge=0, le=1, description="Pressurised chambers: share of their tops' stiffness around, 1 taut, 0 bulging."
    )
    #: What decides how far air flattens a tube: thin walls fold rather than stretch, and nobody has measured it.
    chamber_walls: float = Field(
        1.0, gt=0, le=1, description="Pressurised chambers: share of their walls' stiffness along the tube."
    )
    friction: float = Field(0.0, ge=0, le=2, description="Pinched tubes: Coulomb friction of the inner wall on itself.")
    #: Where a weight folds the tube right over, contact on both sides of its wall does not settle.
    outer_contact: bool = Field(True, description="Pinched tubes: the outer wall meets itself, too.")
    #: A finer model that plays the lab, with known truth, is labelled so.
    origin: Literal["fea", "virtual-lab"] = "fea"
    #: Standard deviation of Gaussian noise on marker coordinates (virtual lab only).
    noise: Annotated[float, Quantity("m", "mm"), Field(ge=0)] = 0.0
    seed: int = Field(0, ge=0)

    @model_validator(mode="after")
    def _fill_meshes(self) -> Self:
        # Past pydantic's own assignment, so that what was left out still counts as left out in sweeps.
        for name, default in DEFAULT_MESHES[self.element].items():
            given = getattr(self, name) if name in self.model_fields_set else None
            chosen = {key: getattr(given, key) for key in given.model_fields_set} if given else {}
            self.__dict__[name] = MeshOptions.model_construct(set(chosen), **(dict(default) | chosen))
        return self

    def mesh_for(self, experiment: Experiment) -> MeshOptions:
        """Mesh options for an experiment."""
        if isinstance(experiment, Pinch | PinchedBending | ShapeRecovery):
            return self.tube_mesh
        if isinstance(experiment, FinDrive):
            return self.fin_mesh
        return self.motion_mesh if experiment.in_motion else self.mesh

    def part_for(self, experiment: Experiment) -> Part | FinnedPart:
        """What of the specimen is meshed for an experiment."""
        if not isinstance(experiment, FinDrive):
            return "whole"
        return self.fin_part or ("half" if isinstance(experiment, FinPush) else "quarter")

    def applied_to(self, specimen: AnySpecimen) -> AnySpecimen:
        """The specimen with this performer's material figures and thickness.

        Raises
        ------
        ValueError
            When the thickness exceeds the specimen's width, or the specimen is a tube, which has a wall.
        """
        if self.thickness is not None and specimen.kind != "TwistedBeam":
            raise ValueError(
                f"thickness belongs to twisted beams: change the wall of a {specimen.kind} in the specimen"
            )
        change = self.material.model_dump(exclude_none=True)
        changed = specimen.model_copy(update={"material": specimen.material.model_copy(update=change)})
        if self.thickness is not None:
            changed = with_numbers(changed, {"thickness": self.thickness})
        return cast(AnySpecimen, changed)
