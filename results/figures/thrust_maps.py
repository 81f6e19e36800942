"""Mean thrust over frequency and over the size of the load fin, and where it changes sign."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from results.effects import sign_changes
from results.figures.canvas import COLOURS, pyplot, save
from results.swept_series import SweptSeries, named

_HEADER = ("over", "held", "performer", "origin", "value", "unit", "mean_N", "max_N", "min_N", "swim_speed_mm_per_s")
_MAP = ("performer", "origin", "first", "first_unit", "second", "second_unit", "mean_N")
_NOTE = "above: mean thrust of whole cycles, cross: where it changes sign; below: largest and smallest thrust"


def mean_thrust(series: Sequence[SweptSeries], title: str, path: Path) -> Path:
    """Mean thrust over every field that is swept, a panel for each, and where it changes sign.

    Parameters
    ----------
    series
        ``PaddleThrust`` over one field each, few for each field.
    """
    names = list(dict.fromkeys(one.path for one in series))
    size = (5.2 * len(names), 6.4)
    figure, axes = pyplot().subplots(2, len(names), figsize=size, sharex="col", squeeze=False, layout="constrained")
    data: list[Sequence[Any]] = []
    for column, path_of in enumerate(names):
        mine = [one for one in series if one.path == path_of]
        several = [len({name(one) for one in mine}) > 1 for name in (_performer, _held)]
        for number, one in enumerate(mine):
            told = [name(one) for name, many in zip((_performer, _held), several, strict=True) if many]
            label = ", ".join(text for text in told if text) or one.label or _performer(one)
            data += _draw(axes[:, column], one, COLOURS[number % len(COLOURS)], label)
        axes[1, column].set_xlabel(f"{mine[0].name} [{mine[0].unit}]")
        axes[1, column].legend(
            *axes[0, column].get_legend_handles_labels(), frameon=False, fontsize=7, loc="upper center",
            bbox_to_anchor=(0.5, -0.18),
        )  # fmt: skip
    for axis in axes.flat:
        axis.axhline(0.0, color="black", lw=0.8)
        axis.grid(alpha=0.3)
    for axis, label in zip(axes[:, 0], ("mean thrust [N]", "peaks of thrust [N]"), strict=True):
        axis.set_ylabel(label)
    figure.suptitle(f"{title}\n{_NOTE}", fontsize=9)
    return save(figure, path, _HEADER, data)


def _performer(one: SweptSeries) -> str:
    return f"{one.performer} ({one.origin})"


def _held(one: SweptSeries) -> str:
    return one.label


def _draw(axes: Any, one: SweptSeries, colour: str, label: str) -> list[Sequence[Any]]:
    shown = one.shown(one.values)
    mean, most, least, speed = (one.results(name) for name in ("thrust_mean", "thrust_max", "thrust_min", "swim_speed"))
    line = {"ls": "--" if one.origin == "prb" else "-", "marker": "o", "ms": 4, "color": colour, "lw": 1.4}
    axes[0].plot(shown, mean, label=label, **line)
    for values in (most, least):
        axes[1].plot(shown, values, **line)
    for place in sign_changes(one.values, mean):
        at = float(one.shown(np.array([place]))[0])
        axes[0].plot(at, 0.0, "x", color=colour, ms=8, mew=1.8, zorder=5)
        axes[0].annotate(f"{at:.3g}", (at, 0.0), textcoords="offset points", xytext=(0, 7), ha="center", fontsize=8)
    about = (one.name, one.label, one.performer, one.origin)
    rows = zip(shown, mean, most, least, 1e3 * speed, strict=True)
    return [(*about, f"{v:.6g}", one.unit, *(f"{n:.6g}" for n in numbers)) for v, *numbers in rows]


def thrust_map(rows: Sequence[SweptSeries], over: str, title: str, path: Path) -> Path:
    """Mean thrust over two fields, with the line on which it vanishes.

    Parameters
    ----------
    rows
        Series over one field that differ in the field at the dotted path ``over`` alone.
    """
    first = rows[0]
    ordered = sorted(rows, key=lambda one: float(one.bench.fields[over]))
    values = np.unique(np.round(np.concatenate([one.values for one in ordered]), 12))
    sizes = np.array([float(one.bench.fields[over]) for one in ordered])
    grid = np.full((len(ordered), len(values)), np.nan)
    for line, one in zip(grid, ordered, strict=True):
        line[np.searchsorted(values, np.round(one.values, 12))] = one.results("thrust_mean")
    quantity = first.bench.quantity(over)
    factor = float(quantity.show(1.0).split()[0]) if quantity else 1.0
    shown, sides = first.shown(values), sizes * factor
    figure, axis = pyplot().subplots(figsize=(7.2, 5.0), layout="constrained")
    most = float(np.nanmax(np.abs(grid))) or 1.0
    mesh = axis.pcolormesh(shown, sides, grid, cmap="RdBu", vmin=-most, vmax=most, shading="nearest")
    figure.colorbar(mesh, label="mean thrust [N]")
    if np.nanmin(grid) < 0 < np.nanmax(grid) and min(grid.shape) > 1:
        axis.contour(shown, sides, grid, levels=[0.0], colors="black", linewidths=1.4)
    side_unit = quantity.shown_in if quantity else ""
    axis.set(xlabel=f"{first.name} [{first.unit}]", ylabel=f"{named(over)} [{side_unit}]")
    figure.suptitle(f"{title}\nblue: forwards, red: backwards, black line: no mean thrust", fontsize=9)
    data = [
        (first.performer, first.origin, f"{v:.6g}", first.unit, f"{side:.6g}", side_unit, f"{grid[i, j]:.6g}")
        for i, side in enumerate(sides) for j, v in enumerate(shown)
    ]  # fmt: skip
    return save(figure, path, _MAP, data)
