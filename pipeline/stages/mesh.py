"""Stage ``mesh``: specimen to mesh file."""

from pathlib import Path

from lab.specimens import Specimen
from meshes import make_mesh
from meshes.options import MeshOptions
from pipeline.plan import Plan


def mesh(plan: Plan, job_id: str, output: Path) -> str:
    """Make the mesh ``job_id`` and return a line about it."""
    params = plan.jobs_of("mesh")[job_id].params
    output.parent.mkdir(parents=True, exist_ok=True)
    quality = make_mesh(Specimen.model_validate(params["specimen"]), MeshOptions(**params["mesh"]), output)
    return f"{job_id}: {quality}"
