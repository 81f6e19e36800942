"""What all figures share: colours, lines, and how a figure and its data are written."""

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from results.accuracy import Entry

#: Okabe and Ito's palette: told apart with every kind of colour vision.
COLOURS = ("#000000", "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#7F7F7F", "#882255", "#44AA99")


def pyplot() -> Any:
    """matplotlib.pyplot without a screen, in the style of all figures."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    plt.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False, "svg.hashsalt": "scram"})
    return plt


def save(figure: Any, path: Path, header: Sequence[str], data: Sequence[Sequence[Any]], dpi: int = 130) -> Path:
    """Write the figure as PNG and the data behind it as CSV beside it, close it, and return its path."""
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=dpi, metadata={"Software": None})
    pyplot().close(figure)
    with open(path.with_suffix(".csv"), "w", newline="", encoding="utf-8") as handle:
        writer = csv.writer(handle, lineterminator="\n")
        writer.writerow(header)
        writer.writerows(data)
    return path


@dataclass(frozen=True)
class Style:
    """How a performer's lines look in every figure of a campaign: dashed where it is a PRB model."""

    colour: str
    dashed: bool
    label: str

    @property
    def line(self) -> str:
        """Line style as matplotlib writes it."""
        return "--" if self.dashed else "-"

    @property
    def face(self) -> str:
        """Filling of markers: none where the line is dashed, so that others show through."""
        return "none" if self.dashed else self.colour


def styles(entries: Sequence[Entry]) -> dict[str, Style]:
    """Style by performer, in their order."""
    origins = {entry.performer: entry.record.origin for entry in entries}
    return {
        name: Style(COLOURS[i % len(COLOURS)], origin == "prb", f"{name} ({origin})")
        for i, (name, origin) in enumerate(origins.items())
    }
