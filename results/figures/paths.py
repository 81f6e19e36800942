"""How paths of the tip are drawn: as one sees them from the tip towards the clamp, with arrows along the travel."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.experiments import BaseShake
from lab.orbits import LINE, sense
from results.accuracy import Entry
from results.figures.canvas import Style
from results.orbit_series import Track

Array = NDArray[np.float64]

#: Said wherever paths are drawn.
VIEW = "seen from the tip towards the clamp, y up, z to the left: right-handed travel is counter-clockwise"
#: Turning arrow by sense of travel.
_GLYPHS = {1: "\u21ba", -1: "\u21bb", 0: "\u2013"}
#: Corners of an arrowhead, the tip first: across and along its way, about its own middle.
_HEAD = ((0.0, 0.6), (0.33, -0.4), (0.0, -0.2), (-0.33, -0.4))
#: Size of the first path's arrowheads and of the others', tiles.
_HEADS = (0.085, 0.06)
#: Where they stand after the fastest place, periods: apart on thin orbits too, and none hides another.
_SHARES = ((0.07, 0.57), (0.88, 0.38))
#: Lines of the first path of a tile, broad and pale so that dashes that follow it stay visible, and of the others.
FIRST: Mapping[str, Any] = {"lw": 2.4, "alpha": 0.45}
OTHERS: Mapping[str, Any] = {"lw": 1.1}
#: Share of a tile's side that its largest path fills.
_FILLED = 0.8


@dataclass(frozen=True)
class Orbit:
    """One performer's path at one swept value.

    Parameters
    ----------
    path
        (samples, 2), y and z in mm, the last sample equal to the first; None without a result.
    ratio
        Signed ratio of its axes; NaN without a result.
    style
        How it looks.
    """

    path: Array | None
    ratio: float
    style: Style

    @classmethod
    def at(cls, track: Track, value: float, style: Style) -> "Orbit":
        """The orbit of a track at a swept value; without a path where the track does not have the value."""
        place = track.place(value)
        if place is None:
            return cls(None, np.nan, style)
        return cls(path_of(track.entries[place]), float(track.axis_ratio[place]), style)


def path_of(entry: Entry) -> Array | None:
    """Path of the mean marker of a shaken beam (samples, 2), y and z in mm; None without a result."""
    if not entry.record.completed or not isinstance(entry.experiment, BaseShake):
        return None
    path: Array = 1e3 * entry.experiment.path(entry.record)
    return path


def extent(orbits: Sequence[Orbit]) -> float:
    """Side of the smallest upright square that holds all paths, mm."""
    paths = [orbit.path for orbit in orbits if orbit.path is not None]
    return max(float(np.ptp(np.vstack(paths), axis=0).max()), 1e-3) if paths else 1e-3


class Tiles:
    """Unit squares in one pair of axes, which are drawn much faster than as many pairs.

    Parameters
    ----------
    axis
        Where to draw; it loses its ticks and spines.
    rows, columns
        Number of tiles.
    """

    def __init__(self, axis: Any, rows: int, columns: int) -> None:
        self._axis, self._rows = axis, rows
        axis.set(xlim=(0, columns), ylim=(0, rows), aspect="equal")
        axis.axis("off")

    def draw(
        self, row: int, column: int, label: str, orbits: Sequence[Orbit], ground: str = "white", edge: str = "#bbbbbb",
        side: float | None = None,
    ) -> None:  # fmt: skip
        """Paths of several performers in one tile, the first one's broad below, with a scale bar and turning arrows.

        Parameters
        ----------
        ground, edge
            Colours of the tile.
        side
            Extent that the tile shall hold, mm; that of its own paths when left out.
        """
        from matplotlib.patches import Rectangle

        corner = np.array([float(column), float(self._rows - 1 - row)])
        self._axis.add_patch(Rectangle((corner[0] + 0.02, corner[1] + 0.02), 0.96, 0.96, fc=ground, ec=edge, lw=0.8))
        self._axis.text(*(corner + [0.06, 0.94]), label, ha="left", va="top", fontsize=8, weight="bold")
        for number, orbit in enumerate(reversed(orbits)):
            self._glyph(corner + [0.95 - 0.1 * number, 0.955], orbit)
        paths = [orbit.path for orbit in orbits if orbit.path is not None]
        if not paths:
            self._axis.text(*(corner + 0.5), "no result", ha="center", va="center", color="#aa0000", fontsize=8)
            return
        scale = _FILLED / (side or extent(orbits))
        low, high = np.vstack(paths).min(axis=0), np.vstack(paths).max(axis=0)
        for number, orbit in enumerate(orbits):
            if orbit.path is not None:
                # On the page z runs to the left.
                flat = ((orbit.path - (low + high) / 2.0) * scale)[:, ::-1] * [-1.0, 1.0]
                self._path(flat + corner + [0.5, 0.47], orbit, first=number == 0)
        self._scale_bar(corner, scale)

    def _path(self, places: Array, orbit: Orbit, first: bool) -> None:
        """One path, with arrowheads where it is fast; none on a line, which has no sense."""
        style, order = orbit.style, 2 if first else 3
        self._axis.plot(*places.T, style.line, color=style.colour, zorder=order, **(FIRST if first else OTHERS))
        if abs(orbit.ratio) < LINE:
            return
        steps = np.diff(places, axis=0)
        fastest = int(np.argmax(np.linalg.norm(steps, axis=1)))
        for share in _SHARES[not first]:
            at = (fastest + round(share * len(steps))) % len(steps)
            self._head(places[at], steps[at], style.colour, _HEADS[not first], order)

    def _head(self, place: Array, way: Array, colour: str, size: float, order: int) -> None:
        from matplotlib.patches import Polygon

        along = way / np.linalg.norm(way)
        across = np.array([-along[1], along[0]])
        corners = place + size * (np.array(_HEAD) @ np.stack([across, along]))
        self._axis.add_patch(Polygon(corners, fc=colour, ec="white", lw=0.4, zorder=order + 2))

    def _glyph(self, place: Array, orbit: Orbit) -> None:
        text = _GLYPHS[sense(orbit.ratio)] if np.isfinite(orbit.ratio) else ""
        self._axis.text(
            *place, text, ha="right", va="top", fontsize=9, color=orbit.style.colour, family="DejaVu Sans"
        )  # fmt: skip

    def _scale_bar(self, corner: Array, scale: float) -> None:
        """Bar of a round length in the lower right corner of a tile; ``scale``: tile per mm."""
        longest = 0.35 / scale
        power = 10.0 ** np.floor(np.log10(longest))
        length = max(step * power for step in (1.0, 2.0, 5.0) if step * power <= longest)
        x, y = corner + [0.95, 0.07]
        self._axis.plot([x - length * scale, x], [y, y], color="#444444", lw=1.2)
        self._axis.text(x, y + 0.02, f"{length:g} mm", ha="right", va="bottom", fontsize=6, color="#444444")
