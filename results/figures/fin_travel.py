"""What the fins do along the pinch: travel s and y of P, and the force that it takes (fig. 4.4a)."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from results.accuracy import Entry
from results.figures.canvas import pyplot, save
from results.figures.pinched import Look

_HEADER = (
    "sample", "performer", "origin", "status", "pinch_mm", "s_mm", "y_mm", "x_mm", "z_mm", "fin_angle_deg",
    "tip_radius_mm", "force_N",
)  # fmt: skip
_NOTE = "s: travel of P in the x-z plane, y: its motion towards that plane; cross: ended before the full pinch"


def travel_curves(entries: Sequence[Entry], title: str, path: Path) -> Path:
    """s, y, turn of the fin and force of every sample and performer over the pinch.

    Parameters
    ----------
    entries
        ``ShapePropagation`` by pinching, those that diverged too: what they reached is drawn.
    """
    look = Look.of(entries)
    figure, axes = pyplot().subplots(1, 4, figsize=(15, 4.2), layout="constrained")
    data: list[Sequence[Any]] = []
    for entry in entries:
        record = entry.record
        p = 1e3 * record["p"]
        pinch, turn = 1e3 * record["travel"], np.rad2deg(record["fin_angle"][0] - record["fin_angle"])
        curves = (np.hypot(p[:, 0], p[:, 2]), -p[:, 1], turn, record["force"])
        for axis, curve in zip(axes, curves, strict=True):
            axis.plot(pinch, curve, lw=1.4, **look.line(entry))
            if not record.completed:
                axis.plot(pinch[-1], curve[-1], "x", color=look.colour(entry), ms=7, mew=1.6)
        about = (entry.slug, entry.performer, record.origin, record.status)
        columns = (pinch, curves[0], curves[1], p[:, 0], p[:, 2], np.rad2deg(record["fin_angle"]),
                   1e3 * record["fin_radius"], record["force"])  # fmt: skip
        data += [(*about, *(f"{n:.6g}" for n in row)) for row in zip(*columns, strict=True)]
    labels = ("s of P [mm]", "y of P [mm]", "turn of the fin towards the tube [deg]", "pinching force [N]")
    for axis, label in zip(axes, labels, strict=True):
        axis.set(xlabel="approach of top and bottom [mm]", ylabel=label)
        axis.axhline(0.0, color="black", lw=0.6)
        axis.grid(alpha=0.3)
    figure.legend(handles=look.handles(), loc="outside right center", frameon=False, fontsize=8)
    figure.suptitle(f"{title}\n{_NOTE}", fontsize=9)
    return save(figure, path, _HEADER, data)
