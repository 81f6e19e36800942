"""How a model with a learned hinge follows records, and tables of both."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

import prb
from calibrate.hinge_data import HingeDatum
from lab.experiments import Pinch, PinchedBending
from lab.experiments.pinch_drive import STAGES
from lab.pinching import axis_difference
from lab.records import Record
from prb.hinge_curves import TOUCH, HingeCurves
from prb.model import PrbModel

#: Numbers that a fit is judged by, and axes, whose misfit is an angle.
_PINCH = ("closing_force", "touch_travel", "k_soft", "k_stiff", "k_torsion")
_BENDING = ("k", "k_initial")
#: Share of a bending's motion above which its settling is worth a note.
_UNSETTLED = 0.02
_AXES = {"Pinch": ("hinge_axis", "deformation_axis"), "PinchedBending": ("turn_axis",)}


def score_of(model: PrbModel, item: HingeDatum) -> dict[str, Any]:
    """How the model follows a record: relative misfits of the main numbers, axes in rad apart."""
    e, record = item.experiment, item.record
    found = prb.perform(item.specimen, e, model)
    score: dict[str, Any] = {
        "name": item.label, "use": "in sample" if item.used else "held out", "error": None, "rms": None,
        "entries": {}, "axes": {}, "nuisances": {}, "note": found.reason,
    }  # fmt: skip
    if not found.completed:
        return score
    ours, theirs = _reduced(e, found), _reduced(e, record)
    names = _PINCH if isinstance(e, Pinch) else _BENDING
    off = {n: ours[n] / theirs[n] - 1.0 for n in names if n in ours and n in theirs and theirs[n]}
    score["entries"] = off
    score["axes"] = {n: axis_difference(ours[n], theirs[n]) for n in _AXES[e.kind] if n in ours and n in theirs}
    if isinstance(e, PinchedBending):
        score["rms"], score["error"] = _apart(e, found, record)
        settled = _settled(e, record)
        if settled > _UNSETTLED:
            score["note"] = f"{settled:.0%} of the record's motion is not by the load: it settles as tendons are held"
    else:
        finite = [v for v in off.values() if np.isfinite(v)]
        score["error"] = float(np.sqrt(np.mean(np.square(finite)))) if finite else None
    return score


def _reduced(experiment: Any, record: Record) -> dict[str, float]:
    with np.errstate(divide="ignore", invalid="ignore"):
        return {name: scalar.value for name, scalar in experiment.reduce(record).items()}


def _apart(experiment: PinchedBending, found: Record, record: Record) -> tuple[float, float]:
    """Root mean square distance of the block's face while it bends, m, and over that which it moved.

    Across the tube and from where the bending began, at the loads (or pushes) of the record; of a tube that was loaded
    first, at the end.
    """
    by = "load" if experiment.push is None else "pushed"
    paths = []
    for one in (found, record):
        bending = np.flatnonzero(one["stage"] == STAGES.index("bend"))
        rows = np.arange(bending[0] - 1, bending[-1] + 1) if len(bending) else np.array([0, len(one["stage"]) - 1])
        moved = one["pose"][rows, :2] - one["pose"][rows[0], :2]
        paths.append((one[by][rows] - one[by][rows[0]], moved))
    (ours_at, ours), (at, theirs) = paths
    if experiment.order == "pinch first":
        ours = np.column_stack([np.interp(at, ours_at, column) for column in ours.T])
    distance, size = (float(np.sqrt(np.mean(np.sum(d[1:] ** 2, axis=1)))) for d in (ours - theirs, theirs))
    return distance, distance / size


def _settled(experiment: PinchedBending, record: Record) -> float:
    """Share of a bending's motion that its first load is not behind, by the flexibility that it finds.

    A pinch that moves until its tendons are held leaves the tube out of rest, and no statics knows of it.
    """
    bending = np.flatnonzero(record["stage"] == STAGES.index("bend"))
    if not len(bending):
        return 0.0
    first, direction = bending[0], np.array([np.cos(experiment.direction), np.sin(experiment.direction)])
    pose = record["pose"][:, :2]
    elastic = record["flexibility"][first][:2, :2] @ direction * (record["load"][first] - record["load"][first - 1])
    apart = pose[first] - pose[first - 1] - elastic
    return float(np.linalg.norm(apart) / np.linalg.norm(pose[bending[-1]] - pose[first - 1]))


def states_table(curves: HingeCurves) -> dict[str, Any]:
    """Table of the closed hinge at every fitted pinch angle, and of the open one."""
    header = ["alpha [deg]", "share of pinch", "travel [mm]", "F_p [N]", "axis [deg]", "soft [N*m/rad]",
              "stiff [N*m/rad]", "torsion [N*m/rad]", "hinge at [mm]", "soft beyond a knee [%]"]  # fmt: skip
    rows = []
    for number, table in enumerate(curves.tables):
        for share in (0.0, TOUCH / 2, 1.0) if number == 0 else (TOUCH / 2, 1.0):
            state = curves.state(table.pinch_angle, share)
            p = state.parameters
            cells = (
                np.rad2deg(table.pinch_angle), share, 1e3 * state.travel, state.force, np.rad2deg(p["axis"]),
                p["k_soft"], p["k_stiff"], p["k_torsion"], 1e3 * p["place"], 100 * p["beyond_soft"],
            )  # fmt: skip
            rows.append([f"{cell:.4g}" for cell in cells])
    return {"title": "the hinge", "header": header, "rows": rows, "notes": []}


def scores_table(scores: Sequence[Mapping[str, Any]], notes: Sequence[str]) -> dict[str, Any]:
    """Table of what ``score_of`` found for every record."""
    header = ["record", "use", "error [%]", "misfits", "axes off [deg]", "note"]
    rows = []
    for target in scores:
        misfits = "; ".join(f"{n} {v:+.1%}" for n, v in target["entries"].items() if np.isfinite(v))
        axes = "; ".join(f"{n} {np.rad2deg(v):+.1f}" for n, v in target["axes"].items() if np.isfinite(v))
        error = target["error"]
        shown = "-" if error is None or not np.isfinite(error) else f"{100 * error:.3g}"
        rows.append([target["name"], target["use"], shown, misfits, axes, target["note"]])
    about = "Error of a bending: rms distance of the block's face over its motion; of a pinch: rms of the misfits."
    return {"title": "records", "header": header, "rows": rows, "notes": [*notes, about]}
