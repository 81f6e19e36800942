"""Thrust over time beside the lab's peaks, and how far the fin buckles (fig. 4.6c to i)."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from lab.experiments import PaddleThrust
from results.accuracy import Entry
from results.figures.canvas import pyplot, save, styles
from results.paddling import CASES, DISSERTATION, LAB, carries, kept, published

_HEADER = ("sample", "performer", "origin", "load_fin", "time_s", "thrust_N", "buckling_deg", "fin_angle_deg", "x1_mm")
_NAMES = ("thrust_max", "thrust_min", "thrust_mean")
_NOTE = "dashed grey: largest, smallest and mean thrust in the lab; dotted: the dissertation's model; shaded: air on"
#: Cycles that are shown: more are the same again.
_CYCLES = 2


def thrust_over_time(entries: Sequence[Entry], title: str, path: Path) -> Path:
    """A column for each state of the load fin: thrust, below it buckling and turn of the fin, over the last cycles.

    Parameters
    ----------
    entries
        ``PaddleThrust`` of a held body, at the published frequency.
    """
    look = styles(entries)
    cases = [case for case in CASES if any(carries(entry) is case for entry in entries)]
    figure, axes = pyplot().subplots(
        2, len(cases), figsize=(6.4 * len(cases), 6.4), sharex="col", squeeze=False, layout="constrained",
        height_ratios=(2, 1),
    )  # fmt: skip
    data: list[Sequence[Any]] = []
    for column, case in enumerate(cases):
        mine = [entry for entry in entries if carries(entry) is case]
        for entry in mine:
            data += _draw(axes[:, column], entry, look[entry.performer])
        _shade(axes[:, column], mine[0])
        _published(axes[0, column], case)
        axes[0, column].set(title=CASES[case], ylabel="thrust [N]" if column == 0 else "")
        _with_legend(axes[0, column], len(mine) + 2)
        axes[1, column].set(xlabel="time [s]", ylabel="angles [deg]" if column == 0 else "")
        for axis in axes[:, column]:
            axis.axhline(0.0, color="black", lw=0.6)
            axis.grid(alpha=0.3)
    _with_legend(axes[1, 0], 2, share=0.15)
    figure.suptitle(f"{title}\n{_NOTE}", fontsize=9)
    return save(figure, path, _HEADER, data)


def _shown(entry: Entry) -> Any:
    """Places of the last cycles."""
    experiment, time = entry.experiment, entry.record["time"]
    assert isinstance(experiment, PaddleThrust)
    places = kept(entry)
    return places[time[places] >= time[-1] - _CYCLES / experiment.frequency - 1e-9]


def _draw(axes: Any, entry: Entry, style: Any) -> list[Sequence[Any]]:
    record, places = entry.record, _shown(entry)
    time, thrust, bent = (record[name][places] for name in ("time", "thrust", "buckling"))
    turn, x1 = np.rad2deg(record["fin_angle"][places]), 1e3 * record["x1"][places]
    numbers = entry.scalars()
    words = ", ".join(f"{numbers[name].value:.3g}" for name in _NAMES)
    axes[0].plot(time, thrust, style.line, color=style.colour, lw=1.4, label=f"{style.label}: {words} N")
    axes[1].plot(time, np.rad2deg(bent), style.line, color=style.colour, lw=1.4, label="distal part against proximal")
    axes[1].plot(time, turn, ":", color=style.colour, lw=1.2, label="proximal part from the tube's axis")
    about = (entry.slug, entry.performer, record.origin, carries(entry))
    columns = (time, thrust, np.rad2deg(bent), turn, x1)
    return [(*about, *(f"{n:.6g}" for n in row)) for row in zip(*columns, strict=True)]


def _with_legend(axis: Any, lines: int, share: float = 0.075) -> None:
    """A legend above the curves, each line a share of their height."""
    low, high = axis.get_ylim()
    axis.set_ylim(low, high + share * lines * (high - low))
    handles, labels = axis.get_legend_handles_labels()
    axis.legend(handles[:lines], labels[:lines], frameon=False, fontsize=7, loc="upper left")


def _shade(axes: Any, entry: Entry) -> None:
    experiment = entry.experiment
    assert isinstance(experiment, PaddleThrust)
    time = entry.record["time"][_shown(entry)]
    period = 1.0 / experiment.frequency
    for number in range(int(np.floor(time[0] / period + 1e-6)), int(np.ceil(time[-1] / period - 1e-6))):
        for axis in axes:
            axis.axvspan(number * period, (number + experiment.duty) * period, color="#56B4E9", alpha=0.12, lw=0)


def _published(axis: Any, load_fin: bool) -> None:
    for of, line, label in ((LAB, (0, (6, 3)), "lab"), (DISSERTATION, ":", "dissertation's model")):
        values = [published(of, load_fin, name) for name in _NAMES]
        known = [value for value in values if np.isfinite(value)]
        words = f"{label}: {', '.join(f'{value:g}' for value in known)} N"
        for number, value in enumerate(known):
            axis.axhline(value, color="#777777", ls=line, lw=1.3, zorder=1, label=words if number == 0 else None)
