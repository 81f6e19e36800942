"""Fit of kind ``readings``: which way of reading a stiffness table fits best."""

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

from calibrate.spec import ReadingsFit
from lab.experiments import StaticStiffness
from lab.records import Record, Scalar
from lab.specimens import TwistedBeam
from lab.units import from_si, to_si
from pipeline.plan import Plan
from pipeline.study import FeaPerformer


def readings(plan: Plan, name: str, records: Mapping[str, Record], threads: int) -> dict[str, Any]:
    """Every reading of the fit's table with what is left over, the best first."""
    from calibrate.readings import rank_readings

    spec = plan.study.fits[name]
    assert isinstance(spec, ReadingsFit)
    lab = plan.lab_table(spec.reference).rows
    rows = {
        phi: _numbers(row) for phi, row in lab.items() if not spec.used or phi in {to_si(u, "deg") for u in spec.used}
    }
    table, modulus = {}, 0.0
    for sample in plan.fit_samples(name):
        beam, experiment, model = sample.specimen, sample.experiment, sample.model
        if not (
            isinstance(beam, TwistedBeam)
            and isinstance(experiment, StaticStiffness)
            and isinstance(model, FeaPerformer)
        ):
            raise ValueError(
                f"readings need static tests of twisted beams by FEA, not {experiment.kind} of a {beam.kind} by "
                f"{model.kind}"
            )
        key = (math.degrees(beam.twist), math.degrees(beam.root_angle), experiment.rig_stiffness)
        table[key] = _numbers(experiment.reduce(records[sample.id]))
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
        "tables": [{"title": "readings of the table", "header": header, "rows": lines, "notes": notes}],
    }


def _numbers(row: Mapping[str, Scalar]) -> dict[str, float]:
    return {entry: scalar.value for entry, scalar in row.items()}
