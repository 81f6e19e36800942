"""Pinches as tables: what closes a tube, which hinge it makes, and what the tube's symmetry says of all angles."""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from lab.measures import relative_error
from lab.pinching import axis_difference, first_order, ideal_axis, pair_shares
from results.pinch_series import Design, PinchPoint, PinchSeries
from results.pinch_symmetry import axis_steps
from results.tables import Table, shown

#: A shape whose axis is off the mirror line by more than this (rad) has broken the symmetry of tube and forces.
BROKEN = math.radians(2.0)
#: Fewer designs round the turn than this say nothing of how steadily an axis turns.
_FEW = 12
_AXES = {"deformation_axis": "deformation", "hinge_axis": "hinge"}
_PINCH = (
    "closing force: largest F_p up to first touch; over alpha 0: over that of one pair alone, first order: the same by "
    "the second harmonic of the forces (small deflections of a thin ring); axes in deg from +x (difference from the "
    "ideal alpha / 2); soft, stiff: bending stiffness of the closed tube in N m/rad about its hinge axis and across "
    "it, the tendons' lengths held; strain: the wall's largest; a dash: no such number, the last column says why"
)
_DESIGNS = (
    "a tube with 2 n even pads looks the same after a turn by their spacing, and in a mirror through a pad: pinch "
    "angles that were not computed are images of those that were; axes in deg from +x"
)
_TWINS = (
    "two computed pinches that symmetry makes one: what differs is mesh, imperfection and the choice between shapes; "
    "axes: difference from the image's"
)
_STEPS = (
    "largest turn of an axis between neighbouring pinch angles, images included, and where; first order: by the second "
    "harmonic of the forces at the same angles; steady: half of the step in alpha; off its mirror line: tube and "
    "forces are symmetric there, the shape is not, so that its mirror image is another solution"
)
_PINCH_HEADER = (
    "forces over F_p", "closing force [N]", "over alpha 0", "first order", "ideal axis", "deformation axis",
    "hinge axis", "soft", "stiff", "anisotropy", "flattening [%]", "strain [%]", "because",
)  # fmt: skip
_STEP_HEADER = (
    "tube", "axis", "designs", "largest step [deg]", "between alpha [deg]", "first order [deg]", "steady [deg]",
    "off its mirror line",
)  # fmt: skip
_TWIN_HEADER = (
    "tube", "alpha [deg]", "image of [deg]", "closing force", "flattening", "deformation axis [deg]",
    "hinge axis [deg]",
)  # fmt: skip


def pinch_tables(series: Sequence[PinchSeries]) -> Iterator[Table]:
    """A table per series over the pinch angle, one for pinches that stand alone, then what symmetry tells."""
    long = [one for one in series if len(one.points) > 1]
    for one in long:
        lines = tuple((degrees(point.pinch_angle), *_cells(one, point)) for point in one.points)
        notes = (_PINCH,) if one is long[0] else ()
        # What a PRB model says of it is known from what it was fitted to.
        yield Table(f"pinches of {one.title}", ("alpha [deg]", *_PINCH_HEADER), lines, notes, one.origin == "prb")
    alone = [(one, one.points[0]) for one in series if len(one.points) == 1]
    if lines := tuple((f"{one.title}, alpha {degrees(p.pinch_angle)}", *_cells(one, p)) for one, p in alone):
        yield Table("other pinches", ("tube", *_PINCH_HEADER), lines, () if long else (_PINCH,))
    if lines := tuple(_step_line(one, name) for one in long for name in _AXES if len(one.designs) >= _FEW):
        yield Table("how steadily the axis turns", _STEP_HEADER, lines, (_STEPS,))
    if lines := tuple(_twin_line(one, *twin) for one in long if one.origin != "prb" for twin in one.twins):
        yield Table("equivalent pinches", _TWIN_HEADER, lines, (_TWINS,))
    for one in long:
        if len(one.designs) > len(one.points):
            yield _designs(one)


def degrees(angle: float) -> str:
    """An angle (rad) as text in degrees; a dash where there is none."""
    return shown(round(math.degrees(angle), 6) + 0.0, "") if math.isfinite(angle) else "-"


def _cells(series: PinchSeries, point: PinchPoint) -> tuple[str, ...]:
    theory, force = first_order(point.shares), point.value("closing_force")
    alone = series.first.value("closing_force") if series.first else math.nan
    factor = shown(theory.force_factor, "") if theory.strength > 1e-9 else "cancels"
    return (
        ", ".join(f"{share:.3g}" for share in point.shares), shown(force, ""), shown(force / alone, ""), factor,
        degrees(point.ideal), *(_axis(point, name) for name in _AXES),
        *(shown(point.value(name), "") for name in ("k_soft", "k_stiff", "anisotropy")),
        shown(100 * point.value("flattening"), ""), shown(100 * point.value("largest_strain"), ""), _because(point),
    )  # fmt: skip


def _axis(point: PinchPoint, name: str) -> str:
    angle = point.value(name)
    off = round(math.degrees(axis_difference(angle, point.ideal)), 1) + 0.0
    return nearby(angle, point.ideal) + (f" ({off:+.1f})" if math.isfinite(off) else "")


def nearby(axis: float, ideal: float) -> str:
    """A line (rad) in degrees, within a right angle of an ideal one: -2 beside 0, where 178 is the same line."""
    if math.isnan(axis):
        return "-"
    near = axis if math.isnan(ideal) else ideal + axis_difference(axis, ideal)
    return f"{round(math.degrees(near), 1) + 0.0:.1f}"


def _because(point: PinchPoint) -> str:
    """Why numbers are missing, and what the performer notes."""
    record = point.entry.record
    if not point.numbers:
        return f"{record.status}: {record.reason}"
    notes = record.how.get("notes") or ()
    said = (notes,) if isinstance(notes, str) else notes
    missing = [
        scalar.long_name for name, scalar in point.numbers.items()
        if name in ("closing_force", *_AXES) and math.isnan(scalar.value) and not (said and name == "closing_force")
    ]  # fmt: skip
    if point.value("k_soft") <= 0:
        missing.append("the closed tube is unstable: it turns further by itself")
    broken = [
        f"{word} axis {math.degrees(abs(off)):.2g} deg off its mirror line"
        for name, word in _AXES.items() if abs(off := point.mirror_error(name)) > BROKEN
    ]  # fmt: skip
    return "; ".join(text for text in (*missing, *broken, *map(str, said)) if text)


def _step_line(series: PinchSeries, name: str) -> tuple[str, ...]:
    angles = np.array([design.pinch_angle for design in series.designs])
    ours = axis_steps(np.array([design.axis(name) for design in series.designs]))
    pairs, law = series.specimen.pairs, series.experiment.law
    theory = axis_steps(np.array([first_order(pair_shares(a, pairs, law)).axis for a in angles]))
    gaps = np.diff(np.append(angles, angles[0] + 2 * np.pi))
    broken = [
        f"{math.degrees(abs(off)):.2g} at {degrees(point.pinch_angle)}"
        for point in series.points if abs(off := point.mirror_error(name)) > BROKEN
    ]  # fmt: skip
    if np.isnan(ours).all():
        return (series.title, _AXES[name], str(len(angles)), *["-"] * 5)
    place = int(np.nanargmax(np.abs(ours)))
    between = f"{degrees(angles[place])} and {degrees(angles[(place + 1) % len(angles)])}"
    expected = np.nanmax(np.abs(theory)) if np.isfinite(theory).any() else math.nan
    return (
        series.title, _AXES[name], str(len(angles)), f"{math.degrees(ours[place]):.1f}", between,
        "-" if math.isnan(expected) else f"{math.degrees(expected):.1f}", degrees(gaps[place] / 2),
        ", ".join(broken) or "nowhere",
    )  # fmt: skip


def _twin_line(series: PinchSeries, point: PinchPoint, source: PinchPoint) -> tuple[str, ...]:
    image = Design(point.pinch_angle, source)
    off = [math.degrees(axis_difference(point.value(name), image.axis(name))) for name in _AXES]
    return (
        series.title, degrees(point.pinch_angle), degrees(source.pinch_angle),
        *(_share(point.value(name), source.value(name)) for name in ("closing_force", "flattening")),
        *("-" if math.isnan(angle) else f"{angle:+.2f}" for angle in off),
    )  # fmt: skip


def _share(value: float, of: float) -> str:
    return f"{relative_error(value, of):+.2%}" if math.isfinite(relative_error(value, of)) else "-"


def _designs(series: PinchSeries) -> Table:
    """Every design, computed or an image; the numbers of the radar plot."""
    lines = []
    for design in series.designs:
        source = design.source
        how = "computed" if design.computed else f"image of {degrees(source.pinch_angle)}"
        force = shown(source.value("closing_force"), "")
        ideal = ideal_axis(design.pinch_angle)
        axes = (nearby(design.axis(name), ideal) for name in _AXES)
        lines.append((degrees(design.pinch_angle), how, force, degrees(ideal), *axes))
    header = ("alpha [deg]", "design", "closing force [N]", "ideal axis", *(f"{n} axis" for n in _AXES.values()))
    return Table(f"all designs of {series.title}", header, tuple(lines), (_DESIGNS,), detail=True)
