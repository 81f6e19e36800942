"""Axis of the pinched section and force to close it over a whole turn of the pinch angle (fig. 3.2d)."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from lab.pinching import axis_difference, first_order, ideal_axis, pair_shares
from lab.published import figures
from results.figures.canvas import Style, pyplot, save, styles
from results.pinch_series import Design, PinchSeries

#: Quantity, marker and its size, and words; squares may stand on rings: they are larger.
_AXES = (
    ("hinge_axis", "s", 8.0, "axis of least bending stiffness"),
    ("deformation_axis", "o", 5.0, "line of largest extent of the section"),
)
_IDEAL, _THEORY, _TEXT = "#999999", "#009E73", "#CC79A7"
#: Angles of the theory's lines over a turn, and of its rows in the data.
_FINE, _ROWS = 721, 24
#: Errors of an axis about a mirror of tube and forces above which the shape's mirror image is drawn too, rad.
_BROKEN = np.radians(2.0)
_HEADER = (
    "source", "origin", "alpha_deg", "computed_at_deg", "deformation_axis_deg", "hinge_axis_deg", "ideal_deg",
    "closing_force_N", "over_alpha_0",
)  # fmt: skip


def axes_over_turn(series: Sequence[PinchSeries], title: str, path: Path) -> Path:
    """Radar of both axes against the pinch angle, their errors, and the closing force over that at alpha = 0.

    Computed designs are filled, their images by the symmetry of the tube are hollow; lines are first-order theory
    (``lab.pinching.first_order``).  Where tube and forces have a mirror and the shape has not, crosses show the
    shape's mirror image, which is as good a solution.

    Parameters
    ----------
    series
        Of the same pinches, one per performer.
    """
    figure = pyplot().figure(figsize=(13.5, 6.8), layout="constrained")
    left, right = figure.subfigures(1, 2, width_ratios=(1.0, 1.05))
    radar = left.add_subplot(projection="polar")
    error, force = right.subplots(2, 1, sharex=True)
    data = _theory(series[0], radar, error, force)
    look = styles([one.points[0].entry for one in series])
    for number, one in enumerate(series):
        # Good models hide each other: the first one's markers are the largest.
        scale = 1.0 + 0.5 * (len(series) - 1 - number)
        alone = one.first.value("closing_force") if one.first else float("nan")
        for design in one.designs:
            _draw(design, look[one.performer], scale, alone, (radar, error, force))
        data += [_row(one, design, alone) for design in one.designs]
    _dress(radar, error, force)
    left.legend(handles=_handles(list(look.values())), loc="outside lower center", ncols=2, frameon=False, fontsize=8)
    figure.suptitle(title)
    return save(figure, path, _HEADER, data)


def _theory(one: PinchSeries, radar: Any, error: Any, force: Any) -> list[Sequence[Any]]:
    """Lines of the ideal axis and of first-order theory; return the theory's rows."""
    angles, pairs, law = np.linspace(0.0, 2 * np.pi, _FINE), one.specimen.pairs, one.experiment.law
    found = [first_order(pair_shares(angle, pairs, law)) for angle in angles]
    away = np.array([axis_difference(f.axis, ideal_axis(angle)) for f, angle in zip(found, angles, strict=True)])
    factors = np.array([f.force_factor for f in found])
    radar.plot(angles, np.degrees(angles / 2), color=_IDEAL, lw=3.0, alpha=0.5)
    radar.plot(angles, np.degrees(angles / 2 + away), color=_THEORY, lw=1.2)
    error.axhline(0.0, color=_IDEAL, lw=3.0, alpha=0.5)
    error.plot(np.degrees(angles), np.degrees(away), color=_THEORY, lw=1.2)
    force.plot(np.degrees(angles), factors, color=_THEORY, lw=1.2)
    if law == "published" and pairs == 3:
        known = figures()
        more = 1.0 + known["c3-fp-increase"]["value"] / 100.0
        force.plot(known["c3-transition-angles"]["value"], [more] * 3, "*", ms=13, color=_TEXT, zorder=3)
    return [
        ("first order", "theory", f"{np.degrees(angle):.6g}", "", f"{np.degrees(f.axis):.6g}", "",
         f"{np.degrees(ideal_axis(angle)):.6g}", "", f"{f.force_factor:.6g}")
        for angle, f in list(zip(angles, found, strict=True))[:: (_FINE - 1) // _ROWS]
    ]  # fmt: skip


def _draw(design: Design, style: Style, scale: float, alone: float, panels: Sequence[Any]) -> None:
    radar, error, force = panels
    look: dict[str, Any] = {"color": style.colour, "ls": "", "mew": 1.1, "zorder": 5}
    look["mfc"] = style.colour if design.computed else "white"
    angle, shown = design.pinch_angle, np.degrees(design.pinch_angle)
    for name, marker, size, _ in _AXES:
        away = axis_difference(design.axis(name), ideal_axis(angle))
        radar.plot(angle, np.degrees(angle / 2 + away), marker, ms=scale * size, **look)
        error.plot(shown, np.degrees(away), marker, ms=scale * size, **look)
        if abs(design.source.mirror_error(name)) > _BROKEN:
            error.plot(shown, -np.degrees(away), "x", color=style.colour, ms=5)
            radar.plot(angle, np.degrees(angle / 2 - away), "x", color=style.colour, ms=4)
    force.plot(shown, design.source.value("closing_force") / alone, "D", ms=5 * scale, **look)


def _dress(radar: Any, error: Any, force: Any) -> None:
    # Room for axes that stray to below zero.
    radar.set(rlim=(-45, 195), rticks=range(0, 181, 45), rlabel_position=52)
    radar.set_thetagrids(range(0, 360, 30))
    radar.set_title("axis from +x [deg] (outwards) over the pinch angle $\\alpha$ (around)", fontsize=9)
    error.set(ylabel="axis - ideal $\\alpha/2$ [deg]")
    error.set_title("how far the axis is from the ideal one", fontsize=9)
    force.set(
        xlabel="pinch angle $\\alpha$ [deg]",
        ylabel="closing force over $\\alpha = 0$",
        ylim=(0.0, 1.1 * force.dataLim.y1),
    )
    force.set_title("force to close", fontsize=9)
    force.set_xticks(range(0, 361, 30))
    for axis in (error, force):
        axis.grid(alpha=0.3)


def _handles(look: Sequence[Style]) -> list[Any]:
    from matplotlib.lines import Line2D

    grey: dict[str, Any] = {"color": "#555555", "ls": ""}
    return [
        *(Line2D([], [], color=style.colour, marker="D", ls="", label=style.label) for style in look),
        *(Line2D([], [], marker=marker, label=said, **grey) for _, marker, _, said in _AXES),
        Line2D([], [], marker="D", mfc="white", label="hollow: image by symmetry", **grey),
        Line2D([], [], marker="x", label="mirror image of a shape without mirror", **grey),
        Line2D([], [], color=_IDEAL, lw=3.0, alpha=0.5, label="ideal axis"),
        Line2D([], [], color=_THEORY, label="first-order theory"),
        Line2D([], [], color=_TEXT, marker="*", ms=11, ls="", label="text: 50 % more force"),
    ]


def _row(one: PinchSeries, design: Design, alone: float) -> Sequence[Any]:
    axes = (design.axis(name) for name in ("deformation_axis", "hinge_axis"))
    angles = (design.pinch_angle, design.source.pinch_angle, *axes, ideal_axis(design.pinch_angle))
    force = design.source.value("closing_force")
    cells = (f"{np.degrees(angle):.6g}" for angle in angles)
    return (one.performer, one.origin, *cells, f"{force:.6g}", f"{force / alone:.6g}")
