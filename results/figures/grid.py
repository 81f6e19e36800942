"""Small multiples of orbits over a swept number (fig. 5.3d, e; figs A.1, A.2 and B.1 to B.8)."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from results.figures.canvas import Style, pyplot, save, styles
from results.figures.choice import chosen
from results.figures.paths import FIRST, OTHERS, VIEW, Orbit, Tiles, extent, path_of
from results.orbit_agreement import LINE_LIKE
from results.orbit_series import TWIST, Series, Track

_HEADER = ("series", "swept", "unit", "value", "performer", "y_mm", "z_mm")
#: Tiles beside each other in a grid and in a gallery.
_COLUMNS, _FEW = 9, 5
#: Sides of a tile in a full and in a small grid, and in a gallery, inches.
_SIDES, _GALLERY = (1.45, 1.9), 2.4
#: Twists side by side in the family, deg.
_FAMILY = 30.0
#: Grounds of tiles: the reference's orbit is a line; the nearest model goes round the other way.
_PLAIN, _GREY, _RED = "white", "#f0f0f0", "#fde0dc"


def orbit_grid(series: Series, reference: str | None, path: Path) -> Path:
    """One tile per swept value: the reference solid, the PRB models nearest to and farthest from it dashed.

    Every tile has its own scale.
    """
    tracks = chosen(series, reference)
    columns = min(_COLUMNS, len(series.values))
    rows = -(-len(series.values) // columns)
    note = (
        f"{VIEW}; grey: a line (ratio of the axes up to {LINE_LIKE:g}); red: the nearest model goes round the other way"
    )
    figure, tiles = _page(rows, columns, _SIDES[columns < _COLUMNS], tracks, f"{series.title}: path of the tip", note)
    for number, value in enumerate(series.values):
        orbits = [Orbit.at(track, value, style) for track, style in tracks]
        tiles.draw(*divmod(number, columns), series.text(value), orbits, _ground(orbits))
    return save(figure, path, _HEADER, _points(series, tracks, series.values), dpi=120)


def family_of(series: Series) -> dict[tuple[int, int], float]:
    """Swept twists that are whole multiples of 30 deg, by row and column: right-handed ones above, by size.

    Nothing where the series sweeps another number.
    """
    if series.swept != TWIST:
        return {}
    known = {round(float(deg), 6): value for deg, value in zip(series.shown(series.values), series.values, strict=True)}
    sizes = sorted({abs(deg) for deg in known if deg % _FAMILY == 0.0})
    return {
        (row, column): known[sign * size]
        for row, sign in enumerate((1.0, -1.0))
        for column, size in enumerate(sizes)
        if sign * size in known and not (row and size == 0.0)
    }


def twist_family(series: Series, reference: str | None, path: Path) -> Path:
    """Orbits of every 30 deg of twist on one scale: right-handed beams above, left-handed ones below (fig. 5.3e).

    Raises
    ------
    ValueError
        When the series has no such twists, see ``family_of``.
    """
    wanted = family_of(series)
    if not wanted:
        raise ValueError(f"{series.title}: sweeps {series.name}; a family needs twists that are multiples of 30 deg")
    tracks = chosen(series, reference)[:2]
    orbits = {at: [Orbit.at(track, value, style) for track, style in tracks] for at, value in wanted.items()}
    side = max(extent(found) for found in orbits.values())
    title = f"{series.title}: path of the tip over the twist, one scale"
    rows, columns = (1 + max(numbers) for numbers in zip(*wanted, strict=True))
    figure, tiles = _page(rows, columns, _SIDES[1], tracks, title, VIEW)
    for at, value in wanted.items():
        tiles.draw(*at, series.text(value), orbits[at], side=side)
    return save(figure, path, _HEADER, _points(series, tracks, wanted.values()))


def orbit_gallery(series: Sequence[Series], path: Path) -> Path:
    """One tile per series of a campaign, for orbits that no sweep joins: their first ones, of all performers."""
    look = styles([track.entries[0] for one in series for track in one.tracks])
    columns = min(_FEW, len(series))
    tracks = {track.performer: track for one in series for track in one.tracks}
    title = f"{series[0].campaign}: path of the tip"
    legend = [(tracks[name], style) for name, style in look.items()]
    figure, tiles = _page(-(-len(series) // columns), columns, _GALLERY, legend, title, VIEW)
    data: list[Sequence[Any]] = []
    for number, one in enumerate(series):
        value, pairs = one.values[0], [(track, look[track.performer]) for track in one.tracks]
        label = "\n".join([one.text(value), *one.label.split(", ")])
        tiles.draw(*divmod(number, columns), label, [Orbit.at(track, value, style) for track, style in pairs])
        data += _points(one, pairs, [value])
    return save(figure, path, _HEADER, data, dpi=120)


def _page(
    rows: int, columns: int, side: float, tracks: Sequence[tuple[Track, Style]], title: str, note: str
) -> tuple[Any, Tiles]:
    """Figure with room for square tiles of ``side`` inches, its title, legend and note."""
    from matplotlib.lines import Line2D

    above, below, least = 0.4, 0.65, 8.5
    height, width = rows * side + above + below, max(columns * side, least)
    figure = pyplot().figure(figsize=(width, height))
    tiles = Tiles(figure.add_axes((0.0, below / height, 1.0, rows * side / height)), rows, columns)
    lines = [
        Line2D([], [], color=style.colour, ls=style.line, label=style.label, **(OTHERS if number else FIRST))
        for number, (_, style) in enumerate(tracks)
    ]
    figure.legend(handles=lines, loc="lower center", bbox_to_anchor=(0.5, 0.22 / height), ncols=3, frameon=False)
    figure.text(0.5, 0.08 / height, note, ha="center", va="bottom", fontsize=7, color="#444444")
    figure.text(0.5, 1.0 - 0.12 / height, title, ha="center", va="top", fontsize=11)
    return figure, tiles


def _ground(orbits: Sequence[Orbit]) -> str:
    ratios = [orbit.ratio for orbit in orbits]
    if abs(ratios[0]) <= LINE_LIKE:
        return _GREY
    return _RED if len(ratios) > 1 and ratios[0] * ratios[1] < 0.0 else _PLAIN


def _points(series: Series, tracks: Sequence[tuple[Track, Style]], values: Iterable[float]) -> list[Sequence[Any]]:
    wanted = set(values)
    return [
        (series.label, series.name, series.unit, f"{shown:.9g}", track.performer, f"{y:.5g}", f"{z:.5g}")
        for track, _ in tracks
        for value, shown, entry in zip(track.values, series.shown(track.values), track.entries, strict=True)
        if value in wanted and (path := path_of(entry)) is not None
        for y, z in np.asarray(path)
    ]
