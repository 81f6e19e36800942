"""Pictures of tubes with fins: which figures and scenes an experiment with them gets."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from lab.experiments.fin_drive import FIN_STAGES
from lab.records import Record
from pipeline.stages.picking import few, file_word, readable
from results import scenes
from results.accuracy import Entry
from results.figures import fin_designs, fin_pressure, fin_pushes, fin_travel, strokes, thrust, thrust_maps
from results.figures.pinched import sample_name
from results.fin_states import fin_states
from results.fin_tables import FIN_EXPERIMENTS, angle_series
from results.paddle_tables import FREQUENCY, LENGTH, SWEPT, singled_out
from results.paddling import standing_for
from results.report import Picture
from results.store import read_record
from results.swept_series import SweptSeries, swept_series

#: Columns of scenes, and lengths of the load fin that make no map yet.
_PANELS, _FAMILY = 4, 3

Scenes = Iterator[tuple[scenes.Scene, Picture]]


def figures_of_fins(name: str, found: Sequence[Entry], folder: Path) -> Iterator[Picture]:
    """Figures of one campaign of tubes with fins.

    Parameters
    ----------
    found
        Its records, without a result too: a pinch that diverged shows how far it came.
    """
    told = [entry for entry in found if {"travel", "p", "fin_angle"} <= set(entry.record.channels)]
    shapes = [entry for entry in told if entry.experiment.kind == "ShapePropagation"]
    pinched, inflated = ([e for e in shapes if _drive(e) == drive] for drive in ("pinch", "pressure"))
    if pinched:
        path = fin_travel.travel_curves(
            readable(pinched), f"{name}: what the fins do along the pinch", folder / f"{name}_travel.png"
        )
        yield Picture(path, f"{name}: travel s and y of P, turn of the fin and force over the pinch", name)
    if inflated:
        path = fin_pressure.pressure_curves(
            readable(inflated), f"{name}: how far air flattens the tube", folder / f"{name}_pressure.png"
        )
        yield Picture(path, f"{name}: flattening, and travel s of P, over the pressure in the chambers", name)
    groups = fin_states(found)
    whole, variants = ([one for one in groups if one.is_variant == kind] for kind in (False, True))
    for one in whole:
        path = folder / f"{name}_{file_word(one.title)}_pushes.png"
        yield Picture(
            fin_pushes.push_curves([one], f"{name}, {one.title}", path),
            f"{name}, {one.title}: force of the plate against its way, in both senses", name,
            folded=one is not whole[0],
        )  # fmt: skip
    if variants:
        path = fin_pushes.push_curves(variants, f"{name}: designs and rigs", folder / f"{name}_variants_pushes.png")
        yield Picture(path, f"{name}: force of the plate against its way, in both senses, by design and rig", name)
    if any(len(one.states) > 1 for one in whole):
        path = fin_pushes.limit_loads(whole, f"{name}: limit loads and stiffness", folder / f"{name}_limits.png")
        yield Picture(path, f"{name}: largest forces and initial stiffness over the flattening, beside the lab's", name)


def joint_fin_figures(found: Sequence[Entry], folder: Path) -> Iterator[Picture]:
    """Figures across campaigns: both angles, thrust over time, and mean thrust over whatever is swept."""
    if series := angle_series([e for e in found if e.experiment.kind == "ShapePropagation" and _drive(e) == "pinch"]):
        name = series[0].points[-1].entry.campaign
        path = fin_designs.designs_over(series, "travel s and y of P over both angles", folder / f"{name}_designs.png")
        yield Picture(path, "s and y at the full pinch over the fin's arc and its attachment angle", name)
    paddled = [e for e in found if e.experiment.kind == "PaddleThrust" and e.record.completed]
    held = [entry for case in (False, True) for entry in standing_for(paddled, "fixed", case)]
    if held:
        name = held[0].campaign
        path = thrust.thrust_over_time(held, "thrust at 1 Hz and 60 psi, body held", folder / f"{name}_thrust.png")
        yield Picture(path, "thrust over time without and with load fin, beside the peaks of the lab", name)
        if jointed := [entry for entry in held if strokes.has_links(entry)]:
            path = strokes.stroke_shapes(jointed, "where the fins go, body held", folder / f"{name}_strokes.png")
            yield Picture(path, "fins over a cycle: power stroke to the right, recovery to the left", name)
    yield from _swept([e for e in found if e.experiment.kind == "PaddleThrust"], folder)


def _swept(paddled: Sequence[Entry], folder: Path) -> Iterator[Picture]:
    lines: list[SweptSeries] = []
    for path_of in SWEPT:
        families: dict[str, list[SweptSeries]] = {}
        for one in swept_series(paddled, path_of):
            families.setdefault(one.performer, []).append(one)
        for family in families.values():
            lines += singled_out(family)
            loaded = [one for one in family if one.bench.fields.get(LENGTH) is not None]
            if path_of == FREQUENCY and len(loaded) > _FAMILY:
                yield _map(loaded, folder)
    if lines:
        name = lines[0].points[0].entry.campaign
        path = thrust_maps.mean_thrust(lines, "mean thrust over what is swept", folder / f"{name}_mean_thrust.png")
        yield Picture(path, "mean thrust over frequency and load fin, and where it changes sign", name)


def _map(family: Sequence[SweptSeries], folder: Path) -> Picture:
    name, performer = family[0].points[0].entry.campaign, family[0].performer
    path = folder / f"{name}_{performer}_map.png"
    thrust_maps.thrust_map(family, LENGTH, f"{name}, {performer}: mean thrust", path)
    return Picture(path, f"{name}, {performer}: mean thrust over frequency and length of the load fin", name)


def scenes_of_fins(name: str, inside: Sequence[Entry], root: Path, folder: Path) -> Scenes:
    """3D pictures of one performer's records of a campaign: at rest and at the end, from the side and along y.

    Parameters
    ----------
    inside
        Records with fields in their files.
    root
        Folder that the entries' paths start from.
    """
    kind = inside[0].experiment.kind
    if kind not in FIN_EXPERIMENTS or kind == "PaddleThrust":
        return
    records = {entry.path: read_record(root / entry.path) for entry in few(inside, _PANELS)}
    shown = [entry for entry in inside if entry.path in records and records[entry.path].fields is not None]
    if not shown:
        return
    ends = [(entry, _end(records[entry.path])) for entry in shown]
    panels = [_panel(root, e, records[e.path], 0, "at rest") for e in shown] if kind == "ShapePropagation" else []
    for along_y in (False, True):
        panels += [_panel(root, e, records[e.path], state, "", along_y) for e, state in ends]
    words = (
        "at rest, at the full pinch, and that seen along y" if panels[0]["state"] == 0 else "under the largest force"
    )
    picture = Picture(folder / f"{name}_fins.png", f"{name}: {words}; red: P; grey lines: at rest", name)
    yield {"output": str(picture.file), "colour": "", "panels": panels, "columns": len(shown)}, picture


def _end(record: Record) -> int:
    """The stored state that tells most: that of the plate's largest force, else the last."""
    assert record.fields is not None
    rows = record.fields.values.round().astype(int)
    if "stage" in record.channels:
        pushed = record["stage"][rows] == FIN_STAGES.index("push")
        if pushed.any():
            return int(np.argmax(np.where(pushed, record["force"][rows], -np.inf)))
    return len(rows) - 1


def _panel(root: Path, entry: Entry, record: Record, state: int, words: str, along_y: bool = False) -> scenes.Panel:
    assert record.fields is not None
    row = int(round(record.fields.values[state]))
    reached = f"pinched by {1e3 * max(record['travel'][row], 0.0) + 0.0:.3g} mm"
    if "stage" in record.channels:
        reached += f", {record['force'][row]:.3g} N"
    about = sample_name(entry.slug).replace("\u03b1", "alpha").replace("\u03b8", "theta").replace("\u00b0", " deg")
    caption = "" if along_y else f"{about}\n{words or reached}"
    return {"file": str(root / entry.path), "state": state, "caption": caption, "cut": along_y}


def _drive(entry: Entry) -> str:
    experiment: Any = entry.experiment
    return str(experiment.drive)
