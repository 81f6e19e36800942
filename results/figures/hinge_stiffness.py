"""How the hinge comes up along the pinch: bending stiffness about and across it, and where its axis lies."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from lab.hinge import bending_stiffness
from results.accuracy import Entry
from results.figures.canvas import pyplot, save
from results.figures.pinched import Look, axis_errors, ideal_of, pinching

_HEADER = (
    "sample", "performer", "origin", "travel_mm", "k_soft_Nm_per_rad", "k_stiff_Nm_per_rad", "hinge_axis_deg",
    "from_ideal_deg",
)  # fmt: skip


def stiffness_over_travel(entries: Sequence[Entry], title: str, path: Path) -> Path:
    """Least and largest bending stiffness and the softest axis of every sample and performer along the pinch.

    Parameters
    ----------
    entries
        Records with ``flexibility``; NaN in it, as of an eighth of a tube, is passed over.
    """
    from matplotlib.ticker import LogLocator, NullLocator

    look = Look.of(entries)
    figure, axes = pyplot().subplots(1, 3, figsize=(13, 4.4), layout="constrained")
    axes[1].sharey(axes[0])
    data: list[Sequence[Any]] = []
    open_tube = 0.0
    for entry in entries:
        places = pinching(entry.record)
        places = places[np.isfinite(entry.record["flexibility"][places, 3:5, 3:5]).all(axis=(1, 2))]
        if not len(places):
            continue
        travel = 1e3 * entry.record["travel"][places]
        found = [bending_stiffness(flexibility) for flexibility in entry.record["flexibility"][places]]
        soft, stiff, hinge = (np.array([getattr(one, name) for one in found]) for name in ("soft", "stiff", "axis"))
        error = np.degrees(axis_errors(hinge, ideal_of(entry)))
        for axis, values in zip(axes[:2], (soft, stiff), strict=True):
            # A logarithm knows no unstable states.
            axis.plot(travel, np.where(values > 0.0, values, np.nan), marker=".", ms=3, lw=1.2, **look.line(entry))
        # No line: an axis may jump.
        face = "none" if entry.record.origin == "prb" else look.colour(entry)
        axes[2].plot(travel, error, "o", ms=4, color=look.colour(entry), mfc=face)
        open_tube = max(open_tube, stiff[0])
        rows = zip(travel, soft, stiff, np.degrees(hinge), error, strict=True)
        data += [(entry.slug, entry.performer, entry.record.origin, *(f"{n:.6g}" for n in row)) for row in rows]
    for axis, name in zip(axes, ("k_soft [N m/rad]", "k_stiff [N m/rad]", "hinge axis - ideal [deg]"), strict=True):
        axis.set(xlabel="travel of $F_p$ [mm]", title=name, xlim=axes[0].get_xlim())
        axis.grid(alpha=0.3, which="both")
    axes[0].set_yscale("log")
    # Where the tube snaps through, the stiffness across goes through infinity.
    axes[0].set_ylim(top=3.0 * open_tube or None)
    for axis in axes[:2]:
        axis.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.yaxis.set_major_formatter("{x:g}")
        axis.yaxis.set_minor_locator(NullLocator())
    axes[2].axhline(0.0, color="black", lw=0.6)
    axes[2].set_ylim(-92, 92)
    axes[2].set_yticks(range(-90, 91, 30))
    figure.legend(handles=look.handles(), loc="outside right center", frameon=False, fontsize=8)
    note = (
        "bending stiffness of the distal block, tendons held; gaps: unstable, "
        "on the right: no direction is softer than the others"
    )
    figure.suptitle(f"{title}\n{note}", fontsize=9)
    return save(figure, path, _HEADER, data)
