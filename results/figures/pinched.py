"""What the figures of tubes share: how samples look, and which increments belong to which stage."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.experiments.pinch_drive import STAGES
from lab.pinching import axis_difference, ideal_axis
from lab.records import Record
from results.accuracy import Entry
from results.figures.canvas import COLOURS, pyplot
from results.slugs import words

Array = NDArray[np.float64]

#: The dissertation's letters for angles, each in its own chapter.
_GREEK = {"pinch_angle": "\u03b1", "fin_arc": "\u03b1", "attachment_angle": "\u03b8"}
#: Lines of PRB models in their order, which are dashed, and of others.
_DASHED: tuple[Any, ...] = ("--", ":", "-.")
_SOLID: tuple[Any, ...] = ("-", (0, (9, 2)), (0, (9, 2, 2, 2)))


@dataclass(frozen=True)
class Look:
    """Colour by sample, line by performer; colour by performer where there is one sample alone."""

    colours: dict[str, Any]
    names: dict[str, str]
    lines: dict[str, Any]
    labels: dict[str, str]

    @classmethod
    def of(cls, entries: Sequence[Entry]) -> "Look":
        """Look of the entries of a campaign; samples that are too many for the palette go from dark to bright."""
        slugs = list(dict.fromkeys(entry.slug for entry in entries))
        origins = {entry.performer: entry.record.origin for entry in entries}
        kinds = {name: [n for n in origins if (origins[n] == "prb") == (origins[name] == "prb")] for name in origins}
        lines = {n: (_DASHED if origin == "prb" else _SOLID)[kinds[n].index(n) % 3] for n, origin in origins.items()}
        return cls(
            _palette(list(origins) if len(slugs) == 1 < len(origins) else slugs),
            {slug: sample_name(slug) for slug in slugs},
            lines,
            {name: f"{name} ({origin})" for name, origin in origins.items()},
        )

    def line(self, entry: Entry) -> dict[str, Any]:
        """Keywords of an entry's line."""
        return {"color": self.colour(entry), "ls": self.lines[entry.performer]}

    def colour(self, entry: Entry) -> Any:
        """Of an entry's line and marks."""
        return self.colours.get(entry.slug, self.colours.get(entry.performer))

    def handles(self) -> list[Any]:
        """For a legend: the samples, then the performers where there are several."""
        from matplotlib.lines import Line2D

        samples = [
            Line2D([], [], color=self.colours[slug], label=name)
            for slug, name in self.names.items()
            if slug in self.colours
        ]
        performers = [
            Line2D([], [], color=self.colours.get(name, "#555555"), ls=line, label=self.labels[name])
            for name, line in self.lines.items()
        ]
        return samples + (performers if len(performers) > 1 else [])


def _palette(names: Sequence[str]) -> dict[str, Any]:
    """A colour each; more than there are colours go from dark to bright."""
    shades = pyplot().get_cmap("viridis")(np.linspace(0.0, 0.95, len(names)))
    return {name: COLOURS[i] if len(names) <= len(COLOURS) else shades[i] for i, name in enumerate(names)}


def sample_name(slug: str) -> str:
    """A slug for a legend: ``pinch_angle=30deg_law=even`` is ``α 30°, law even``."""
    told = words(slug)
    if not told:
        return slug.replace("_", " ")
    return ", ".join(_told(name, value) for name, value in told.items())


def _told(name: str, value: str) -> str:
    if name in _GREEK:
        return f"{_GREEK[name]} {value.removesuffix('deg')}\u00b0"
    shown = name.replace("_", " ")
    return {"True": shown, "False": f"not {shown}"}.get(value, f"{shown} {value}")


def during(record: Record, *stages: str) -> NDArray[np.int64]:
    """Places of the increments of these stages, in their order."""
    return np.flatnonzero(np.isin(record["stage"], [STAGES.index(name) for name in stages]))


def pinching(record: Record) -> NDArray[np.int64]:
    """Places of the increments of the pinch, with the state that it starts from."""
    found = during(record, "pinch")
    return np.concatenate([found[:1] - 1, found]) if len(found) and found[0] else found


def ideal_of(entry: Entry) -> float:
    """alpha / 2, rad; NaN where forces follow no pinch angle."""
    experiment: Any = entry.experiment
    return ideal_axis(experiment.pinch_angle) if experiment.pair_forces is None else float("nan")


def axis_errors(axes: Array, ideal: float) -> Array:
    """Angles of lines (n,) from the ideal one, rad, without jumps of half a turn; NaN where a line is not defined."""
    return np.array([axis_difference(axis, ideal) for axis in axes])
