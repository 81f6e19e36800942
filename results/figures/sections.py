"""Mid-length sections on the way to the closed tube, one tile per sample (figs 3.2, 3.5b)."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.hinge import section_shape
from lab.specimens import PinchedTube
from results.accuracy import Entry
from results.figures.canvas import pyplot, save
from results.figures.pinched import ideal_of, pinching, sample_name

Array = NDArray[np.float64]

_HEADER = ("sample", "performer", "state", "travel_mm", "force_N", "x_mm", "y_mm")
_COLUMNS = 6
#: Shares of the last travel that are shown beside rest and end.
_SHARES = (0.25, 0.5, 0.75, 0.9)
_NOTE = (
    "middle of the wall at mid-length, from rest (grey) over 25, 50, 75 and 90 % of the travel to the end (black); "
    "arrows: pinching forces; lines: largest extent (blue), softest axis (red), ideal axis $\\alpha/2$ (dotted)"
)
_DEFORMATION, _HINGE = "#0072B2", "#D55E00"


def pinch_sections(entries: Sequence[Entry], title: str, path: Path) -> Path:
    """Deformed sections of every sample on one scale, with the axes that come out.

    Parameters
    ----------
    entries
        Records with ``section``, one performer's.
    """
    columns = min(_COLUMNS, len(entries))
    rows = -(-len(entries) // columns)
    size = max(2.15 * columns, 7.5), 2.5 * rows + 0.8
    figure, axes = pyplot().subplots(rows, columns, figsize=size, squeeze=False, layout="constrained")
    data: list[Sequence[Any]] = []
    for axis, entry in zip(axes.flat, entries, strict=False):
        data += _tile(axis, entry)
    for axis in axes.flat:
        axis.axis("off")
    figure.suptitle(f"{title}\n{_NOTE}", fontsize=8, wrap=True)
    return save(figure, path, _HEADER, data)


def _tile(axis: Any, entry: Entry) -> list[Sequence[Any]]:
    record, tube = entry.record, entry.tested()
    assert isinstance(tube, PinchedTube)
    # Where a load moves the tube, the section is looked at from its own middle.
    section = 1e3 * (record["section"] - record["section"].mean(axis=1, keepdims=True))
    shown = _states(record["travel"], pinching(record))
    shades = pyplot().get_cmap("viridis_r")(np.linspace(0.1, 0.9, len(shown)))
    data: list[Sequence[Any]] = []
    for number, place in enumerate(shown):
        first, last = number == 0, number == len(shown) - 1
        colour = "#aaaaaa" if first else "black" if last else shades[number]
        closed = np.vstack([section[place], section[place][:1]])
        axis.plot(*closed.T, color=colour, lw=1.8 if last else 1.0, zorder=3 if last else 2)
        about = (entry.slug, entry.performer, "rest" if first else "end" if last else f"{number}")
        numbers = (1e3 * record["travel"][place], record["force"][place])
        data += [(*about, *(f"{n:.6g}" for n in (*numbers, *point))) for point in section[place]]
    reach = 1e3 * tube.radius
    _arrows(axis, tube, entry, reach)
    reduced = entry.scalars()
    hinge = reduced["hinge_axis"].value if "hinge_axis" in reduced else np.nan
    deformed = section_shape(record["section"][shown[-1]]).axis
    for angle, colour, line in ((deformed, _DEFORMATION, "-"), (hinge, _HINGE, "-"), (ideal_of(entry), "#444444", ":")):
        way = 1.3 * reach * np.array([np.cos(angle), np.sin(angle)])
        axis.plot(*np.stack([-way, way], axis=1), color=colour, ls=line, lw=1.0, zorder=1)
    force = record["force"][pinching(record)]
    status = "" if record.completed else f": {record.status}"
    words = f"{sample_name(entry.slug)}{status}\n$F_p$ {force[-1]:.3g} N, most {force.max():.3g} N"
    axis.set_title(words, fontsize=8)
    axis.set(aspect="equal", xlim=(-1.75 * reach, 1.75 * reach), ylim=(-1.6 * reach, 1.6 * reach))
    return data


def _states(travel: Array, places: NDArray[np.int64]) -> list[int]:
    """Rest, the states nearest to some shares of the travel, and the end."""
    aims = [np.argmin(np.abs(travel[places] - share * travel[places[-1]])) for share in _SHARES]
    return list(dict.fromkeys(int(i) for i in (places[0], *places[aims], places[-1])))


def _arrows(axis: Any, tube: PinchedTube, entry: Entry, reach: float) -> None:
    experiment: Any = entry.experiment
    shares = experiment.shares(tube.pairs)
    for angle, share in zip(tube.pad_directions(), np.tile(shares, 2), strict=True):
        if share:
            out = np.array([np.cos(angle), np.sin(angle)])
            length = 0.45 * share / shares.max()
            head = {"arrowstyle": "-|>", "lw": 1.0, "color": "#444444", "shrinkA": 0, "shrinkB": 0}
            axis.annotate("", 1.12 * reach * out, xytext=(1.12 + length) * reach * out, arrowprops=head)
