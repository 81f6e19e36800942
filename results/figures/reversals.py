"""How reversals of the sense of travel move with the weight on a load frame (5.6.2)."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from results.figures.canvas import pyplot, save, styles
from results.orbit_agreement import turns
from results.orbit_series import FREQUENCY, Series

_HEADER = ("series", "performer", "load_g", "swept", "unit", "reversal", "sense_after")
#: How a series' label tells the weight.
_LOAD = "load "


def loads_of(series: Sequence[Series]) -> dict[str, dict[float, Series]]:
    """Frequency sweeps by the weight on their load frame (kg), those that differ in nothing else under what they share.

    Only families of three weights or more, which show how something moves with the weight.
    """
    families: dict[str, dict[float, Series]] = {}
    for one in series:
        frame = one.tracks[0].entries[0].record.specimen.get("load_frame")
        words = one.label.split(", ")
        shared = [word for word in words if not word.startswith(_LOAD)]
        if one.swept == FREQUENCY and frame and len(shared) < len(words):
            families.setdefault(", ".join(shared), {})[float(frame["load"])] = one
    return {shared: dict(sorted(family.items())) for shared, family in families.items() if len(family) > 2}


def reversals_over_load(campaign: str, families: Mapping[str, Mapping[float, Series]], path: Path) -> Path:
    """Swept values at which the sense reverses, over the weight on the load frame: one panel per family (5.6.2).

    Parameters
    ----------
    families
        As ``loads_of`` gives them.
    """
    figure, axes = pyplot().subplots(
        1, len(families), figsize=(max(3.2 * len(families), 5.0), 4.0), sharey=True, squeeze=False,
        layout="constrained",
    )  # fmt: skip
    data: list[Sequence[Any]] = []
    first = next(iter(next(iter(families.values())).values()))
    look = styles([track.entries[0] for track in first.tracks])
    for axis, (shared, family) in zip(axes[0], families.items(), strict=True):
        for number, (performer, style) in enumerate(look.items()):
            for load, one in family.items():
                for at, after in _reversals(one, performer):
                    # Side by side, since good models hide each other.
                    place = 1e3 * load + (number - (len(look) - 1) / 2.0) * 0.02e3 * max(family)
                    marker = "^" if after > 0 else "v"
                    axis.plot(place, at, marker, color=style.colour, mfc=style.face, ms=6)
                    data.append((shared, performer, f"{1e3 * load:.6g}", one.name, one.unit, f"{at:.6g}", after))
        axis.set(title=shared, xlabel="load [g]")
        axis.grid(alpha=0.3)
    axes[0, 0].set_ylabel(f"reversal: {first.axis}")
    handles = [
        pyplot().Line2D([], [], color=s.colour, mfc=s.face, marker="^", ls="", label=s.label) for s in look.values()
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=3, frameon=False)
    figure.suptitle(
        f"{campaign}: reversals over the load\nup: right-handed from there on, down: left-handed", fontsize=10
    )
    return save(figure, path, _HEADER, data)


def _reversals(series: Series, performer: str) -> list[tuple[float, int]]:
    track = series.track(performer)
    found = turns(track) if track else []
    shown = series.shown(np.array([reversal.at for reversal in found]))
    return [(float(at), reversal.after) for at, reversal in zip(shown, found, strict=True)]
