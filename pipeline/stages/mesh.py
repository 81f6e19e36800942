"""Stage ``mesh``: specimen to mesh file."""

from pathlib import Path

from meshes import make_mesh
from pipeline.plan import Plan
from pipeline.study import FeaPerformer


def mesh(plan: Plan, job_id: str, output: Path) -> str:
    """Make the mesh ``job_id`` and return a line about it."""
    for sample in plan.samples.values():
        if isinstance(sample.model, FeaPerformer) and plan.mesh_job(sample).id == job_id:
            output.parent.mkdir(parents=True, exist_ok=True)
            quality = make_mesh(sample.specimen, sample.model.mesh, output)
            return f"{job_id}: {quality}"
    raise KeyError(job_id)
