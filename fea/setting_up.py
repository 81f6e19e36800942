"""What every experiment does before and after its solution."""

from collections.abc import Sequence
from functools import cache
from typing import Any, TypeAlias

import numpy as np
from skfem import MeshHex2, MeshQuad2

from fea.body import Body
from fea.linear import LinearSolver, make_solver
from fea.load_frame import framed
from fea.model import FeaModel
from fea.parts import Deformable
from fea.shell import Shell
from lab.experiments import Experiment
from lab.materials import Material
from lab.specimens import Specimen, TwistedBeam
from meshes.making import Element
from meshes.twist import thickness_directions

#: Meshes of specimens: the body, or its middle surface.
Mesh: TypeAlias = MeshHex2 | MeshQuad2


#: Share by which the section of a mesh may differ from the specimen's: of another thickness, or the facets of a twist.
_WRONG_SECTION = 0.02


@cache
def warm_up(solver: str, element: Element = "solid") -> None:
    """Compile or load the kernels and the linear solver on one element, so that clocks see only work."""
    part = Body(MeshHex2(), Material()) if element == "solid" else Shell(MeshQuad2(), 0.1, Material())
    at_rest = np.zeros((part.nodes, 3))
    _, data = part.tangent(at_rest)
    part.internal_force(at_rest, 1.0, part.strains(at_rest))
    part.strain_energy(at_rest)
    pattern, taken = part.pattern.restrict(np.arange(3 * part.nodes * 8 // 9, 3 * part.nodes))
    linear = make_solver(solver, pattern)
    linear.factorise(data[taken])
    linear.solve(np.zeros(pattern.size))


@cache
def warm_up_motion() -> None:
    """Compile or load the steps of shells on one element."""
    from fea.shell_motion import ShellMotion

    mesh = MeshQuad2().with_boundaries({"root": lambda x: x[0] < 0.1})
    ShellMotion(Shell(mesh, 0.1, Material())).run(1e-4, 2)


def make_part(specimen: TwistedBeam, model: FeaModel, mesh: Mesh) -> Deformable:
    """The specimen in elements, with the performer's material, the density that gives its mass, and its load frame.

    The frame holds the tip face by a stiff block beyond it, see ``fea.load_frame``.

    Raises
    ------
    ValueError
        When the mesh is not of the model's element.
    """
    applied = model.applied_to(specimen)
    if isinstance(mesh, MeshQuad2) != (model.element == "shell"):
        raise ValueError(f"a {type(mesh).__name__} is no mesh for the element {model.element!r} of the model")
    if isinstance(mesh, MeshQuad2):
        return _shell(applied, mesh)
    body = _body(applied, mesh)
    if abs(body.shares("tip").sum() / applied.area - 1.0) > _WRONG_SECTION:
        area, wanted = 1e6 * body.shares("tip").sum(), 1e6 * applied.area
        raise ValueError(f"the mesh has a tip of {area:.4g} mm^2, the specimen of this model {wanted:.4g} mm^2")
    return body


def _shell(specimen: TwistedBeam, mesh: MeshQuad2) -> Shell:
    if specimen.load_frame is None:
        directors = thickness_directions(specimen, mesh.doflocs.T)
        return Shell(mesh, specimen.thickness, specimen.material, specimen.effective_density, directors)
    whole = framed(specimen, specimen.load_frame, mesh)
    # The frame's block goes on straight.
    directors = thickness_directions(specimen, np.minimum(whole.mesh.doflocs.T, [specimen.length, np.inf, np.inf]))
    return Shell(
        whole.mesh, specimen.thickness, specimen.material, whole.density, directors,
        stiffening=whole.stiffening, coupled_mass=whole.mass,
    )  # fmt: skip


def _body(specimen: TwistedBeam, mesh: MeshHex2) -> Body:
    if specimen.load_frame is None:
        return Body(mesh, specimen.material, specimen.effective_density)
    whole = framed(specimen, specimen.load_frame, mesh)
    return Body(
        whole.mesh, specimen.material, whole.density, stiffening=whole.stiffening, coupled_mass=whole.mass
    )  # fmt: skip


def how(
    part: Deformable | Sequence[Deformable], model: FeaModel, solver: LinearSolver | str, seconds: float,
    history: dict[str, Any],
) -> dict[str, Any]:  # fmt: skip
    """The record's ``how``: plain JSON data."""
    parts = [part] if isinstance(part, Deformable) else list(part)
    first, nodes = parts[0], sum(one.nodes for one in parts)
    thickness = {"thickness": float(np.mean(first.thickness))} if isinstance(first, Shell) else {}
    return {
        "mesh": {
            "elements": sum(len(one.cells) for one in parts),
            "nodes": nodes,
            "element": ", ".join(dict.fromkeys(one.kind for one in parts)),
        },
        "unknowns": 3 * nodes,
        "material": first.material.model_dump(),
        # The specimen's own elements come first.
        "density": float(np.ravel(np.asarray(first.density, dtype=float))[0]),
        **thickness,
        "linear_solver": solver if isinstance(solver, str) else solver.name,
        "tolerance": model.tolerance,
        "history": history,
        "wall_time_s": seconds,
    }


def said(specimen: Specimen, experiment: Experiment, model: FeaModel) -> dict[str, Any]:
    """First arguments of the record."""
    return {
        "origin": model.origin, "model": model.kind, "specimen": specimen.model_dump(),
        "experiment": experiment.model_dump(),
    }  # fmt: skip
