"""Stage ``fit``: parameters of a performer from records, with what the records can tell about them."""

import dataclasses
import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from calibrate.spec import ModulusFit, ReadingsFit, TrackingFit
from lab.experiments import RingDown, StaticStiffness
from lab.records import Record, Scalar
from lab.units import from_si, to_si
from pipeline.plan import Plan, Sample
from pipeline.study import FeaPerformer, Fit, PrbPerformer
from results.store import read_record, write_text

Result = dict[str, Any]


def fit(plan: Plan, name: str, output: Path, threads: int = 1) -> str:
    """Run the fit ``name``, write its result as JSON, and return a line about it.

    A fit whose records are holes is written down as failed with the reason; what depends on it
    shows the hole in turn.
    """
    spec = plan.study.fits[name]
    samples = plan.fit_samples(name)
    records = [read_record(Path(plan.output(sample)), with_fields=False) for sample in samples]
    broken = [f"{s.id} {r.status}: {r.reason}" for s, r in zip(samples, records, strict=True) if not r.completed]
    if broken:
        result: Result = {"status": "failed", "reason": f"no reference: {'; '.join(broken)}", "parameters": []}
        result |= {"notes": [], "table": {"header": ["parameter"], "rows": []}}
    else:
        result = {"status": "completed", "reason": "", **_run(plan, spec, samples, records, threads)}
    write_text(output, json.dumps(result, indent=1) + "\n")
    return f"fit {name}: {result['status']} {result['reason']}".rstrip()


def _run(plan: Plan, spec: Fit, samples: Sequence[Sample], records: Sequence[Record], threads: int) -> Result:
    if isinstance(spec, TrackingFit):
        return _tracking(plan, spec, samples, records, threads)
    if isinstance(spec, ModulusFit):
        return _modulus(plan, spec, samples, records)
    return _readings(plan, spec, samples, records)


def _tracking(
    plan: Plan, spec: TrackingFit, samples: Sequence[Sample], records: Sequence[Record], threads: int
) -> Result:
    from calibrate.tracking import fit_tracking
    from prb.mujoco_model import to_mjcf

    model, experiment = plan.study.performers[spec.model], samples[0].experiment
    if not isinstance(model, PrbPerformer) or not isinstance(experiment, RingDown):
        raise ValueError(f"a tracking fit needs a PRB performer and ring-downs, not {model.kind} and {experiment.kind}")
    used = [record for sample, record in zip(samples, records, strict=True) if sample.slug in spec.used]
    found = fit_tracking(samples[0].specimen, model, used, spec, threads)
    fitted = model.model_copy(update={"parameters": {**model.parameters, **found.values()}})
    mechanism = fitted.mechanism(samples[0].specimen).in_motion
    mjcf = to_mjcf(mechanism, experiment.markers, model.time_step)
    errors = (
        f"in sample ({', '.join(spec.used)}): tracking error {found.tracking_error:.2%}, "
        f"objective {found.objective * 1e3:.3g} mm (eq. 5.13), "
        f"{found.evaluations} evaluations in {found.wall_time_s:.1f} s; "
        f"held-out samples stand in the accuracy table."
    )
    return _with_table({**found.to_json(), "held_out": list(spec.held_out), "mjcf": mjcf}, errors)


def _modulus(plan: Plan, spec: ModulusFit, samples: Sequence[Sample], records: Sequence[Record]) -> Result:
    from calibrate.modulus import fit_modulus

    rows = plan.lab_table(spec.reference).rows
    used_rows = [rows[to_si(text, "deg")] for text in spec.used]
    used_records = [
        dataclasses.replace(record, scalars=sample.experiment.reduce(record))
        for sample, record in zip(samples, records, strict=True)
    ]
    found = fit_modulus(used_records, used_rows, spec.entries, spec.used)
    note = f"fitted to row {', '.join(spec.used)}, entries {', '.join(spec.entries)}; the other rows are held out."
    return _with_table(found.to_json(), note)


def _with_table(result: Result, note: str) -> Result:
    """The result with its parameters as a table for people."""
    header = ["parameter", "unit", "value", "standard error", "lower bound", "upper bound"]
    rows = [
        [
            p["name"],
            p["unit"],
            *("-" if p[key] is None else f"{p[key]:.4g}" for key in ("value", "standard_error", "lower", "upper")),
        ]
        for p in result["parameters"]
    ]
    return {**result, "notes": [note, *result["notes"]], "table": {"header": header, "rows": rows}}


def _readings(plan: Plan, spec: ReadingsFit, samples: Sequence[Sample], records: Sequence[Record]) -> Result:
    from calibrate.readings import rank_readings

    lab = plan.lab_table(spec.reference).rows
    rows = {
        phi: _numbers(row) for phi, row in lab.items() if not spec.used or phi in {to_si(u, "deg") for u in spec.used}
    }
    table, modulus = {}, 0.0
    for sample, record in zip(samples, records, strict=True):
        beam, experiment, model = sample.specimen, sample.experiment, sample.model
        if not isinstance(experiment, StaticStiffness) or not isinstance(model, FeaPerformer):
            raise ValueError(f"readings need static tests by FEA, not {experiment.kind} by {model.kind}")
        key = (math.degrees(beam.twist), math.degrees(beam.root_angle), experiment.rig_stiffness)
        table[key] = _numbers(experiment.reduce(record))
        modulus = model.applied_to(beam).material.youngs_modulus
    ranked = rank_readings(table, rows, modulus, spec.entries)
    header = ["rank", "reading", "E [MPa]", "rig [N/mm]", "misfit", *(f"phi {phi:g} deg" for phi in rows)]
    lines = [
        [
            str(rank),
            f"phi>0 {'right' if r.twist_sense > 0 else 'left'}-handed, clamp of the 45s at {r.mount_angle:g} deg, "
            f"{'compliant' if r.compliant_rig else 'rigid'} rig",
            f"{from_si(r.youngs_modulus, 'Pa', 'MPa'):.1f}",
            "rigid" if r.rig_stiffness is None else f"{r.rig_stiffness / 1e3:.3g}{' (edge)' if r.at_edge else ''}",
            f"{r.misfit:.3f}",
            *(f"{value:.3f}" for value in r.row_misfits.values()),
        ]
        for rank, r in enumerate(ranked, 1)
    ]
    notes = [
        f"misfit: root mean square over {', '.join(spec.entries)} and rows of (model - lab) / (largest entry of the "
        "row with the same unit); "
        "E, and the rig where it may give way, are fitted to all rows at once: every figure here is in sample.",
        "a rigid rig at the end of a compliant search is marked (edge): the data do not ask for compliance there.",
    ]
    listed = [{**dataclasses.asdict(r), "row_misfits": list(r.row_misfits.values())} for r in ranked]
    return {
        "kind": "readings",
        "parameters": [],
        "ranked": listed,
        "notes": notes,
        "table": {"header": header, "rows": lines},
    }


def _numbers(row: Mapping[str, Scalar]) -> dict[str, float]:
    return {entry: scalar.value for entry, scalar in row.items()}
