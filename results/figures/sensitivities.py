"""What follows from every assumption, one at a time, beside what the lab measured."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from results.benches import text_of, words_of
from results.figures.canvas import COLOURS, pyplot, save
from results.sensitivity import Sensitivity

#: Panels beside each other.
_COLUMNS = 3
_HEADER = ("tube", "performer", "result", "field", "value", "result_value", "nominal", "lab")


def by_result(found: Sequence[Sensitivity]) -> dict[tuple[str, str, str], list[Sensitivity]]:
    """Sensitivities by tube, performer and result, where there are two fields or more, or the lab has a figure.

    Without PRB models: what is fitted to one tube knows no other.
    """
    groups: dict[tuple[str, str, str], list[Sensitivity]] = {}
    for one in (one for one in found if one.entry.record.origin != "prb"):
        groups.setdefault((one.entry.specimen, one.entry.performer, one.result), []).append(one)
    return {
        key: group for key, group in groups.items() if len(group) > 1 or any(np.isfinite(one.target) for one in group)
    }


def one_at_a_time(groups: Mapping[tuple[str, str, str], Sequence[Sensitivity]], path: Path) -> Path:
    """Every result across, a row per assumption, its values written beside what they lead to.

    Parameters
    ----------
    groups
        As ``by_result`` gives them.
    """
    most, columns = max(len(group) for group in groups.values()), min(_COLUMNS, len(groups))
    rows = -(-len(groups) // columns)
    size = 5.4 * columns, (0.5 * most + 1.3) * rows + 0.3
    figure, axes = pyplot().subplots(rows, columns, figsize=size, squeeze=False, layout="constrained")
    data: list[Sequence[Any]] = []
    for axis, ((tube, performer, result), group) in zip(axes.flat, groups.items(), strict=False):
        for row, one in enumerate(group):
            _draw(axis, row, one)
            data += [_cells(one, place) for place in range(len(one.values))]
        nominal = group[0].results[group[0].nominal]
        axis.axvline(nominal, color="#555555", lw=0.8, ls=":")
        target = next((one.target for one in group if np.isfinite(one.target)), None)
        if target is not None:
            axis.axvline(target, color=COLOURS[2], lw=1.6, ls="--", label=f"lab: {target:.4g}")
            axis.legend(frameon=False, fontsize=8, loc="lower right", bbox_to_anchor=(1.0, 1.0))
        axis.set_yticks(range(len(group)), [words_of(one.path) for one in group])
        axis.set(xlabel=result, ylim=(len(group) - 0.4, -0.7))
        axis.set_title(f"{tube}, {performer}", fontsize=9, loc="left")
        axis.margins(x=0.15)
        axis.grid(alpha=0.3, axis="x")
    for axis in axes.flat[len(groups) :]:
        axis.axis("off")
    figure.suptitle("one assumption at a time; filled: nominal", fontsize=9)
    return save(figure, path, _HEADER, data)


def _draw(axis: Any, row: int, one: Sensitivity) -> None:
    axis.plot(one.results, np.full(len(one.results), row), "-", color=COLOURS[1], lw=1.4, zorder=2)
    # Alternately above and below, since close results would hide each other's words.
    for number, place in enumerate(np.argsort(one.results)):
        value, nominal = one.results[place], place == one.nominal
        face = COLOURS[1] if nominal else "white"
        axis.plot(value, row, "o", color=COLOURS[1], mfc=face, ms=6, zorder=3)
        words, above = text_of(float(one.values[place]), one.quantity), number % 2 == 0
        axis.annotate(words, (value, row), xytext=(0, 6 if above else -6), textcoords="offset points", fontsize=7,
                      ha="center", va="bottom" if above else "top")  # fmt: skip


def _cells(one: Sensitivity, place: int) -> Sequence[Any]:
    value, target = text_of(float(one.values[place]), one.quantity), f"{one.target:.6g}"
    named = (one.entry.specimen, one.entry.performer, one.result, words_of(one.path))
    return (*named, value, f"{one.results[place]:.6g}", "yes" if place == one.nominal else "", target)
