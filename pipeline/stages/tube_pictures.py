"""Pictures of pinched tubes: which figures and scenes an experiment with them gets."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from lab.experiments import PinchedBending
from lab.experiments.pinch_drive import STAGES
from lab.records import Record
from pipeline.stages.picking import LINES, few, file_word, readable
from results import scenes, sensitivity
from results.accuracy import Entry
from results.figures import closing, drops, hinge_axes, hinge_stiffness, pushes, recovery, sections, sensitivities
from results.figures.pinched import during, sample_name
from results.pinch_series import PinchSeries, pinch_series
from results.report import Picture
from results.store import read_record

#: Tiles of sections, and columns of scenes.
_TILES, _PANELS = 12, 6

Scenes = Iterator[tuple[scenes.Scene, Picture]]


def figures_of_tubes(name: str, found: Sequence[Entry], folder: Path) -> Iterator[Picture]:
    """Figures of one campaign of pinched tubes, those of a whole turn of the pinch angle excepted.

    Parameters
    ----------
    found
        Its records, without a result too: a pinch that diverged shows how far it came.
    """
    told = [entry for entry in found if _told(entry)]
    kind = found[0].experiment.kind if found else ""
    if told and kind == "Pinch":
        yield from _of_pinch(name, told, folder)
    elif told and kind == "PinchedBending":
        yield from _of_bending(name, told, folder)
    elif seen := [entry for entry in told if kind == "ShapeRecovery" and "section" in entry.record.channels]:
        path = recovery.recovery_story(
            readable(seen), f"{name}: does the tube come back?", folder / f"{name}_recovery.png"
        )
        yield Picture(path, f"{name}: flattening of the loaded tube from pinch to recovery", name)


def joint_figures(found: Sequence[Entry], folder: Path) -> Iterator[Picture]:
    """Figures across campaigns: whole turns of the pinch angle, push tests, and what follows from each assumption."""
    yield from _turns(found, folder)
    pushes_alone = [entry for entry in found if _is_push(entry) and len(_slugs(found, entry.campaign)) == 1]
    shown = [replace(entry, slug=entry.campaign) for entry in pushes_alone if _told(entry)]
    if shown:
        name = shown[0].campaign
        path = pushes.bending_curves(readable(shown), "push tests", folder / f"{name}_pushes.png")
        yield Picture(path, "push tests: load against motion, open and pinched, beside the measured slopes", name)
    if groups := sensitivities.by_result(sensitivity.sensitivities(found)):
        name = next(iter(groups.values()))[0].entry.campaign
        path = sensitivities.one_at_a_time(groups, folder / f"{name}_assumptions.png")
        yield Picture(path, "what follows from each assumption, one at a time, beside what was measured", name)


def _turns(found: Sequence[Entry], folder: Path) -> Iterator[Picture]:
    families: dict[str, list[PinchSeries]] = {}
    for one in pinch_series(found):
        if len(one.points) > 1 and one.designs:
            families.setdefault(one.label, []).append(one)
    for label, series in families.items():
        name = series[0].points[-1].entry.campaign
        path = hinge_axes.axes_over_turn(series, label, folder / f"{name}_turn_{file_word(label)}.png")
        yield Picture(
            path, f"{label}: hinge axis and closing force over the pinch angle, beside first-order theory", name
        )


def _told(entry: Entry) -> bool:
    """Whether a performer came to anything that can be drawn."""
    return {"stage", "force", "travel"} <= set(entry.record.channels)


def _is_push(entry: Entry) -> bool:
    return isinstance(entry.experiment, PinchedBending) and entry.experiment.push is not None


def _slugs(found: Sequence[Entry], campaign: str) -> set[str]:
    return {entry.slug for entry in found if entry.campaign == campaign}


def _of_pinch(name: str, told: Sequence[Entry], folder: Path) -> Iterator[Picture]:
    path = closing.closing_curves(readable(told), f"{name}: what it takes to close", folder / f"{name}_closing.png")
    yield Picture(path, f"{name}: pinching force against deformation", name)
    bent = [entry for entry in told if "flexibility" in entry.record.channels]
    if bent:
        path = folder / f"{name}_hinge.png"
        hinge_stiffness.stiffness_over_travel(readable(bent), f"{name}: how the hinge comes up", path)
        yield Picture(path, f"{name}: bending stiffness about and across the hinge along the pinch", name)
    # Of a PRB model, the section is a figure of speech.
    seen = [entry for entry in told if "section" in entry.record.channels and entry.record.origin != "prb"]
    for performer in (performers := list(dict.fromkeys(entry.performer for entry in seen))):
        mine = few([entry for entry in seen if entry.performer == performer], _TILES)
        path = folder / f"{name}_{performer}_sections.png"
        yield Picture(
            sections.pinch_sections(mine, f"{name}, {performer}", path),
            f"{name}, {performer}: section at mid-length on the way to the closed tube", name,
            folded=performer != performers[0],
        )  # fmt: skip


def _of_bending(name: str, told: Sequence[Entry], folder: Path) -> Iterator[Picture]:
    bent = [entry for entry in told if len(during(entry.record, "bend"))]
    # A push test of a single sample stands beside the others, in a figure of its own.
    if bent and not (_is_push(bent[0]) and len(_slugs(told, name)) == 1):
        path = folder / f"{name}_bending.png"
        pushes.bending_curves(readable(bent), f"{name}: load against motion", path)
        caption = f"{name}: load against motion of its point, open and pinched"
        yield Picture(path, caption, name, folded=len(_slugs(told, name)) > LINES)
    for number, moved in enumerate(_by_load(told)):
        path = folder / f"{name}_block{number or ''}.png"
        drops.block_paths(few(moved, _PANELS), f"{name}: where the load takes the distal block", path)
        yield Picture(path, f"{name}: path and displacement of the distal block over the pinch angle", name)


def _by_load(told: Sequence[Entry]) -> list[list[Entry]]:
    """Completed bendings of pinched tubes that differ in the pinch angle only, where they do."""
    groups: dict[str, list[Entry]] = {}
    for entry in told:
        if isinstance(entry.experiment, PinchedBending) and entry.experiment.pinched and entry.record.completed:
            key = entry.experiment.model_copy(update={"pinch_angle": 0.0}).model_dump_json() + entry.specimen
            groups.setdefault(key, []).append(entry)
    return [group for group in groups.values() if len({entry.slug for entry in group}) > 2]


def scenes_of_tubes(name: str, inside: Sequence[Entry], root: Path, folder: Path) -> Scenes:
    """3D pictures of one performer's records of a campaign: the tubes at the end, and on the way there.

    Parameters
    ----------
    inside
        Records with fields in their files.
    root
        Folder that the entries' paths start from.
    """
    kind = inside[0].experiment.kind
    shown = [e for e in inside if not isinstance(e.experiment, PinchedBending) or e.experiment.pinched]
    if not shown:
        return
    shown = few(shown, _PANELS)
    ends = [(entry, *_end(read_record(root / entry.path))) for entry in shown]
    panels = [_panel(root, entry, state, words, cut) for cut in (False, True) for entry, state, words in ends]
    picture = Picture(folder / f"{name}_tubes.png", f"{name}: {_ENDS[kind]}; below: cut at mid-length", name)
    yield _scene(picture, panels, len(ends)), picture
    for entry in few(shown, 2) if kind != "PinchedBending" else []:
        record = read_record(root / entry.path)
        states = [(state, _words(record, state)) for state in _states(record)]
        panels = [_panel(root, entry, state, words, cut) for cut in (False, True) for state, words in states]
        caption = f"{name}, {sample_name(entry.slug)}: on the way; below: cut at mid-length"
        picture = Picture(folder / f"{name}_way_{file_word(entry.slug)}.png", caption, name, folded=True)
        yield _scene(picture, panels, len(states)), picture


_ENDS = {
    "Pinch": "closed tubes", "PinchedBending": "tubes under the full load", "ShapeRecovery": "tubes that were let go",
}  # fmt: skip


def _end(record: Record) -> tuple[int, str]:
    """The stored state that tells most: the end of the bending, else the last one; and words about it."""
    assert record.fields is not None
    rows = record.fields.values.round().astype(int)
    bending = np.flatnonzero(record["stage"][rows] == STAGES.index("bend"))
    state = int(bending[-1]) if len(bending) else len(rows) - 1
    return state, _words(record, state)


def _states(record: Record) -> list[int]:
    """Ends of the stages; of a pinch alone, all that is stored."""
    assert record.fields is not None
    stage = record["stage"][record.fields.values.round().astype(int)]
    ends = np.flatnonzero(np.diff(np.append(stage, -1)))
    states = ends if len(ends) > 2 else np.arange(len(stage))
    return [int(i) for i in states[:_PANELS]]


def _words(record: Record, state: int) -> str:
    assert record.fields is not None
    row = int(round(record.fields.values[state]))
    return f"{STAGES[int(record['stage'][row])]}: F_p {record['force'][row]:.3g} N"


def _panel(root: Path, entry: Entry, state: int, words: str, cut: bool) -> scenes.Panel:
    caption = "" if cut else f"{_plain(sample_name(entry.slug))}\n{words}"
    return {"file": str(root / entry.path), "state": state, "caption": caption, "cut": cut}


def _plain(text: str) -> str:
    """Text for a scene: VTK's own font has no Greek letters."""
    return text.replace("\u03b1", "alpha")


def _scene(picture: Picture, panels: list[scenes.Panel], columns: int) -> scenes.Scene:
    return {"output": str(picture.file), "colour": "", "panels": panels, "columns": columns}
