"""Whether a loaded tube comes back: flattening and drop along the stages (fig. 3.7b)."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.experiments.pinch_drive import STAGES
from lab.hinge import section_shape
from lab.records import Record
from results.accuracy import Entry
from results.figures.canvas import pyplot, save
from results.figures.pinched import Look, during

Array = NDArray[np.float64]

_HEADER = ("sample", "performer", "origin", "status", "stage", "progress", "flattening", "drop_mm", "force_N")
_STAGES = ("load", "pinch", "release", "recover", "let go")


def recovery_story(entries: Sequence[Entry], title: str, path: Path) -> Path:
    """Flattening, motion of the weight and force of the tendons of every sample, all stages equally long.

    Parameters
    ----------
    entries
        ``ShapeRecovery``, those that diverged too.
    """
    look = Look.of(entries)
    figure, axes = pyplot().subplots(3, 1, figsize=(9.5, 8.0), sharex=True, layout="constrained")
    present = [name for name in _STAGES if any(len(during(entry.record, name)) for entry in entries)]
    data: list[Sequence[Any]] = []
    for entry in entries:
        progress = _progress(entry.record, present)
        columns = (_flattening(entry.record), 1e3 * entry.record["pushed"], entry.record["force"])
        for axis, values in zip(axes, columns, strict=True):
            axis.plot(progress, values, lw=1.5, **look.line(entry))
            if not entry.record.completed:
                axis.plot(progress[-1], values[-1], "x", color=look.colour(entry), ms=7, mew=1.6)
        about = (entry.slug, entry.performer, entry.record.origin, entry.record.status)
        names = [STAGES[int(number)] for number in entry.record["stage"]]
        rows = zip(names, progress, *columns, strict=True)
        data += [(*about, name, *(f"{n:.6g}" for n in numbers)) for name, *numbers in rows]
    labels = ("flattening\n0: as loaded, 1: closed", "motion of the weight [mm]", "$F_p$ of the pulled tendons [N]")
    for axis, label in zip(axes, labels, strict=True):
        axis.set_ylabel(label)
        axis.grid(alpha=0.3, axis="y")
        for border in range(len(present) + 1):
            axis.axvline(border, color="#bbbbbb", lw=0.8)
    axes[0].axhline(0.0, color="black", lw=0.6)
    axes[-1].set_xticks(np.arange(len(present)) + 0.5, present)
    axes[-1].set_xlim(0, len(present))
    figure.legend(handles=look.handles(), loc="outside right center", frameon=False, fontsize=8)
    figure.suptitle(title)
    return save(figure, path, _HEADER, data)


def _progress(record: Record, present: Sequence[str]) -> Array:
    """Place on the page of every increment (n,): whole numbers where a stage ends; rest stands at 0."""
    result = np.zeros(len(record["stage"]))
    for number, name in enumerate(present):
        mine = during(record, name)
        result[mine] = number + np.arange(1, len(mine) + 1) / max(len(mine), 1)
    return result


def _flattening(record: Record) -> Array:
    """Width that is gone since the loaded tube, over what the pinch takes (n,); NaN without a closed tube."""
    widths = np.array([section_shape(section).width for section in record["section"]])
    loaded, closed = during(record, "load"), during(record, "pinch")
    if not len(loaded) or not len(closed):
        return np.full(len(widths), np.nan)
    before = widths[loaded[-1]]
    return np.asarray((before - widths) / (before - widths[closed[-1]]))
