"""Natural frequencies over the twist, of every performer and by beam theory."""

from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.beam_theory import natural_modes
from lab.experiments import NaturalModes
from lab.specimens import TwistedBeam
from results.accuracy import Entry
from results.figures.canvas import Style, pyplot, save, styles

Array = NDArray[np.float64]

THEORY = "beam theory"
#: Marker by the kind of a mode.
_MARKERS = {"bending": "o", "torsion": "^", "stretch": "s", "mixed": "D"}
#: Twists between the samples' ends at which the theory is drawn, beside theirs.
_FINE = 37
_HEADER = ("performer", "origin", "twist_deg", "mode", "kind", "frequency_hz", "theory_hz")


def modes_over_twist(entries: Sequence[Entry], title: str, path: Path) -> Path:
    """Frequency of every mode over the twist; markers tell bending, torsion and stretch, lines are beam theory.

    Parameters
    ----------
    entries
        ``NaturalModes`` of one beam with several twists, without holes.
    """
    from matplotlib.lines import Line2D

    plt, look = pyplot(), styles(entries)
    first = entries[0]
    figure, axis = plt.subplots(figsize=(9.5, 6.2), layout="constrained")
    twists = np.array([_twist(entry) for entry in entries])
    count = max(len(entry.record["frequency"]) for entry in entries)
    fine = np.union1d(twists, np.linspace(twists.min(), twists.max(), _FINE))
    lines = np.array([_theory(first, twist, count) for twist in fine])
    axis.plot(np.degrees(fine), lines, color="#999999", lw=2.2, zorder=1)
    data: list[Sequence[Any]] = []
    for number, (performer, style) in enumerate(look.items()):
        for entry in (e for e in entries if e.performer == performer):
            data += _draw(axis, entry, style, size=4.5 + 1.5 * (number % 3))
    kinds = list(dict.fromkeys(row[4] for row in data))
    handles = [Line2D([], [], color="#999999", lw=2.2, label=THEORY)]
    handles += [Line2D([], [], color=s.colour, marker="o", mfc=s.face, ls="", label=s.label) for s in look.values()]
    handles += [Line2D([], [], color="#666666", marker=_MARKERS[kind], ls="", label=kind) for kind in kinds]
    axis.set(xlabel="twist [deg]", ylabel="natural frequency [Hz]", yscale="log")
    axis.yaxis.set_major_formatter("{x:g}")
    axis.yaxis.set_minor_formatter("{x:g}")
    axis.tick_params(axis="y", which="both", labelsize=8)
    axis.grid(alpha=0.3, which="both")
    axis.set_title(title)
    figure.legend(handles=handles, loc="outside lower center", ncols=4, frameon=False)
    return save(figure, path, _HEADER, data)


def _draw(axis: Any, entry: Entry, style: Style, size: float) -> list[Sequence[Any]]:
    frequencies, kinds = entry.record["frequency"], NaturalModes.kinds(entry.record)
    twist, theory = _twist(entry), _theory(entry, _twist(entry), len(frequencies))
    for frequency, kind in zip(frequencies, kinds, strict=True):
        look = {"color": style.colour, "mfc": style.face, "ms": size, "mew": 1.0}
        axis.plot(np.degrees(twist), frequency, _MARKERS[kind], **look)
    return [
        (entry.performer, entry.record.origin, f"{np.degrees(twist):.6g}", number, kind, f"{own:.6g}", f"{other:.6g}")
        for number, (kind, own, other) in enumerate(zip(kinds, frequencies, theory, strict=True), 1)
    ]


def _twist(entry: Entry) -> float:
    return float(entry.record.specimen["twist"])


def _theory(entry: Entry, twist: float, count: int) -> tuple[float, ...]:
    return _frequencies(TwistedBeam.model_validate({**entry.record.specimen, "twist": twist}), count)


@cache
def _frequencies(specimen: TwistedBeam, count: int) -> tuple[float, ...]:
    return tuple(mode.frequency for mode in natural_modes(specimen, count))
