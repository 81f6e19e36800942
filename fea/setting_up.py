"""What every experiment does before and after its solution."""

from functools import cache
from typing import Any

import numpy as np
from skfem import MeshHex2

from fea.body import Body
from fea.linear import LinearSolver, make_solver
from fea.model import FeaModel
from lab.experiments import Experiment
from lab.materials import Material
from lab.specimens import Specimen


@cache
def warm_up(solver: str) -> None:
    """Compile or load the kernels and the linear solver on one element, so that clocks see only work."""
    body = Body(MeshHex2(), Material())
    at_rest = np.zeros((body.nodes, 3))
    _, data = body.tangent(at_rest)
    body.internal_force(at_rest, 1.0, body.strains(at_rest))
    body.strain_energy(at_rest)
    pattern, taken = body.pattern.restrict(np.arange(24, 3 * body.nodes))
    linear = make_solver(solver, pattern)
    linear.factorise(data[taken])
    linear.solve(np.zeros(pattern.size))


def make_body(specimen: Specimen, model: FeaModel, mesh: MeshHex2) -> Body:
    """Solid of the specimen with the performer's material and the density that gives its mass."""
    applied = model.applied_to(specimen)
    return Body(mesh, applied.material, applied.effective_density)


def how(body: Body, model: FeaModel, solver: LinearSolver, seconds: float, history: dict[str, Any]) -> dict[str, Any]:
    """The record's ``how``: plain JSON data."""
    return {
        "mesh": {"elements": len(body.cells), "nodes": body.nodes, "element": "27-node hexahedron, 27 points"},
        "unknowns": 3 * body.nodes,
        "material": body.material.model_dump(),
        "density": body.density,
        "linear_solver": solver.name,
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
