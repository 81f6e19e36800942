"""s and y at the full pinch over the fin's arc and its attachment angle (fig. 4.4b, c)."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from results.effects import Effect, effect
from results.figures.canvas import COLOURS, pyplot, save
from results.swept_series import SweptSeries

_HEADER = ("over", "held", "performer", "origin", "angle_deg", "s_mm", "y_mm")
_GREEK = {"alpha": "\u03b1, arc of the fin", "theta": "\u03b8, attachment angle"}
_TOLD = {"alpha": "\u03b1", "theta": "\u03b8"}
_NOTE = "in brackets: largest less smallest over the mean, and correlation with the angle"


def designs_over(series: Sequence[SweptSeries], title: str, path: Path) -> Path:
    """A column for every angle that is swept, s above and y below, both on one scale across.

    Parameters
    ----------
    series
        ``ShapePropagation`` over fin arcs or attachment angles.
    """
    names = list(dict.fromkeys(one.name for one in series))
    figure, axes = pyplot().subplots(
        2, len(names), figsize=(5.4 * len(names), 6.6), sharex="col", sharey="row", squeeze=False, layout="constrained"
    )
    data: list[Sequence[Any]] = []
    for column, name in enumerate(names):
        mine = [one for one in series if one.name == name]
        for number, one in enumerate(mine):
            angles = np.rad2deg(one.values)
            found = {quantity: 1e3 * one.results(quantity) for quantity in ("s", "y")}
            for axis, values in zip(axes[:, column], found.values(), strict=True):
                words = f"{_held(one.label) or one.performer}{_told(effect(angles, values))}"
                line = "--" if one.origin == "prb" else "-"
                axis.plot(angles, values, line, marker="o", ms=4, color=COLOURS[number % len(COLOURS)], label=words)
            about = (name, one.label, one.performer, one.origin)
            rows = zip(angles, found["s"], found["y"], strict=True)
            data += [(*about, *(f"{n:.6g}" for n in row)) for row in rows]
        axes[1, column].set_xlabel(f"{_GREEK.get(name, name)} [deg]")
    for axis, label in zip(axes[:, 0], ("s at full pinch [mm]", "y at full pinch [mm]"), strict=True):
        axis.set_ylabel(label)
    for axis in axes.flat:
        low, high = axis.get_ylim()
        axis.set_ylim(min(low, 0.0), max(high, 0.0))
        axis.axhline(0.0, color="black", lw=0.6)
        axis.grid(alpha=0.3)
        axis.legend(frameon=False, fontsize=8)
    figure.suptitle(f"{title}\n{_NOTE}", fontsize=9)
    return save(figure, path, _HEADER, data)


def _held(label: str) -> str:
    for word, letter in _TOLD.items():
        label = label.replace(word, letter)
    return label.replace(" deg", "\u00b0")


def _told(found: Effect) -> str:
    if not np.isfinite(found.spread):
        return ""
    r = f", r {found.correlation:+.2f}" if np.isfinite(found.correlation) else ""
    return f" ({found.spread:.1%}{r})"
