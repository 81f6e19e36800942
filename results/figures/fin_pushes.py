"""A plate pushes the fin both ways: force against push, and limit loads over the flattening (fig. 4.5a, b, c)."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from lab.published import figures
from results.figures.canvas import COLOURS, pyplot, save
from results.fin_states import FITTED, SENSES, FinState, FinStates, pushing
from results.fins import full_pinch

_HEADER = ("device", "performer", "origin", "sense", "pinch_mm", "status", "push_mm", "force_N")
_LIMITS = (
    "device", "performer", "origin", "sense", "pinch_mm", "flat", "force_max_N", "limit_load_N", "K_Nm_per_rad",
    "K_law_Nm_per_rad",
)  # fmt: skip
_LAB = {"opposite": "c4-f-opposite", "equal": "c4-f-equal"}
_WORDS = {"opposite": "opposite sense (power stroke)", "equal": "equal sense (recovery stroke)"}
_COLOUR = {"opposite": COLOURS[1], "equal": COLOURS[2]}
#: Beyond this factor of our largest force the lab's is not drawn.
_FAR = 4.0
_NOTE = "ring: first peak, where the fin gives way; dashed: largest force in the lab over five pressures"


def push_curves(groups: Sequence[FinStates], title: str, path: Path) -> Path:
    """Force against push, one panel for each sense on its own scale.

    Lines are the states of flattening of one device, or of several devices.
    """
    lines = [(found, state) for found in groups for state in found.states]
    height = 4.6 if len(groups) == 1 else 4.6 + 0.1 * len(lines)
    figure, axes = pyplot().subplots(1, 2, figsize=(12, height), layout="constrained")
    shades = pyplot().get_cmap("viridis")(np.linspace(0.0, 0.9, len(lines)))
    data: list[Sequence[Any]] = []
    for axis, sense in zip(axes, SENSES, strict=True):
        for (found, state), shade in zip(lines, shades, strict=True):
            if sense in state.pushes:
                label = f"pinched by {1e3 * state.travel:.3g} mm"
                data += _draw(axis, found, state, sense, shade, label if len(groups) == 1 else found.label)
        largest = [found.largest(sense) for found in groups]
        _add_lab(axis, sense, max((force for force in largest if np.isfinite(force)), default=np.nan))
        axis.axhline(0.0, color="black", lw=0.6)
        axis.set(title=_WORDS[sense], xlabel="push [mm]", ylabel="force of the plate [N]")
        axis.grid(alpha=0.3)
        if len(groups) == 1:
            axis.legend(frameon=False, fontsize=8)
    if len(groups) > 1:
        told = [pair for axis in axes for pair in zip(*axis.get_legend_handles_labels(), strict=True)]
        by_label = {label: handle for handle, label in told}
        figure.legend(
            by_label.values(), by_label.keys(), loc="outside lower center", ncols=2, frameon=False, fontsize=8
        )  # fmt: skip
    figure.suptitle(f"{title}\n{_NOTE}", fontsize=9)
    return save(figure, path, _HEADER, data)


def _add_lab(axis: Any, sense: str, ours: float) -> None:
    """The lab's largest force as a line, or in words alone where it would press our curves flat."""
    lab = float(figures()[_LAB[sense]]["value"])
    look, label = {"color": "#999999", "ls": (0, (6, 3)), "lw": 1.6}, f"lab, largest: {lab:g} N"
    if lab > _FAR * ours:
        axis.plot([], [], label=f"{label}, off the scale", **look)
    else:
        axis.axhline(lab, label=label, **look)


def _draw(
    axis: Any, found: FinStates, state: FinState, sense: str, shade: Any, label: str
) -> list[Sequence[Any]]:  # fmt: skip
    record = state.pushes[sense].entry.record
    if not {"stage", "push", "force"} <= set(record.channels):
        return []
    places = pushing(record)
    way, force = 1e3 * record["push"][places], record["force"][places]
    axis.plot(way, force, color=shade, lw=1.5, label=label)
    at, limit = state.number(sense, "push_at_limit"), state.number(sense, "limit_load")
    if np.isfinite(at):
        axis.plot(1e3 * at, limit, "o", color=shade, mfc="white", ms=6, zorder=4)
    if not record.completed and len(places):
        axis.plot(way[-1], force[-1], "x", color=shade, ms=7, mew=1.6)
    about = (found.label, found.performer, found.origin, sense, f"{1e3 * state.travel:.6g}", record.status)
    return [(*about, f"{w:.6g}", f"{f:.6g}") for w, f in zip(way, force, strict=True)]


def limit_loads(groups: Sequence[FinStates], title: str, path: Path) -> Path:
    """Largest forces and initial stiffness in both senses over the flattening, with the two-term law of 4.5.3."""
    figure, axes = pyplot().subplots(1, 2, figsize=(12, 4.6), layout="constrained")
    data: list[Sequence[Any]] = []
    marks = ("o", "s", "^", "D", "v")
    for found, mark in zip(groups, np.resize(marks, len(groups)), strict=True):
        pinch = 1e3 * full_pinch() * found.shares
        dense = np.linspace(float(np.nanmin(found.shares)), float(np.nanmax(found.shares)), 101)
        for sense in SENSES:
            largest, limit = found.numbers(sense, "force_max"), found.numbers(sense, "limit_load")
            stiffness = found.numbers(sense, "torsional_stiffness")
            label = f"{sense}, {found.title}"
            axes[0].plot(pinch, largest, marker=mark, ms=5, lw=1.2, color=_COLOUR[sense], label=label)
            axes[1].plot(pinch, stiffness, ls="", marker=mark, ms=5, color=_COLOUR[sense], label=label)
            law = found.laws.get((sense, "torsional_stiffness"))
            if law is not None:
                words = f"two exponentials, misfit {law.misfit:.1%}, {law.spare} to spare"
                axes[1].plot(1e3 * full_pinch() * dense, law(dense), lw=1.0, color=_COLOUR[sense], label=words)
            smooth = law(found.shares) if law is not None else np.full(len(pinch), np.nan)
            about = (found.label, found.performer, found.origin, sense)
            rows = zip(pinch, found.shares, largest, limit, stiffness, smooth, strict=True)
            data += [(*about, *(f"{n:.6g}" for n in row)) for row in rows]
    for sense, id in _LAB.items():
        lab = float(figures()[id]["value"])
        axes[0].axhline(lab, color=_COLOUR[sense], ls=(0, (6, 3)), lw=1.2, alpha=0.7, label=f"lab, {sense}: {lab:g} N")
    for axis, label in zip(axes, ("largest force [N]", f"initial stiffness [{_unit()}]"), strict=True):
        axis.set(xlabel="approach of top and bottom [mm]", ylabel=label, yscale="log")
        axis.grid(alpha=0.3, which="both")
        axis.legend(frameon=False, fontsize=7)
    figure.suptitle(title, fontsize=9)
    return save(figure, path, _LIMITS, data)


def _unit() -> str:
    return FITTED["torsional_stiffness"].replace("*", " ")
