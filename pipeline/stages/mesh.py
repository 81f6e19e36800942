"""Stage ``mesh``: specimen to mesh file."""

from pathlib import Path

from pydantic import TypeAdapter

from lab.specimens import Specimen
from meshes import make_mesh
from meshes.options import MeshOptions
from pipeline.plan import Plan


def mesh(plan: Plan, job_id: str, output: Path) -> str:
    """Make the mesh ``job_id`` and return a line about it."""
    params = plan.jobs_of("mesh")[job_id].params
    output.parent.mkdir(parents=True, exist_ok=True)
    specimen: Specimen = TypeAdapter(Specimen).validate_python(params["specimen"])
    options = MeshOptions(**params["mesh"])
    quality = make_mesh(specimen, options, output, params["element"], params.get("part", "whole"))
    return f"{job_id}: {quality}"
