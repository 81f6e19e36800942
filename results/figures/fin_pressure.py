"""How far air in the chambers flattens the tube (fig. 4.5e)."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from lab.published import figures
from results.accuracy import Entry
from results.figures.canvas import pyplot, save
from results.figures.pinched import Look
from results.fins import PSI, full_pinch

_HEADER = ("sample", "performer", "origin", "status", "pressure_psi", "pressure_Pa", "approach_mm", "flat", "s_mm")


def pressure_curves(entries: Sequence[Entry], title: str, path: Path) -> Path:
    """Approach of top and bottom, and travel s of P, over the pressure.

    Parameters
    ----------
    entries
        ``ShapePropagation`` driven by pressure, those that diverged too.
    """
    look = Look.of(entries)
    figure, axes = pyplot().subplots(1, 2, figsize=(10.5, 4.2), layout="constrained")
    data: list[Sequence[Any]] = []
    for entry in entries:
        record = entry.record
        pressure, travel = record["pressure"] / PSI, 1e3 * record["travel"]
        s = 1e3 * np.hypot(record["p"][:, 0], record["p"][:, 2])
        for axis, curve in zip(axes, (travel, s), strict=True):
            axis.plot(pressure, curve, lw=1.5, **look.line(entry))
            if not record.completed:
                axis.plot(pressure[-1], curve[-1], "x", color=look.colour(entry), ms=7, mew=1.6)
        about = (entry.slug, entry.performer, record.origin, record.status)
        columns = (pressure, record["pressure"], travel, travel / (1e3 * full_pinch()), s)
        data += [(*about, *(f"{n:.6g}" for n in row)) for row in zip(*columns, strict=True)]
    full = 1e3 * full_pinch()
    axes[0].axhline(full, color="#999999", ls=(0, (6, 3)), lw=1.6)
    axes[0].annotate(f"full pinch of 4.4.1: {full:g} mm", (0.02, full), xycoords=("axes fraction", "data"),
                     va="bottom", fontsize=8, color="#666666")  # fmt: skip
    low, high = (float(end) for end in figures()["c4-pressure-range"]["value"])
    for pressure in np.linspace(low, high, 5):
        for axis in axes:
            axis.axvline(pressure, color="#cccccc", lw=0.8, zorder=0)
    for axis, label in zip(axes, ("approach of top and bottom [mm]", "s of P [mm]"), strict=True):
        axis.set(xlabel="pressure in the chambers [psi]", ylabel=label)
        axis.axhline(0.0, color="black", lw=0.6)
        axis.grid(alpha=0.3, axis="y")
    handles = look.handles()
    if len(handles) > 1:
        figure.legend(handles=handles, loc="outside right center", frameon=False, fontsize=8)
    figure.suptitle(title, fontsize=9)
    return save(figure, path, _HEADER, data)
