"""Stage ``pictures``: figures always, 3D scenes where rendering works."""

import json
from pathlib import Path

import numpy as np

from pipeline.plan import Plan
from pipeline.stages.compare import groups_of
from pipeline.stages.gather import entries, fit_results
from results import figures, scenes
from results.accuracy import Entry
from results.store import write_text


def pictures(plan: Plan) -> str:
    """Draw everything and write ``pictures/index.json``; return a line about it."""
    folder = plan.folder / "pictures"
    found = entries(plan)
    wanted = _scenes(plan, found, folder)
    drawing = scenes.Drawing([scene for scene, _ in wanted])
    drawn = _figures(plan, found, folder)
    files, reason = drawing.wait()
    drawn += [(Path(scene["output"]), caption) for scene, caption in wanted if Path(scene["output"]) in files]
    index = {"files": [{"file": path.name, "caption": caption} for path, caption in drawn], "left_out": reason}
    write_text(folder / "index.json", json.dumps(index, indent=1) + "\n")
    return f"{len(drawn)} pictures; left out: {reason or 'none'}"


def _figures(plan: Plan, found: list[Entry], folder: Path) -> list[tuple[Path, str]]:
    drawn = []
    for comparison, (title, rows) in zip(plan.study.comparisons, groups_of(plan, found), strict=False):
        if rows and comparison.reference in plan.study.lab:
            path = figures.stiffness_bars(rows, title, folder / f"{comparison.campaign}_bars.png")
            drawn.append((path, f"{title}: main entries of K'"))
    for name in plan.study.campaigns:
        inside = [e for e in found if e.campaign == name and e.record.completed]
        kind = inside[0].experiment.kind if inside else ""
        if kind == "RingDown":
            path = figures.ring_down_overlay(
                inside, f"{name}: mean marker displacement", folder / f"{name}_overlay.png"
            )
            drawn.append((path, f"{name}: free decay after the load is cut; dashed lines are PRB models"))
        if kind == "BaseShake":
            path = figures.orbits(inside, f"{name}: path of the tip over a period", folder / f"{name}_orbits.png")
            drawn.append(
                (path, f"{name}: path of the tip relative to the clamp, dots at the clamp's middle going up z")
            )
        if kind == "StaticStiffness":
            for performer in dict.fromkeys(e.performer for e in inside):
                mine = [e for e in inside if e.performer == performer]
                path = figures.force_curves(mine, f"{name}, {performer}", folder / f"{name}_{performer}_curves.png")
                drawn.append(
                    (path, f"{name}, {performer}: reaction against motion; the tip is held in all other directions")
                )
    histories = {name: fit for name, fit in fit_results(plan).items() if fit.get("history")}
    if histories:
        drawn.append((figures.fit_histories(histories, folder / "fit_histories.png"), "fits: objective per generation"))
    for name, fit in fit_results(plan).items():
        if fit.get("profiles"):
            path = figures.fit_profiles(name, fit, folder / f"fit_{name}.png")
            drawn.append((path, f"fit {name}: profile likelihoods and correlations of the parameters"))
        if fit.get("sampled"):
            path = figures.parameter_curves(name, fit, folder / f"fit_{name}.png")
            drawn.append((path, f"fit {name}: parameters over the designs"))
        if fit.get("spreads"):
            path = figures.model_spread(name, fit, folder / f"fit_{name}.png")
            drawn.append((path, f"fit {name}: how the models differ, beside what each claims to know"))
    return drawn


def _scenes(plan: Plan, found: list[Entry], folder: Path) -> list[tuple[scenes.Scene, str]]:
    wanted = []
    for name in plan.study.campaigns:
        inside = [e for e in found if e.campaign == name and e.record.completed and e.path.startswith("fea/")]
        if not inside or inside[0].experiment.kind == "BaseShake":
            continue
        if inside[0].experiment.kind == "StaticStiffness":
            first = [e for e in inside if e.performer == inside[0].performer][:8]
            mesh = [_panel(plan, e, 0, e.slug) for e in first]
            wanted.append((_scene(folder / f"{name}_meshes.png", "", mesh, 4), f"{name}: meshes, {first[0].performer}"))
            legs = ((1, "y +"), (3, "z +"), (5, "x rotation +"))
            bent = [_panel(plan, e, state, f"{e.slug}\n{leg}") for e in first[:5] for state, leg in legs]
            scene = _scene(folder / f"{name}_deformed.png", "strain_energy_density", bent, 3)
            wanted.append((scene, f"{name}: deformed at the end of three legs, {first[0].performer}; grey: at rest"))
        else:
            bent = [_panel(plan, e, 0, f"{e.performer}\n{e.slug}") for e in inside]
            scene = _scene(folder / f"{name}_release.png", "strain_energy_density", bent, len({e.slug for e in inside}))
            wanted.append((scene, f"{name}: beam under the load, at the release"))
    return wanted


def _panel(plan: Plan, entry: Entry, state: int, caption: str) -> scenes.Panel:
    return {"file": str(plan.folder / entry.path), "state": state, "caption": caption.replace("_", " ")}


def _scene(output: Path, colour: str, panels: list[scenes.Panel], columns: int) -> scenes.Scene:
    return {
        "output": str(output),
        "colour": colour,
        "panels": panels,
        "columns": int(np.clip(columns, 1, 4)),
    }
