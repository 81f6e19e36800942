"""How learned curves of a fin follow records, and tables of both and of the published speeds."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from calibrate.fin_data import FinDatum, lever_of, turns, widths
from calibrate.paddler_targets import CASES, devices, published
from lab.experiments import ShapePropagation
from lab.published import figures
from lab.specimens import FinnedTube
from prb.fin_curves import FinCurves, two_term
from prb.plate_law import plate_load, speed_needed


def score_of(curves: FinCurves, item: FinDatum, hinge_share: float) -> dict[str, Any]:
    """Rms misfit of a record: of the fin's angle over its turn, of the plate's force over its largest value."""
    score: dict[str, Any] = {
        "name": item.label, "use": "in sample" if item.used else "held out", "error": None, "rms": None, "entries": {},
        "nuisances": {}, "note": "",
    }  # fmt: skip
    e, record = item.experiment, item.record
    if isinstance(e, ShapePropagation):
        if curves.turn is None:
            score["note"] = "no record gave the fin's turn"
            return score
        theirs = record["fin_angle"]
        ours = np.polynomial.polynomial.polyval(widths(record), curves.turn)
        size = float(np.ptp(theirs))
    else:
        learned = getattr(curves, e.sense)
        if learned is None:
            score["note"] = f"no record gave the spring in the {e.sense} sense"
            return score
        turn, theirs = turns(record, lever_of(item.specimen, e, hinge_share))
        s = curves.flattening(float(record["travel"][-1]))
        k, limit = (float(two_term(four, np.array(s))) for four in (learned.stiffness, learned.limit))
        knee = limit / k
        ours = k * np.minimum(turn, knee) + learned.beyond * k * np.maximum(turn - knee, 0.0)
        size = float(np.abs(theirs).max())
        score["entries"] = {"largest moment": float(ours.max() / theirs.max() - 1.0)}
    score["rms"] = float(np.sqrt(np.mean((ours - theirs) ** 2)))
    score["error"] = score["rms"] / max(size, 1e-12)
    return score


def fin_table(curves: FinCurves, scores: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Table of the spring in both senses at five states of flattening, with the errors of the curves."""
    header = [
        "flattening",
        "fin angle [deg]",
        "K opposite [N*m/rad]",
        "limit [N*m]",
        "K equal [N*m/rad]",
        "limit [N*m]",
    ]
    rows = []
    for s in np.linspace(0.0, 1.0, 5):
        cells = [float(s)]
        cells.append(
            float("nan") if curves.turn is None
            else float(np.rad2deg(np.polynomial.polynomial.polyval(s * curves.widening, curves.turn)))
        )  # fmt: skip
        for sense in (curves.opposite, curves.equal):
            for name in ("stiffness", "limit"):
                cells.append(float(two_term(getattr(sense, name), np.array(s))) if sense else float("nan"))
        rows.append([f"{cell:.4g}" for cell in cells])
    notes = [f"misfit of the curve {name}: {value:.1%}" for name, value in curves.errors.items()]
    notes += [f"{s['name']} ({s['use']}): {s['error']:.1%}" for s in scores if s["error"] is not None]
    return {"title": "the fin", "header": header, "rows": rows, "notes": notes}


def speeds_table(specimen: FinnedTube) -> dict[str, Any]:
    """What eq. 4.3 makes of the tip speeds that the text reports, and which speeds its thrust would need."""
    header = ["case", "stroke", "tip speed [mm/s]", "eq. 4.3 gives [N]", "thrust [N]", "ratio", "speed needed [mm/s]"]
    rows = []
    speeds = (("c4-u-tpe-power", "c4-u-tpe-recovery"), ("c4-u-loadfin-power", "c4-u-loadfin-recovery"))
    for case, device, numbers, ids in zip(CASES, devices(specimen), published("lab"), speeds, strict=True):
        area = plates_area(device)
        for stroke, id, name in zip(("power", "recovery"), ids, ("thrust_max", "thrust_min"), strict=True):
            speed, thrust = float(figures()[id]["value"]), abs(numbers[name].value)
            push = 2.0 * float(-plate_load(np.array([speed]), np.array([1.0]), area)[0])
            rows.append([
                case, stroke, f"{1e3 * speed:.4g}", f"{push:.2g}", f"{thrust:g}", f"{thrust / push:.0f}",
                f"{1e3 * speed_needed(thrust / 2.0, area):.0f}",
            ])  # fmt: skip
    note = (
        "both fins, their whole area moving square to the water at the tip's speed: the most that the law allows; "
        "speeds needed are of the whole area, so those of the tip are larger"
    )
    return {"title": "published speeds and the plate law", "header": header, "rows": rows, "notes": [note]}


def plates_area(specimen: FinnedTube) -> float:
    """Area of one fin's chord, with its load fin, m^2."""
    fin = 2.0 * specimen.mid_radius * np.sin(specimen.fin_arc / 2) * specimen.fin_length
    load = specimen.load_fin
    return float(fin + (load.length * load.width if load else 0.0))
