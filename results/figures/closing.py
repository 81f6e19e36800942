"""Force that flattens a tube: over the travel of the tendons, the motion of the pads, the flattening (fig. 3.5a)."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.experiments.pinch import closing
from lab.hinge import section_shape
from lab.records import Record
from lab.specimens import PinchedTube
from results.accuracy import Entry
from results.figures.canvas import pyplot, save
from results.figures.pinched import Look, pinching

Array = NDArray[np.float64]

_HEADER = (
    "sample",
    "performer",
    "origin",
    "status",
    "travel_mm",
    "pad_motion_mm",
    "flattening",
    "force_N",
    "contact_N",
)
_NOTE = (
    "ring: first touch; triangle: largest force on the way there, where it is larger; cross: ended without a touch; "
    "dotted: opposite pads of one pair meet"
)


def closing_curves(entries: Sequence[Entry], title: str, path: Path) -> Path:
    """F_p of every sample and performer over travel, pad motion and flattening; models know at least the travel.

    Parameters
    ----------
    entries
        Experiments with a pinch, those that diverged too: what they reached is drawn.
    """
    look = Look.of(entries)
    figure, axes = pyplot().subplots(1, 3, figsize=(13, 4.4), sharey=True, layout="constrained")
    data: list[Sequence[Any]] = []
    for entry in entries:
        places = pinching(entry.record)
        ways = _ways(entry.record, places)
        force = entry.record["force"][places]
        for axis, way in zip(axes, ways, strict=True):
            axis.plot(way, force, lw=1.3, **look.line(entry))
            _mark(axis, entry.record, way, force, look.colour(entry))
        contact = _channel(entry.record, "contact_force", places)
        about = (entry.slug, entry.performer, entry.record.origin, entry.record.status)
        data += [(*about, *(f"{n:.6g}" for n in row)) for row in zip(*ways, force, contact, strict=True)]
    for meeting in {round(_meeting(entry), 9) for entry in entries}:
        axes[1].axvline(1e3 * meeting, color="#888888", lw=0.9, ls=":")
    for axis, label in zip(axes, ("travel of $F_p$ [mm]", "motion of a pad [mm]", "flattening"), strict=True):
        axis.set(xlabel=label)
        axis.grid(alpha=0.3)
    axes[0].set(ylabel="$F_p$ [N]", ylim=(0.0, None))
    figure.legend(handles=look.handles(), loc="outside right center", frameon=False, fontsize=8)
    figure.suptitle(f"{title}\n{_NOTE}", fontsize=9)
    return save(figure, path, _HEADER, data)


def _ways(record: Record, places: NDArray[np.int64]) -> tuple[Array, Array, Array]:
    """Travel, mm, motion of the pads of the pair that moves most, mm, and share of the width that is gone."""
    travel = 1e3 * record["travel"][places]
    pads, flat = np.full(len(places), np.nan), np.full(len(places), np.nan)
    if "shortening" in record.channels:
        shortening = record["shortening"][places]
        pads = 500.0 * (shortening[:, np.argmax(shortening[-1])] if len(places) else shortening[:, 0])
    if "section" in record.channels:
        widths = np.array([section_shape(section).width for section in record["section"][places]])
        flat = 1.0 - widths / section_shape(record["section"][0]).width
    return travel, pads, flat


def _channel(record: Record, name: str, places: NDArray[np.int64]) -> Array:
    values: Array = record[name][places] if name in record.channels else np.full(len(places), np.nan)
    return values


def _mark(axis: Any, record: Record, way: Array, force: Array, colour: Any) -> None:
    """Where the pinch first touches and where it takes most, or that it never touches."""
    if not len(way) or not {"gap", "contact_force"} <= set(record.channels):
        return
    found = closing(record)
    touch = found["touch_force"].value
    if not np.isfinite(touch):
        axis.plot(way[-1], force[-1], "x", color=colour, ms=7, mew=1.6)
        return
    contact = record["contact_force"][pinching(record)]
    here = int(np.flatnonzero(contact > 0)[0])
    travel = record["travel"][pinching(record)]
    at = np.interp(found["touch_travel"].value, travel[max(here - 1, 0) : here + 1], way[max(here - 1, 0) : here + 1])
    axis.plot(at, touch, "o", color=colour, mfc="white", ms=6, zorder=4)
    if found["closing_force"].value > touch:
        most = int(np.argmax(force[: here + 1]))
        axis.plot(way[most], force[most], "^", color=colour, ms=5, zorder=4)


def _meeting(entry: Entry) -> float:
    """Motion at which the pads of one pair meet, m."""
    tube = entry.tested()
    assert isinstance(tube, PinchedTube)
    return tube.radius - tube.wall - tube.pad_height
