"""Stage ``fit``: parameters of a performer from records, with what the records can tell about them."""

import dataclasses
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from calibrate.spec import Fit, HingeFit, ModulusFit, PaddlerFit
from calibrate.targets import Target, target
from lab.experiments import Experiment, PaddleThrust
from lab.records import Record
from lab.specimens import FinnedTube, Specimen
from lab.units import to_si
from pipeline.plan import Datum, Plan
from pipeline.stages.gather import fit_result
from pipeline.study import FeaPerformer, PrbPerformer
from results.store import read_record, write_text

Result = dict[str, Any]
#: Time step of exported models, s: a simulator that takes plain steps has their first-order error, which our
#: extrapolated motions do not have (some 2 % at 0.5 ms).
_EXPORTED_STEP = 0.1e-3


def fit(plan: Plan, name: str, output: Path, threads: int = 1) -> str:
    """Run the fit ``name``, write its result as JSON, and return a line about it.

    A fit whose records are holes is written down as failed with the reason; what depends on it
    shows the hole in turn.
    """
    samples = plan.fit_samples(name)
    records = {s.id: read_record(Path(plan.output(s)), with_fields=False) for s in samples}
    broken = _holes(plan, name, records)
    broken += [f"fit {other} {reason}" for other, reason in _failed_fits(plan, name)]
    if broken:
        result: Result = {"status": "failed", "reason": f"no reference: {'; '.join(broken)}", "parameters": []}
        result["notes"] = []
    else:
        run = _kinds()[plan.study.fits[name].kind]
        result = {"status": "completed", "reason": "", **run(plan, name, records, threads)}
    write_text(output, json.dumps(result, indent=1) + "\n")
    return f"fit {name}: {result['status']} {result['reason']}".rstrip()


def _kinds() -> Mapping[str, Callable[[Plan, str, Mapping[str, Record], int], Result]]:
    from pipeline.stages.fit_hinge import hinge
    from pipeline.stages.fit_paddler import paddler
    from pipeline.stages.fit_parametric import parametric
    from pipeline.stages.fit_readings import readings
    from pipeline.stages.fit_selection import selection

    return {
        "fit": _follow, "modulus": _modulus, "readings": readings, "selection": selection, "parametric": parametric,
        "hinge": hinge, "paddler": paddler,
    }  # fmt: skip


def _holes(plan: Plan, name: str, records: Mapping[str, Record]) -> list[str]:
    """Records without a result that stop a fit: any; of a hinge or fin, learned state by state, all used ones."""
    if isinstance(plan.study.fits[name], HingeFit | PaddlerFit):
        used = {datum.sample.id for datum in plan.data(name) if datum.used}
        if any(records[id].completed for id in used):
            return []
        records = {id: records[id] for id in sorted(used)}
    return [f"{id} {record.status}: {record.reason}" for id, record in records.items() if not record.completed]


def _failed_fits(plan: Plan, name: str) -> list[tuple[str, str]]:
    others = {other: fit_result(plan, other) for other in getattr(plan.study.fits[name], "fits", ())}
    return [(other, found["reason"]) for other, found in others.items() if found["status"] != "completed"]


def targets_of(plan: Plan, name: str, records: Mapping[str, Record]) -> tuple[list[Target], list[Target]]:
    """What a fit uses, and what it holds out."""
    used: list[Target] = []
    held_out: list[Target] = []
    for datum in plan.data(name):
        item, sample = plan.following(name).data[datum.item], datum.sample
        record = records[sample.id] if datum.row is None else _row_as_record(plan, item.reference, datum)
        found = target(datum.label, sample.specimen, sample.experiment, record, item)
        (used if datum.used else held_out).append(found)
    return used, held_out


def _row_as_record(plan: Plan, table: str, datum: Datum) -> Record:
    """A row of a lab table: its numbers without the channels that they were reduced from."""
    measured, sample = plan.lab_table(table), datum.sample
    assert datum.row is not None
    specimen, experiment = sample.specimen.model_dump(mode="json"), sample.experiment.model_dump(mode="json")
    return Record(measured.origin, table, specimen, experiment, scalars=measured.rows[datum.row])  # type: ignore[arg-type]


def model_of(plan: Plan, name: str) -> FeaPerformer | PrbPerformer:
    """The performer whose parameters a fit looks for."""
    model = plan.study.performers[plan.following(name).model]
    if not isinstance(model, FeaPerformer | PrbPerformer):
        raise ValueError(f"fit {name}: {model.kind} has no parameters")
    return model


def mjcf_of(model: PrbPerformer, values: Mapping[str, float], specimen: Specimen, experiment: Experiment) -> str:
    """The fitted model for a user's own simulator."""
    from prb.mujoco_model import to_mjcf

    fitted = model.model_copy(update={"parameters": {**model.parameters, **values}})
    if isinstance(specimen, FinnedTube) and isinstance(experiment, PaddleThrust):
        return _paddler_mjcf(fitted, specimen, experiment)
    mechanism = fitted.mechanism(specimen)
    if experiment.in_motion:
        mechanism = mechanism.in_motion
    return to_mjcf(mechanism, getattr(experiment, "markers", ()), min(model.time_step, _EXPORTED_STEP))


def _paddler_mjcf(model: PrbPerformer, specimen: FinnedTube, experiment: PaddleThrust) -> str:
    from prb.paddler import paddler_of, stroke_of
    from prb.paddler_mujoco import paddler_mjcf

    step = min(model.time_step, _EXPORTED_STEP)
    paddler = paddler_of(specimen, model.values(specimen), model.fin)
    return paddler_mjcf(paddler, stroke_of(experiment), water=model.water, time_step=step)


def _follow(plan: Plan, name: str, records: Mapping[str, Record], threads: int) -> Result:
    from calibrate.fitting import fit as follow

    spec, model = plan.study.fits[name], model_of(plan, name)
    assert isinstance(spec, Fit)
    used, held_out = targets_of(plan, name, records)
    found = follow(spec, model, used, held_out, threads)
    result = found.to_json()
    if isinstance(model, PrbPerformer):
        moving = next((t for t in used if t.experiment.in_motion), used[0])
        result["mjcf"] = mjcf_of(model, found.values(), moving.specimen, moving.experiment)
    cost = f"{found.evaluations} runs in {found.wall_time_s:.1f} s"
    if not held_out:
        result["notes"].append("Nothing is held out of this fit: all its errors are in sample.")
    result["notes"] = [f"Fitted to {', '.join(found.used)}; {cost}.", *result["notes"]]
    return result


def _modulus(plan: Plan, name: str, records: Mapping[str, Record], threads: int) -> Result:
    from calibrate.modulus import fit_modulus

    spec = plan.study.fits[name]
    assert isinstance(spec, ModulusFit)
    rows = plan.lab_table(spec.reference).rows
    used_rows = [rows[to_si(text, "deg")] for text in spec.used]
    used_records = [
        dataclasses.replace(records[sample.id], scalars=sample.experiment.reduce(records[sample.id]))
        for sample in plan.fit_samples(name)
    ]
    found = fit_modulus(used_records, used_rows, spec.entries, spec.used)
    note = f"Fitted to row {', '.join(spec.used)}, entries {', '.join(spec.entries)}; the other rows are held out."
    result = found.to_json()
    return {**result, "notes": [note, *result["notes"]]}
