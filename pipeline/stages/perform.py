"""Stages ``lab``, ``fea`` and ``prb``: one sample, one record file."""

import dataclasses
import traceback
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from lab.experiments import Experiment
from lab.records import Record
from lab.specimens import PinchedTube, Specimen
from pipeline.plan import SOURCES, Plan, Sample
from pipeline.provenance import provenance
from pipeline.stages.gather import fit_result
from pipeline.study import FeaPerformer, LabPerformer, PrbPerformer
from results.store import write_record


def perform(plan: Plan, sample_id: str, output: Path) -> str:
    """Run the sample ``sample_id``, write its record, and return a line about it.

    Whatever goes wrong inside a performer becomes a record that says so: a sweep shows its holes
    instead of losing them.  The traceback goes to the job's log.
    """
    sample = plan.samples[sample_id]
    try:
        record = _run(plan, sample)
    except Exception as error:
        traceback.print_exc()
        record = _hole(sample, f"{type(error).__name__}: {error}")
    about = {**provenance(SOURCES[sample.stage]), "study_hash": plan.study.digest(), "sample": sample.id}
    write_record(output, dataclasses.replace(record, model=sample.performer), about)
    return f"{sample.id}: {record.status} {record.reason}".rstrip()


def _run(plan: Plan, sample: Sample) -> Record:
    model = sample.model
    if isinstance(model, LabPerformer):
        return _lab(plan, sample, model)
    return _fea(plan, sample, model) if isinstance(model, FeaPerformer) else _prb(plan, sample, model)


def _hole(sample: Sample, reason: str) -> Record:
    origin = sample.model.origin if isinstance(sample.model, FeaPerformer) else sample.model.kind
    specimen, experiment = sample.specimen.model_dump(mode="json"), sample.experiment.model_dump(mode="json")
    return Record(origin, sample.performer, specimen, experiment, status="failed", reason=reason)


def _lab(plan: Plan, sample: Sample, model: LabPerformer) -> Record:
    from lab.recordings import perform as read

    return read(sample.specimen, sample.experiment, model, plan.lab_file(sample))


def _fea(plan: Plan, sample: Sample, model: FeaPerformer) -> Record:
    import fea
    from meshes import read_mesh

    mesh = read_mesh(Path(plan.mesh_job(sample).output))
    if not model.fit:
        return fea.perform(sample.specimen, sample.experiment, model, mesh)
    result = completed_result(plan, model.fit)
    values = {p["name"]: p["value"] for p in result["parameters"]}
    thickness = values.pop("thickness", model.thickness)
    material = model.material.model_copy(update=values)
    fitted = model.model_copy(update={"material": material, "thickness": thickness})
    return _as_sensed(plan, sample, model.fit, result, lambda e: fea.perform(sample.specimen, e, fitted, mesh))


def _prb(plan: Plan, sample: Sample, model: PrbPerformer) -> Record:
    import prb

    if not model.fit:
        return prb.perform(sample.specimen, sample.experiment, model)
    result = completed_result(plan, model.fit)
    fitted, warnings = fitted_prb(plan, result, model, sample.specimen)
    record = _as_sensed(plan, sample, model.fit, result, lambda e: prb.perform(sample.specimen, e, fitted))
    return dataclasses.replace(record, how={**record.how, "warnings": list(warnings)}) if warnings else record


def _as_sensed(
    plan: Plan, sample: Sample, fit: str, result: Mapping[str, Any], run: Callable[[Experiment], Record]
) -> Record:
    from pipeline.stages.sensed import nuisances_of, perform_sensed  # loads the fits' code, which others do not need

    return perform_sensed(run, sample.experiment, nuisances_of(plan, sample, fit, result))


def fitted_prb(
    plan: Plan, result: Mapping[str, Any], model: PrbPerformer, specimen: Specimen
) -> tuple[PrbPerformer, tuple[str, ...]]:
    """The model with what a fit found for ``specimen``, and why to doubt it there.

    A selection puts its chosen model, topology and all, in the place of ``model``.
    """
    warnings: tuple[str, ...] = ()
    if result["kind"] == "hinge":
        from prb.hinge_curves import HingeCurves

        curves = HingeCurves.model_validate(result["hinge"])
        doubts = curves.doubts(specimen) if isinstance(specimen, PinchedTube) else ()
        return model.model_copy(update={"hinge": curves}), doubts
    if result["kind"] == "paddler":
        from prb.fin_curves import FinCurves

        numbers = {p["name"]: p["value"] for p in result["parameters"]}
        fin = FinCurves.model_validate(result["fin"]) if result["fin"] else model.fin
        doubts = fin.doubts(specimen) if fin else ()
        return model.model_copy(update={"fin": fin, "parameters": {**model.parameters, **numbers}}), doubts
    if result["kind"] == "parametric":
        from calibrate.parametric import ParametricModel

        prediction = ParametricModel.from_json(result["model"]).predict(specimen)
        values, warnings = dict(prediction.values), tuple(prediction.warnings)
    else:
        values = {p["name"]: p["value"] for p in result["parameters"]}
    if result["kind"] == "selection":
        chosen = plan.study.performers[result["chosen_model"]]
        assert isinstance(chosen, PrbPerformer)
        model = chosen
    return model.model_copy(update={"parameters": {**model.parameters, **values}}), warnings


def completed_result(plan: Plan, name: str) -> dict[str, Any]:
    """Result of a finished fit; ValueError with the reason where it has none."""
    result = fit_result(plan, name)
    if result["status"] != "completed":
        raise ValueError(f"fit {name} gave no parameters: {result['reason']}")
    return result
