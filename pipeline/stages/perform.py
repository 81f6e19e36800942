"""Stages ``fea`` and ``prb``: one sample, one record file."""

import dataclasses
import json
import traceback
from pathlib import Path

from lab.records import Record
from pipeline.plan import SOURCES, Plan, Sample
from pipeline.provenance import provenance
from pipeline.study import FeaPerformer, PrbPerformer
from results.store import write_record


def perform(plan: Plan, sample_id: str, output: Path) -> str:
    """Run the sample ``sample_id``, write its record, and return a line about it.

    Whatever goes wrong inside a performer becomes a record that says so: a sweep shows its holes
    instead of losing them.  The traceback goes to the job's log.
    """
    sample = plan.samples[sample_id]
    try:
        model = sample.model
        record = _fea(plan, sample, model) if isinstance(model, FeaPerformer) else _prb(plan, sample, model)
    except Exception as error:
        traceback.print_exc()
        record = _hole(sample, f"{type(error).__name__}: {error}")
    about = {**provenance(SOURCES[sample.stage]), "study_hash": plan.study.digest(), "sample": sample.id}
    write_record(output, dataclasses.replace(record, model=sample.performer), about)
    return f"{sample.id}: {record.status} {record.reason}".rstrip()


def _hole(sample: Sample, reason: str) -> Record:
    origin = sample.model.origin if isinstance(sample.model, FeaPerformer) else "prb"
    specimen, experiment = sample.specimen.model_dump(mode="json"), sample.experiment.model_dump(mode="json")
    return Record(origin, sample.performer, specimen, experiment, status="failed", reason=reason)


def _fea(plan: Plan, sample: Sample, model: FeaPerformer) -> Record:
    import fea
    from meshes import read_mesh

    if model.fit:
        found = _fitted(plan, model.fit)
        model = model.model_copy(update={"material": model.material.model_copy(update=found)})
    return fea.perform(sample.specimen, sample.experiment, model, read_mesh(Path(plan.mesh_job(sample).output)))


def _prb(plan: Plan, sample: Sample, model: PrbPerformer) -> Record:
    import prb

    if model.fit:
        model = model.model_copy(update={"parameters": {**model.parameters, **_fitted(plan, model.fit)}})
    return prb.perform(sample.specimen, sample.experiment, model)


def _fitted(plan: Plan, name: str) -> dict[str, float]:
    result = json.loads(Path(plan.fit_output(name)).read_text(encoding="utf-8"))
    if result["status"] != "completed":
        raise ValueError(f"fit {name} gave no parameters: {result['reason']}")
    return {p["name"]: p["value"] for p in result["parameters"]}
