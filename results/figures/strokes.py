"""Where the fins go in a stroke: power stroke to the right, recovery to the left (fig. 4.6f, g)."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.experiments import PaddleThrust
from lab.specimens import FinnedTube
from results.accuracy import Entry
from results.figures.canvas import pyplot, save
from results.paddling import CASES, carries

Array = NDArray[np.float64]

_HEADER = ("performer", "origin", "load_fin", "stroke", "time_s", "joint", "x_mm", "z_mm")
_NOTE = (
    "right: power stroke, left: recovery, mirrored; from dark to bright in {steps} even steps of the tip's way; thick: "
    "the fin's proximal part, thin: the distal one with what it carries; forward is downwards"
)
_STEPS = 9


def stroke_shapes(entries: Sequence[Entry], title: str, path: Path) -> Path:
    """Links of the fin over the last cycle, a row for each state of the load fin and a column for each performer.

    Parameters
    ----------
    entries
        ``PaddleThrust`` whose records tell ``hinge_share`` among their parameters.
    """
    performers = list(dict.fromkeys(entry.performer for entry in entries))
    cases = [case for case in CASES if any(carries(entry) is case for entry in entries)]
    size = (max(3.6 * len(performers), 6.0), 3.0 * len(cases) + 0.9)
    figure, axes = pyplot().subplots(len(cases), len(performers), figsize=size, squeeze=False, layout="constrained")
    data: list[Sequence[Any]] = []
    for axis in axes.flat:
        axis.axis("off")
    for entry in entries:
        axis = axes[cases.index(carries(entry)), performers.index(entry.performer)]
        data += _draw(axis, entry)
    figure.suptitle(f"{title}\n{_NOTE.format(steps=_STEPS)}", fontsize=8, wrap=True)
    return save(figure, path, _HEADER, data)


def has_links(entry: Entry) -> bool:
    """Whether a record tells where its hinge is."""
    return "hinge_share" in entry.record.how.get("parameters", {})


def links(entry: Entry, places: NDArray[np.int64]) -> Array:
    """Root, hinge and end of the fin at +x (n, 3, 2), x and z in m from the body, at these samples (n,)."""
    record, device = entry.record, entry.tested()
    assert isinstance(device, FinnedTube)
    numbers = {name: float(item["value"]) for name, item in record.how["parameters"].items()}
    inner = numbers["hinge_share"] * device.fin_length
    outer = device.fin_length - inner
    if device.load_fin is not None:
        outer += device.load_fin.length * numbers.get("load_reach", 1.0)
    turn = record["fin_angle"][places]
    root = np.stack([device.mid_radius + record["x1"][places], np.full(len(places), device.place)], axis=1)
    hinge = root + inner * _along(turn)
    return np.stack([root, hinge, hinge + outer * _along(turn + record["buckling"][places])], axis=1)


def _evenly(entry: Entry, places: NDArray[np.int64]) -> NDArray[np.int64]:
    """Samples between which the tip goes equally far, the first and the last among them."""
    tip = links(entry, places)[:, -1]
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(tip, axis=0), axis=1))])
    chosen = np.searchsorted(way, np.linspace(0.0, way[-1], _STEPS)).clip(0, len(places) - 1)
    chosen[[0, -1]] = 0, len(places) - 1
    return np.asarray(places[chosen])


def _along(angle: Array) -> Array:
    return np.stack([np.sin(angle), np.cos(angle)], axis=1)


def _draw(axis: Any, entry: Entry) -> list[Sequence[Any]]:
    experiment, time = entry.experiment, entry.record["time"]
    device = entry.tested()
    assert isinstance(experiment, PaddleThrust)
    assert isinstance(device, FinnedTube)
    period = 1.0 / experiment.frequency
    data: list[Sequence[Any]] = []
    begin, valve = time[-1] - period, experiment.duty * period
    tube = 1e3 * np.array([[-1, 0], [1, 0], [1, 1], [-1, 1], [-1, 0]]) * [device.radius, device.length]
    axis.fill(*tube.T, color="#dddddd", zorder=0)
    for stroke, side, shades, span in (("power", 1.0, "Blues_r", (0.0, valve)),
                                       ("recovery", -1.0, "Oranges_r", (valve, period))):  # fmt: skip
        places = _evenly(entry, np.flatnonzero((time >= begin + span[0] - 1e-9) & (time <= begin + span[1] + 1e-9)))
        shapes = 1e3 * links(entry, places) * [side, 1.0]
        colours = pyplot().get_cmap(shades)(np.linspace(0.05, 0.75, _STEPS))
        for place, shape, colour in zip(places, shapes, colours, strict=True):
            axis.plot(*shape[:2].T, color=colour, lw=2.6, solid_capstyle="round")
            axis.plot(*shape[1:].T, color=colour, lw=1.3, solid_capstyle="round")
            about = (entry.performer, entry.record.origin, carries(entry), stroke, f"{time[place]:.6g}")
            data += [(*about, joint, *(f"{c:.6g}" for c in at)) for joint, at in zip(("root", "hinge", "end"), shape,
                                                                                 strict=True)]  # fmt: skip
    numbers = entry.scalars()
    bent = [np.rad2deg(numbers[f"buckling_{end}"].value) for end in ("max", "min")]
    fitted = ", fitted" if entry.seen is not None else ""
    axis.set_title(
        f"{entry.performer} ({entry.record.origin}{fitted}), {CASES[carries(entry)]}\nbends by {bent[0]:.2g} and "
        f"{bent[1]:.2g} deg", fontsize=7,
    )  # fmt: skip
    axis.set_aspect("equal")
    return data
