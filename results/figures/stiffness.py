"""Figures of the static test: main entries of K' beside the measured ones and over the twist, and forces."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from lab.experiments import KPRIME_ENTRIES
from lab.records import Scalar
from results.accuracy import Entry, Row
from results.figures.canvas import COLOURS, Style, pyplot, save, styles

BARS = ("k_yy", "k_zz", "k_yz", "k_zy", "n_xx")
#: Colour of measured points.
_LAB = "#F0E442"


@dataclass(frozen=True)
class Measured:
    """A row of a lab table as the study reads it.

    Parameters
    ----------
    table
        Name in the study.
    phi
        Published twist, deg.
    twist, root_angle
        Of the specimen that stands for it, rad.
    values
        Entries of K', SI.
    """

    table: str
    phi: float
    twist: float
    root_angle: float
    values: Mapping[str, Scalar]


def stiffness_bars(rows: Sequence[Row], title: str, path: Path) -> Path:
    """Main entries of K' of every model beside the measured ones."""
    plt = pyplot()
    rows = [row for row in rows if row.quantity in BARS]
    samples = list(dict.fromkeys(row.sample for row in rows))
    models = [
        m for m in dict.fromkeys(row.model for row in rows) if any(r.value == r.value for r in rows if r.model == m)
    ]
    value = {(row.model, row.quantity, row.sample): row.value for row in rows}
    value |= {("lab", row.quantity, row.sample): row.reference_value for row in rows}
    unit = {row.quantity: row.unit for row in rows}
    figure, axes = plt.subplots(1, len(BARS), figsize=(15, 3.8), layout="constrained")
    width = 0.8 / (len(models) + 1)
    for axis, quantity in zip(axes, BARS, strict=True):
        for i, model in enumerate(["lab", *models]):
            heights = [value.get((model, quantity, sample), np.nan) for sample in samples]
            places = np.arange(len(samples)) + (i - len(models) / 2) * width
            axis.bar(
                places, heights, width, color=COLOURS[i % len(COLOURS)], label=f"{model} (measured)" if not i else model
            )
        axis.set_title(f"{quantity} [{unit[quantity]}]")
        axis.set_xticks(
            range(len(samples)), [s.split(":")[0].removeprefix("phi ").replace(" deg", "°") for s in samples]
        )
        axis.set_xlabel("published twist")
        axis.axhline(0, color="black", linewidth=0.6)
    figure.legend(
        *axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=len(models) + 1, frameon=False
    )
    figure.suptitle(title)
    data = [(m, q, s, unit[q], value.get((m, q, s))) for m in ["lab", *models] for q in BARS for s in samples]
    return save(figure, path, ("model", "quantity", "sample", "unit", "value"), data)


def force_curves(entries: Sequence[Entry], title: str, path: Path) -> Path:
    """Reaction against motion for the two translations and the rotation, one line per sample."""
    plt = pyplot()
    figure, axes = plt.subplots(1, 3, figsize=(12, 3.6), layout="constrained")
    data = []
    panels = (
        (1, "X_y [mm]", "F_y [N]", 1e3),
        (2, "X_z [mm]", "F_z [N]", 1e3),
        (3, "theta_x [deg]", "M_x [N m]", 180 / np.pi),
    )
    for axis, (dof, x_label, y_label, factor) in zip(axes, panels, strict=True):
        for i, entry in enumerate(entries):
            motion, wrench = entry.record["motion"], entry.record["wrench"]
            mine = np.flatnonzero(motion[:, dof])
            order = mine[np.argsort(motion[mine, dof])]
            x, y = motion[order, dof] * factor, wrench[order, dof]
            axis.plot(x, y, ".-", color=COLOURS[i % len(COLOURS)], label=entry.slug, linewidth=1)
            data += [(entry.slug, x_label, a, y_label, b) for a, b in zip(x, y, strict=True)]
        axis.set(xlabel=x_label, ylabel=y_label)
        axis.grid(alpha=0.3)
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside right center", frameon=False)
    figure.suptitle(title)
    return save(figure, path, ("sample", "motion", "value", "reaction", "value"), data)


def stiffness_over_twist(entries: Sequence[Entry], measured: Sequence[Measured], title: str, path: Path) -> Path:
    """Main entries of K' over the twist, one line per performer and clamp angle, with the rows of a lab table.

    A turned clamp exchanges k_yy and k_zz: its samples and rows have crosses and a dotted line.
    """
    from matplotlib.lines import Line2D

    look, units = styles(entries), dict(KPRIME_ENTRIES)
    figure, axes = pyplot().subplots(2, 3, figsize=(13, 7), layout="constrained")
    data: list[Sequence[Any]] = []
    for axis, name in zip(axes.flat, BARS, strict=False):
        for performer, style in look.items():
            for angle in sorted({_angle(e) for e in entries if e.performer == performer}):
                mine = [e for e in entries if e.performer == performer and _angle(e) == angle]
                data += _draw_line(axis, name, mine, style, angle)
        for row in measured:
            marker = "X" if row.root_angle else "o"
            value = row.values[name].value
            axis.plot(np.degrees(row.twist), value, marker, color=_LAB, ms=8, mec="black", mew=0.8, zorder=4)
            data.append(_cells(row.table, "lab", row.twist, row.root_angle, name, value, f"published phi {row.phi:g}"))
        axis.set(title=f"{name} [{units[name]}]", xlabel="twist [deg]")
        axis.axhline(0.0, color="black", lw=0.6)
        axis.grid(alpha=0.3)
    without = {entry.performer for entry in entries} - {entry.performer for entry in entries if entry.record.completed}
    handles = [
        Line2D([], [], color=s.colour, ls=s.line, label=f"{s.label}: no result" if name in without else s.label)
        for name, s in look.items()
    ]
    if measured:
        handles.append(
            Line2D([], [], color=_LAB, mec="black", marker="o", ls="", ms=8, label=f"{measured[0].table} (lab)")
        )
    if any(_angle(entry) for entry in entries):
        handles.append(Line2D([], [], color="#444444", marker="X", ls=":", label="clamp turned (models and lab)"))
    axes.flat[-1].axis("off")
    axes.flat[-1].legend(handles=handles, loc="center", frameon=False)
    figure.suptitle(title)
    header = ("source", "origin", "twist_deg", "root_angle_deg", "entry", "unit", "value", "note")
    return save(figure, path, header, data)


def _draw_line(axis: Any, name: str, entries: Sequence[Entry], style: Style, angle: float) -> list[Sequence[Any]]:
    """One performer at one clamp angle (deg); return the rows of its data."""
    found = sorted((_twist(e), e.scalars()[name].value) for e in entries if e.record.completed)
    line, marker = (":", "x") if angle else (style.line, ".")
    twists, values = np.degrees([t for t, _ in found]), [v for _, v in found]
    # Two points are no line.
    line = line if len(found) > 2 else "none"
    axis.plot(twists, values, ls=line, marker=marker, ms=5, color=style.colour, lw=1.2)
    origin = entries[0].record.origin
    return [_cells(entries[0].performer, origin, twist, np.radians(angle), name, value) for twist, value in found]


def _cells(
    source: str, origin: str, twist: float, angle: float, name: str, value: float, note: str = ""
) -> Sequence[Any]:
    unit = dict(KPRIME_ENTRIES)[name]
    return (source, origin, f"{np.degrees(twist):.6g}", f"{np.degrees(angle):.6g}", name, unit, f"{value:.6g}", note)


def _twist(entry: Entry) -> float:
    return float(entry.record.specimen["twist"])


def _angle(entry: Entry) -> float:
    """How the clamp is turned, deg."""
    return round(float(np.degrees(entry.record.specimen["root_angle"])), 6)
