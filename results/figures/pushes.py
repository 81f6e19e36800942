"""Load against motion of the bent tube, open and pinched, beside the measured slopes (fig. 3.6b)."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from lab.experiments.pinched_bending import PinchedBending
from lab.published import figures
from results.accuracy import Entry
from results.figures.canvas import pyplot, save
from results.figures.pinched import Look, during

_HEADER = ("sample", "performer", "origin", "state", "stage", "motion_mm", "load_N")
#: Published slope by whether the tube is pinched.
_LAB = {False: "c3-k-unpinched", True: "c3-k-pinched"}
_WORDS = {False: "open tube", True: "pinched tube"}


def bending_curves(entries: Sequence[Entry], title: str, path: Path) -> Path:
    """Load against the motion of its point, there and back: one panel for open tubes, one for pinched ones.

    Parameters
    ----------
    entries
        ``PinchedBending`` with a stage ``bend``.
    """
    look = Look.of(entries)
    states = sorted({_bending(entry).pinched for entry in entries})
    figure, axes = pyplot().subplots(
        1, len(states), figsize=(5.2 * len(states) + 2.0, 4.4), squeeze=False, layout="constrained"
    )
    data: list[Sequence[Any]] = []
    for axis, state in zip(axes[0], states, strict=True):
        for entry in (e for e in entries if _bending(e).pinched == state):
            data += _draw(axis, entry, look)
        if any(_bending(entry).push for entry in entries):
            _lab_slope(axis, state)
        axis.set(title=_WORDS[state], xlabel="motion of the point [mm]")
        axis.axhline(0.0, color="black", lw=0.6)
        axis.grid(alpha=0.3)
    axes[0, 0].set_ylabel("load [N]")
    figure.legend(handles=look.handles(), loc="outside right center", frameon=False, fontsize=8)
    note = "there: thick, back: thin; numbers: slope of load against motion on the way there"
    figure.suptitle(f"{title}\n{note}", fontsize=9)
    return save(figure, path, _HEADER, data)


def _bending(entry: Entry) -> PinchedBending:
    assert isinstance(entry.experiment, PinchedBending)
    return entry.experiment


def _draw(axis: Any, entry: Entry, look: Look) -> list[Sequence[Any]]:
    """One record, there and back; the motion is counted from where the bending starts."""
    record = entry.record
    data: list[Sequence[Any]] = []
    there, back = during(record, "bend"), during(record, "return")
    if not len(there):
        return []
    start = there[0] - 1
    motion, load = 1e3 * (record["pushed"] - record["pushed"][start]), record["load"]
    for name, way, width in (("bend", [start, *there], 1.8), ("return", [there[-1], *back] if len(back) else [], 0.9)):
        axis.plot(motion[way], load[way], lw=width, **look.line(entry))
        about = (entry.slug, entry.performer, record.origin, _WORDS[_bending(entry).pinched], name)
        data += [(*about, f"{x:.6g}", f"{y:.6g}") for x, y in zip(motion[way], load[way], strict=True)]
    # Slopes of several models of one sample would hide each other; tables have them.
    if record.completed and (record.origin != "prb" or len(look.lines) == 1):
        words = f" {entry.scalars()['k'].value:.4g} N/m"
        place = (motion[there[-1]], load[there[-1]])
        axis.annotate(words, place, fontsize=7, color=look.colour(entry), ha="left", va="center")
    return data


def _lab_slope(axis: Any, pinched: bool) -> None:
    """Measured slope, through the origin up to where the models' curves end."""
    slope = float(figures()[_LAB[pinched]]["value"])
    right = max((float(np.max(line.get_xdata(), initial=0.0)) for line in axis.lines), default=1.0) or 1.0
    line = {"color": "#999999", "ls": (0, (6, 3)), "lw": 2.2, "zorder": 1, "label": f"lab: {slope:g} N/m"}
    axis.plot([0.0, right], [0.0, slope * right * 1e-3], **line)
    axis.legend(loc="upper left", frameon=False, fontsize=8)
