"""Where a load takes the distal block of a pinched tube, over the pinch angle (fig. 3.2d, fig. 3.7a)."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from lab.experiments.pinched_bending import PinchedBending
from results.accuracy import Entry
from results.figures.canvas import pyplot, save
from results.figures.pinched import Look, during, ideal_of

_HEADER = ("sample", "performer", "origin", "alpha_deg", "x_mm", "y_mm", "turn_deg", "turn_axis_deg")
_NOTE = "dotted: across the ideal axis, where a hinge alone would let the block go; arrow: the load"


def block_paths(entries: Sequence[Entry], title: str, path: Path) -> Path:
    """Paths of the distal block's face under load, and its x and y displacement over the pinch angle.

    Parameters
    ----------
    entries
        Completed ``PinchedBending`` of pinched tubes, which differ in the pinch angle at least.
    """
    look = Look.of(entries)
    figure, (plane, over) = pyplot().subplots(1, 2, figsize=(11.5, 5.0), layout="constrained")
    data, reach = [], 1e-3
    for entry in entries:
        pose = entry.record["pose"]
        way = _way(entry)
        moved = 1e3 * (pose[way, :2] - pose[way[0], :2])
        plane.plot(*moved.T, lw=1.6, **look.line(entry))
        face = "white" if entry.record.origin == "prb" else look.colour(entry)
        plane.plot(*moved[-1], "o", ms=5, color=look.colour(entry), mfc=face)
        reach = max(reach, float(np.abs(moved).max()))
        data.append(_row(entry))
    for entry in {entry.slug: entry for entry in entries}.values():
        across = 1.1 * reach * np.array([-np.sin(ideal_of(entry)), np.cos(ideal_of(entry))])
        plane.plot(*np.stack([-across, across], axis=1), ls=":", lw=0.9, color=look.colour(entry), zorder=1)
    experiment: Any = entries[0].experiment
    load = np.array([np.cos(experiment.direction), np.sin(experiment.direction)])
    head = {"arrowstyle": "-|>", "lw": 2.0, "color": "#444444"}
    plane.annotate("", 0.3 * reach * load, xytext=(0, 0), arrowprops=head, zorder=5)
    plane.set(aspect="equal", xlim=(-1.2 * reach, 1.2 * reach), ylim=(-1.2 * reach, 1.2 * reach))
    plane.set(xlabel="x [mm]", ylabel="y [mm]", title="path of the distal block")
    _over_angle(over, entries, look)
    for axis in (plane, over):
        axis.grid(alpha=0.3)
    figure.legend(handles=look.handles(), loc="outside right center", frameon=False, fontsize=8)
    figure.suptitle(f"{title}\n{_NOTE}", fontsize=9)
    return save(figure, path, _HEADER, data)


def _way(entry: Entry) -> list[int]:
    """From the last state before the load to its end; with the load first, from rest on through the pinch."""
    bending = during(entry.record, "bend")
    if len(bending):
        return [int(bending[0]) - 1, *map(int, bending)]
    return list(range(len(entry.record["stage"])))


def _over_angle(axis: Any, entries: Sequence[Entry], look: Look) -> None:
    """As in the text: squares for x, stars for y."""
    from matplotlib.lines import Line2D

    for entry in entries:
        _, _, _, angle, x, y, *_ = _row(entry)
        face = "none" if entry.record.origin == "prb" else look.colour(entry)
        for value, marker, size in ((x, "s", 7), (y, "*", 11)):
            axis.plot(float(angle), float(value), marker, ms=size, color=look.colour(entry), mfc=face)
    axis.axhline(0.0, color="black", lw=0.6)
    axis.set(
        xlabel="pinch angle $\\alpha$ [deg]", ylabel="displacement by the load [mm]", title="x (squares), y (stars)"
    )
    axis.set_xticks(range(0, 361, 60))
    if any(entry.record.origin == "prb" for entry in entries):
        axis.legend(handles=[Line2D([], [], color="#555555", marker="s", mfc="none", ls="", label="hollow: PRB")])


def _row(entry: Entry) -> Sequence[Any]:
    assert isinstance(entry.experiment, PinchedBending)
    found = entry.scalars()
    angles = (np.degrees(found[name].value) for name in ("turn", "turn_axis"))
    moves = (1e3 * found[name].value for name in ("move_x", "move_y"))
    numbers = (np.degrees(entry.experiment.pinch_angle), *moves, *angles)
    return (entry.slug, entry.performer, entry.record.origin, *(f"{n:.6g}" for n in numbers))
