"""Sense of travel as a map: signed ratio of the axes, swept number across (fig. 5.6 in one picture)."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from results.figures.canvas import pyplot, save
from results.orbit_agreement import turns
from results.orbit_series import Series, Track

Array = NDArray[np.float64]

#: Said beside every map.
SENSES = "signed ratio of the axes: orange left-handed, purple right-handed about +x, pale a line, grey no result"
#: Ratios that its colour bar names.
TICKS = (-1.0, -0.25, 0.0, 0.25, 1.0)
_HEADER = ("performer", "series", "swept", "unit", "value", "axis_ratio")


def sense_map(axis: Any, series: Series, rows: Sequence[tuple[str, Track]]) -> Any:
    """Rows of coloured cells, each with its label, ticks where its sense reverses; return the image for a bar.

    Parameters
    ----------
    series
        Whose swept number and unit the tracks share.
    rows
        Labels with tracks, from the top down.
    """
    from matplotlib.colors import FuncNorm

    values = np.unique(np.concatenate([track.values for _, track in rows]))
    ratios = np.full((len(rows), len(values)), np.nan)
    for row, (_, track) in enumerate(rows):
        ratios[row, np.searchsorted(values, track.values)] = track.axis_ratio
    # Roots pull the pale middle apart: the sense counts, and thin orbits have one too.
    norm = FuncNorm((_root, _square), vmin=-1.0, vmax=1.0)
    image = axis.pcolormesh(edges(series.shown(values)), np.arange(len(rows) + 1) - 0.5, ratios, cmap="PuOr", norm=norm)
    axis.set_facecolor("#cccccc")
    for row, (_, track) in enumerate(rows):
        at = series.shown(np.array([reversal.at for reversal in turns(track)]))
        axis.vlines(at, row - 0.5, row + 0.5, color="black", lw=1.6)
    axis.set_yticks(range(len(rows)), [label for label, _ in rows])
    axis.invert_yaxis()
    return image


def edges(values: Array) -> Array:
    """Bounds (n + 1,) of cells around ascending values (n,)."""
    if len(values) == 1:
        return values[0] + np.array([-0.5, 0.5])
    middles = (values[:-1] + values[1:]) / 2.0
    return np.concatenate([[2 * values[0] - middles[0]], middles, [2 * values[-1] - middles[-1]]])


def _root(ratios: Array) -> Array:
    return np.sign(ratios) * np.sqrt(np.abs(ratios))


def _square(roots: Array) -> Array:
    return np.sign(roots) * roots**2


def sense_maps(series: Sequence[Series], path: Path) -> Path:
    """Sense of travel of every performer, one row per series: those of one campaign that sweep the same number.

    Raises
    ------
    ValueError
        When they sweep different numbers.
    """
    if len({one.swept for one in series}) != 1:
        raise ValueError(f"one map, one swept number; there is {', '.join(dict.fromkeys(s.name for s in series))}")
    performers = list(dict.fromkeys(name for one in series for name in one.performers))
    height = 0.2 * len(series) + 0.35
    figure, axes = pyplot().subplots(
        len(performers), 1, figsize=(10.5, height * len(performers) + 0.9), sharex=True, squeeze=False,
        layout="constrained",
    )  # fmt: skip
    for axis, performer in zip(axes[:, 0], performers, strict=True):
        rows = [(one.label, track) for one in series if (track := one.track(performer))]
        image = sense_map(axis, series[0], rows)
        axis.set_title(f"{performer} ({rows[0][1].origin})", fontsize=9, loc="left")
    axes[-1, 0].set_xlabel(series[0].axis)
    figure.colorbar(image, ax=axes, label="signed ratio", ticks=TICKS, aspect=30, pad=0.01)
    figure.suptitle(f"{series[0].campaign}: where the sense of travel reverses (black)\n{SENSES}", fontsize=10)
    return save(figure, path, _HEADER, [row for one in series for row in _ratios(one)])


def _ratios(series: Series) -> list[Sequence[Any]]:
    return [
        (track.performer, series.label, series.name, series.unit, f"{value:.9g}", f"{ratio:.6g}")
        for track in series.tracks
        for value, ratio in zip(series.shown(track.values), track.axis_ratio, strict=True)
    ]
