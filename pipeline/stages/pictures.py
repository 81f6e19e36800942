"""Stage ``pictures``: figures always, 3D scenes where rendering works."""

import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path

from pipeline.plan import Plan
from pipeline.stages.compare import groups_of
from pipeline.stages.fin_pictures import figures_of_fins, joint_fin_figures, scenes_of_fins
from pipeline.stages.gather import entries, fit_results
from pipeline.stages.picking import few, file_word
from pipeline.stages.tube_pictures import figures_of_tubes, joint_figures, scenes_of_tubes
from results import scenes
from results.accuracy import Entry
from results.figures import axes, fits, grid, modes, motions, reversals, senses, stiffness
from results.orbit_series import Series, orbit_series
from results.report import Picture
from results.store import write_text

#: Samples of a campaign that figures with a line or a column for each can show.
_FEW = 8
#: Twists from which on a campaign is a sweep over the twist.
_SWEEP = 4
#: Orbits that the grid shows in one row: no curve is drawn through so few.
_ROW = 5
#: Experiments with pinched tubes.
_TUBES = ("Pinch", "PinchedBending", "ShapeRecovery")
#: Experiments with tubes with fins.
_FINS = ("ShapePropagation", "FinPush", "PaddleThrust")
#: Heading of the fits' pictures.
_FITS = "fits"


def pictures(plan: Plan) -> str:
    """Draw everything and write ``pictures/index.json``; return a line about it."""
    folder = plan.folder / "pictures"
    found = entries(plan)
    wanted = list(_scenes(plan, found, folder))
    drawing = scenes.Drawing([scene for scene, _ in wanted])
    drawn = list(_figures(plan, found, folder))
    files, reason = drawing.wait(max(300.0, 3.0 * sum(len(scene["panels"]) for scene, _ in wanted)))
    drawn += [picture for _, picture in wanted if picture.file in files]
    order = [*plan.study.campaigns, _FITS]
    drawn.sort(key=lambda picture: order.index(picture.group))
    index = {"files": [{**asdict(picture), "file": picture.file.name} for picture in drawn], "left_out": reason}
    write_text(folder / "index.json", json.dumps(index, indent=1) + "\n")
    return f"{len(drawn)} pictures; left out: {reason or 'none'}"


def _figures(plan: Plan, found: list[Entry], folder: Path) -> Iterator[Picture]:
    measured = {c.campaign for c in plan.study.comparisons if c.reference in plan.study.lab}
    groups = groups_of(plan, [e for e in found if e.campaign in measured])
    for comparison, (title, rows) in zip(plan.study.comparisons, groups, strict=False):
        if rows and comparison.reference in plan.study.lab:
            path = stiffness.stiffness_bars(rows, title, folder / f"{comparison.campaign}_bars.png")
            yield Picture(path, f"{title}: main entries of K'", comparison.campaign)
    for name in plan.study.campaigns:
        inside = [e for e in found if e.campaign == name and e.record.completed]
        # Of tubes, those that diverged show how far they came.
        known = inside or [e for e in found if e.campaign == name and e.experiment.kind in (*_TUBES, *_FINS)]
        kind = known[0].experiment.kind if known else ""
        if kind == "RingDown":
            path = motions.ring_down_overlay(
                few(inside, _FEW), f"{name}: mean marker displacement", folder / f"{name}_overlay.png"
            )
            yield Picture(path, f"{name}: free decay after the load is cut; dashed lines are PRB models", name)
        elif kind == "BaseShake":
            yield from _of_orbits(plan, name, orbit_series([e for e in found if e.campaign == name]), folder)
        elif kind == "NaturalModes" and _twists(inside) >= _SWEEP:
            path = modes.modes_over_twist(
                inside, f"{name}: natural frequencies over the twist", folder / f"{name}_modes.png"
            )
            yield Picture(path, f"{name}: natural frequencies over the twist; hollow markers are PRB models", name)
        elif kind == "StaticStiffness":
            yield from _of_stiffness(plan, name, [e for e in found if e.campaign == name], folder)
        elif kind in _TUBES:
            yield from figures_of_tubes(name, [e for e in found if e.campaign == name], folder)
        elif kind in _FINS:
            yield from figures_of_fins(name, [e for e in found if e.campaign == name], folder)
    yield from joint_figures(found, folder)
    yield from joint_fin_figures(found, folder)
    yield from _of_fits(plan, folder)


def _of_stiffness(plan: Plan, name: str, found: list[Entry], folder: Path) -> Iterator[Picture]:
    inside = [entry for entry in found if entry.record.completed]
    if _twists(inside) >= _SWEEP:
        path = stiffness.stiffness_over_twist(
            found, _measured(plan, name), f"{name}: main entries of K' over the twist", folder / f"{name}_twist.png"
        )
        yield Picture(path, f"{name}: main entries of K' over the twist, and what was measured where it is known", name)
    performers = list(dict.fromkeys(entry.performer for entry in inside))
    for performer in performers:
        mine = few([entry for entry in inside if entry.performer == performer], _FEW)
        path = stiffness.force_curves(mine, f"{name}, {performer}", folder / f"{name}_{performer}_curves.png")
        caption = f"{name}, {performer}: reaction against motion; the tip is held in all other directions"
        yield Picture(path, caption, name, folded=len(performers) > 1)


def _measured(plan: Plan, campaign: str) -> list[stiffness.Measured]:
    """Rows of the lab tables that a campaign is compared with, where the study reads them."""
    rows = []
    for comparison in plan.study.comparisons:
        if comparison.campaign == campaign and comparison.reference in plan.study.lab:
            reading = plan.study.lab[comparison.reference].reading
            for phi, values in plan.lab_table(comparison.reference).rows.items():
                twist, root_angle = (math.radians(angle) for angle in reading.specimen_angles(phi))
                rows.append(stiffness.Measured(comparison.reference, phi, twist, root_angle, values))
    return rows


def _of_orbits(plan: Plan, name: str, series: Sequence[Series], folder: Path) -> Iterator[Picture]:
    reference = next(
        (c.reference for c in plan.study.comparisons if c.campaign == name and c.reference in plan.study.performers),
        None,
    )
    swept = [one for one in series if len(one.values) > 1]
    alone = [one for one in series if len(one.values) == 1]
    for number in dict.fromkeys(one.swept for one in swept):
        group = [one for one in swept if one.swept == number]
        if len(group) > 1:
            path = senses.sense_maps(group, folder / f"{name}_senses_{file_word(group[0].name)}.png")
            yield Picture(path, f"{name}: sense of travel and where it reverses, over the {group[0].name}", name)
    if families := reversals.loads_of(swept):
        path = reversals.reversals_over_load(name, families, folder / f"{name}_reversals.png")
        yield Picture(path, f"{name}: how the reversals move with the load", name)
    for one in swept:
        stem = f"{name}_{{}}_{file_word(one.label)}.png"
        if len(grid.family_of(one)) > 1:
            path = grid.twist_family(one, reference, folder / stem.format("family"))
            yield Picture(path, f"{one.title}: path of the tip over the twist, on one scale", name)
        if len(one.values) > _ROW:
            path = axes.orbit_axes(one, reference, folder / stem.format("axes"))
            yield Picture(path, f"{one.title}: axes and sense of the tip's orbit over the {one.name}", name)
        path = grid.orbit_grid(one, reference, folder / stem.format("orbits"))
        yield Picture(path, f"{one.title}: path of the tip, every {one.name}", name, folded=len(swept) > 2)
    if alone:
        path = grid.orbit_gallery(alone, folder / f"{name}_orbits.png")
        yield Picture(path, f"{name}: path of the tip", name)


def _of_fits(plan: Plan, folder: Path) -> Iterator[Picture]:
    results = fit_results(plan)
    histories = {name: fit for name, fit in results.items() if fit.get("history")}
    if histories:
        path = fits.fit_histories(histories, folder / "fit_histories.png")
        yield Picture(path, "fits: objective per generation", _FITS)
    for name, fit in results.items():
        path = folder / f"fit_{name}.png"
        if fit.get("profiles"):
            caption = f"fit {name}: profile likelihoods and correlations of the parameters"
            yield Picture(fits.fit_profiles(name, fit, path), caption, _FITS)
        if fit.get("sampled"):
            yield Picture(fits.parameter_curves(name, fit, path), f"fit {name}: parameters over the designs", _FITS)
        if fit.get("spreads"):
            caption = f"fit {name}: how the models differ, beside what each claims to know"
            yield Picture(fits.model_spread(name, fit, path), caption, _FITS)


def _scenes(plan: Plan, found: list[Entry], folder: Path) -> Iterator[tuple[scenes.Scene, Picture]]:
    for name in plan.study.campaigns:
        inside = [e for e in found if e.campaign == name and e.record.completed and e.path.startswith("fea/")]
        kind = inside[0].experiment.kind if inside else ""
        if kind == "StaticStiffness":
            yield from _scenes_of_stiffness(plan, [e for e in inside if e.performer == inside[0].performer], folder)
        elif kind == "RingDown":
            shown = few(inside, _FEW)
            panels = [_panel(plan, e, 0, f"{e.performer}\n{e.slug}") for e in shown]
            caption = f"{name}: beam under the load, at the release"
            picture = Picture(folder / f"{name}_release.png", caption, name)
            yield _scene(picture, "strain_energy_density", panels, min(4, len({e.slug for e in shown}))), picture
        elif kind == "NaturalModes":
            yield _scene_of_modes(plan, [e for e in inside if e.performer == inside[0].performer], folder)
        elif kind in _TUBES:
            mine = [e for e in inside if e.performer == inside[0].performer]
            yield from scenes_of_tubes(name, mine, plan.folder, folder)
        elif kind in _FINS:
            mine = [e for e in inside if e.performer == inside[0].performer]
            yield from scenes_of_fins(name, mine, plan.folder, folder)


def _scenes_of_stiffness(plan: Plan, inside: list[Entry], folder: Path) -> Iterator[tuple[scenes.Scene, Picture]]:
    name, performer = inside[0].campaign, inside[0].performer
    picture = Picture(folder / f"{name}_meshes.png", f"{name}: meshes, {performer}", name)
    yield _scene(picture, "", [_panel(plan, e, 0, e.slug) for e in few(inside, _FEW)], 4), picture
    legs = ((1, "y +"), (3, "z +"), (5, "x rotation +"))
    bent = [_panel(plan, e, state, f"{e.slug}\n{leg}") for e in few(inside, 5) for state, leg in legs]
    caption = f"{name}: deformed at the end of three legs, {performer}; grey: at rest"
    picture = Picture(folder / f"{name}_deformed.png", caption, name)
    yield _scene(picture, "strain_energy_density", bent, len(legs)), picture


def _scene_of_modes(plan: Plan, inside: list[Entry], folder: Path) -> tuple[scenes.Scene, Picture]:
    """Shapes of all modes, one row per design, of the least, a middle and the largest twist to the right."""
    name, performer = inside[0].campaign, inside[0].performer
    right = sorted((e for e in inside if e.record.specimen["twist"] >= 0.0), key=lambda e: e.record.specimen["twist"])
    shown = few(right or inside, 3)
    columns = min(len(e.record["frequency"]) for e in shown)
    panels = [
        _panel(plan, entry, mode, f"{entry.slug}\nmode {mode + 1}: {entry.record['frequency'][mode]:.4g} Hz")
        for entry in shown
        for mode in range(columns)
    ]
    caption = f"{name}: mode shapes, {performer}; colour: size of the displacement, grey: at rest"
    picture = Picture(folder / f"{name}_shapes.png", caption, name)
    return _scene(picture, scenes.DISPLACEMENT, panels, columns), picture


def _panel(plan: Plan, entry: Entry, state: int, caption: str) -> scenes.Panel:
    return {"file": str(plan.folder / entry.path), "state": state, "caption": caption.replace("_", " ")}


def _scene(picture: Picture, colour: str, panels: list[scenes.Panel], columns: int) -> scenes.Scene:
    return {"output": str(picture.file), "colour": colour, "panels": panels, "columns": columns}


def _twists(entries: list[Entry]) -> int:
    return len({entry.record.specimen["twist"] for entry in entries})
