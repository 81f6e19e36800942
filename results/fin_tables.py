"""Tubes with fins as tables: shape propagation over both angles, limit loads, pressure, and what paddling gives."""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from lab.experiments import FinPush, PaddleThrust, ShapePropagation
from lab.published import figures
from results.accuracy import Entry
from results.effects import Effect, effect
from results.fin_accuracy import accuracy_table, run_time_table
from results.fin_states import FITTED, SENSES, FinState, FinStates, fin_states, pushing
from results.fins import CORRELATED, NEGLIGIBLE, PSI, full_pinch, is_negligible
from results.paddle_tables import paddle_tables
from results.swept_series import Point, SweptSeries, swept_series
from results.tables import Table, shown

FIN_EXPERIMENTS = ("ShapePropagation", "FinPush", "PaddleThrust")
#: The angles that the text sweeps, and what it says of each: effect on s, on y.
ARC, ANGLE = "specimen.fin_arc", "specimen.attachment_angle"
SAID = {ARC: ("negligible", "negligible"), ANGLE: ("high correlation", "not significant")}
_MM = 1e3
#: Fewer designs than this are no sweep.
_SWEEP = 3

_PROPAGATION = (
    "P: the tip's corner at +y of the fin at +x; s: its travel in the x-z plane, y: its motion towards that plane, x, "
    "z: its displacement, all at the end of the pinch; y of fin: largest motion of any place of the fin towards that "
    "plane; stroke: turn of the fin's crown towards the tube; curvature: of "
    "the tip over that at rest; strain: largest principal one"
)
_EFFECT = (
    "spread: largest less smallest over the size of the mean; r: Pearson's correlation with the angle; negligible: "
    f"spread below {NEGLIGIBLE:.0%}, or of y a range below a hundredth of s, strong: correlation beyond "
    f"{CORRELATED:g} and spread above that (assumed: the text has words only, 4.4.2)"
)
_PUSH = (
    "flat: approach of top and bottom over the 33 mm of the full pinch; largest: force over the whole push, which the "
    "text calls the limit; limit: first peak from which the force falls by a hundredth, a dash where it only rises; K: "
    "initial stiffness as of a hinge at the crease's middle; fin angle from the tube's axis and tip's radius of "
    "curvature at first touch; lab: the largest over five pressures, the plate's place is not published"
)
_PER_SENSE = {
    "largest [N]": ("force_max", 1.0), "limit [N]": ("limit_load", 1.0), "at [mm]": ("push_at_limit", _MM),
    "K [N m/rad]": ("torsional_stiffness", 1.0),
}  # fmt: skip
_BOTH = tuple(f"{sense}: {name}" for sense in SENSES for name in _PER_SENSE)
_LAWS = (
    "a exp(b f) + c exp(d f) over f, the flattening over 33 mm, as in 4.5.3; misfit: root mean square over the largest "
    "value; spare: points beyond the four numbers, without which any points are met"
)
_PRESSURE = (
    "approach of top and bottom at each pressure in the chambers; flat: over the 33 mm of the full pinch; the text has "
    "the curve in fig. 4.5(e) alone, and says that the tube is flat at 40 psi"
)


def fin_tables(entries: Sequence[Entry]) -> Iterator[Table]:
    """All tables that records of tubes with fins fill, those without a line left out."""
    mine = [entry for entry in entries if isinstance(entry.experiment, ShapePropagation | FinPush | PaddleThrust)]
    if not mine:
        return
    shapes = [entry for entry in mine if isinstance(entry.experiment, ShapePropagation)]
    pinched, inflated = ([e for e in shapes if _drive(e) == drive] for drive in ("pinch", "pressure"))
    series = angle_series(pinched)
    states = fin_states(mine)
    for table in (
        accuracy_table(mine), effect_table(series), *_propagations(series, pinched),
        *(_state_table(one) for one in states if not one.is_variant), _design_table(states),
        _law_table(states), pressure_table(inflated), *paddle_tables(mine), run_time_table(mine),
    ):  # fmt: skip
        if table.rows:
            yield table


def angle_series(pinched: Sequence[Entry]) -> list[SweptSeries]:
    """Pinches over the fin's arc, then over its attachment angle; crossings of the one sweep by the other are none."""
    return [one for path in (ARC, ANGLE) for one in swept_series(pinched, path, _SWEEP)]


def _drive(entry: Entry) -> str:
    assert isinstance(entry.experiment, ShapePropagation)
    return entry.experiment.drive


def effect_table(series: Sequence[SweptSeries]) -> Table:
    """'alpha negligible, theta strong', in numbers."""
    lines = []
    for one in series:
        found = {name: effect(np.rad2deg(one.values), _MM * one.results(name)) for name in ("s", "y")}
        said = SAID[one.path]
        lines.append(
            (
                one.name, one.label or "-", one.performer, f"{found['s'].designs} of {len(one.points)}",
                *(cell for name in ("s", "y") for cell in _effect_cells(found[name])),
                f"s: {judged(found['s'])} (text: {said[0]}); y: {judged(found['y'], found['s'])} (text: {said[1]})",
            )
        )  # fmt: skip
    numbers = ("from, to [mm]", "spread", "[mm/deg]", "r")
    header = ("over", "held", "by", "designs", *(f"{n} {w}" for n in ("s", "y") for w in numbers), "effect")
    return Table("is alpha negligible, and theta strong?", header, tuple(lines), (_EFFECT,))


def _effect_cells(found: Effect) -> tuple[str, ...]:
    return (
        f"{shown(found.low, '')}, {shown(found.high, '')}",
        f"{found.spread:.1%}" if math.isfinite(found.spread) else "-", shown(round(found.slope, 9) + 0.0, ""),
        f"{found.correlation:+.3f}" if math.isfinite(found.correlation) else "-",
    )  # fmt: skip


def judged(found: Effect, beside: Effect | None = None) -> str:
    """An effect in words."""
    if is_negligible(found, beside):
        return "negligible"
    if math.isnan(found.spread):
        return "not known"
    return "strong" if abs(found.correlation) > CORRELATED else "neither steady nor negligible"


def _propagations(series: Sequence[SweptSeries], pinched: Sequence[Entry]) -> Iterator[Table]:
    """A table per sweep, and one for records that are in none."""
    header = (
        "s [mm]", "y [mm]", "y of fin [mm]", "x [mm]", "z [mm]", "stroke [deg]", "curvature", "force [N]", "work [mJ]",
        "strain [%]", "travel [mm]", "because",
    )  # fmt: skip
    told = _PROPAGATION
    for one in series:
        lines = tuple((f"{np.rad2deg(p.value):.4g}", *_propagation_cells(p)) for p in one.points)
        yield Table(f"fins {one.title}", (f"{one.name} [deg]", *header), lines, (told,) if told else ())
        told = ""
    inside = {id(point.entry) for one in series for point in one.points}
    alone = [entry for entry in pinched if id(entry) not in inside]
    lines = tuple((_labelled(e), e.performer, *_propagation_cells(Point(0.0, e, e.scalars()))) for e in alone)
    yield Table("other pinches of tubes with fins", ("device", "by", *header), lines, (told,) if told else ())


def _propagation_cells(point: Point) -> tuple[str, ...]:
    factors = {"s": _MM, "y": _MM, "y_fin": _MM, "p_x": _MM, "p_z": _MM, "stroke": 180 / math.pi,
               "curvature_gain": 1.0, "force_max": 1.0, "work": 1e3, "largest_strain": 100.0,
               "travel_reached": _MM}  # fmt: skip
    record = point.entry.record
    why = "" if record.completed else f"{record.status}: {record.reason}"
    return (*(shown(point.number(name) * factor, "") for name, factor in factors.items()), why)


def _labelled(entry: Entry) -> str:
    return entry.campaign if entry.slug == "single" else f"{entry.campaign}: {entry.slug}"


def _state_table(found: FinStates) -> Table:
    """Limit loads in both senses over the flattening."""
    lines = tuple(_state_line(state) for state in found.states)
    header = (
        "pinched [mm]", "flat", "fin angle [deg]", "tip radius [mm]", *_BOTH, "opposite over equal", "because",
    )  # fmt: skip
    lab = ("lab", *[""] * 3, *_lab_pushes(), "")
    return Table(f"limit loads of the fin, {found.title}", header, (lab, *lines), (_PUSH,), detail=not found.plain)


def _design_table(states: Sequence[FinStates]) -> Table:
    """Designs and rigs that were pushed in one state of flattening alone, a line each."""
    lines = [
        (one.label, one.performer, shown(_MM * state.travel, ""), *_push_cells(state))
        for one in states
        if one.is_variant
        for state in one.states
    ]
    header = ("device", "by", "pinched [mm]", *_BOTH, "opposite over equal", "because")
    lab = ("lab: prototype", "", "", *_lab_pushes(), "")
    title = "limit loads of fins of other designs, and pushed elsewhere"
    return Table(title, header, (lab, *lines) if lines else (), (_PUSH,))


def _lab_pushes() -> tuple[str, ...]:
    known = figures()
    published = [known[id]["value"] for id in ("c4-f-opposite", "c4-f-equal")]
    return (*(c for force in published for c in (shown(force, ""), "", "", "")), shown(published[0] / published[1], ""))


def _state_line(state: FinState) -> tuple[str, ...]:
    place = _at_touch(state)
    return (
        shown(_MM * state.travel, ""), shown(state.share, ""), shown(math.degrees(place[0]), ""),
        shown(_MM * place[1], ""), *_push_cells(state),
    )  # fmt: skip


def _push_cells(state: FinState) -> tuple[str, ...]:
    """Cells of ``_BOTH``, the ratio of both senses, and why a push ended early."""
    cells = [
        shown(state.number(sense, name) * factor, "") for sense in SENSES for name, factor in _PER_SENSE.values()
    ]  # fmt: skip
    ratio = state.number("opposite", "force_max") / state.number("equal", "force_max")
    records = [point.entry.record for point in state.pushes.values()]
    why = dict.fromkeys(f"{r.status}: {r.reason}" for r in records if not r.completed)
    return (*cells, shown(ratio, ""), "; ".join(why))


def _at_touch(state: FinState) -> tuple[float, float]:
    """Fin angle, rad, and tip's radius, m, as the plate comes."""
    for point in state.pushes.values():
        record = point.entry.record
        if {"stage", "fin_angle", "fin_radius"} <= set(record.channels) and len(places := pushing(record)):
            return float(record["fin_angle"][places[0]]), float(record["fin_radius"][places[0]])
    return math.nan, math.nan


def _law_table(found: Sequence[FinStates]) -> Table:
    lines = []
    names = {"torsional_stiffness": "initial stiffness", "torque": "largest moment", "force_max": "largest force"}
    for one in found:
        for (sense, name), law in one.laws.items():
            lines.append(
                (
                    one.title, sense, f"{names[name]} [{FITTED[name].replace('*', ' ')}]",
                    *(f"{c:.4g}" for c in (law.a, law.b, law.c, law.d)), f"{law.misfit:.1%}", str(law.spare),
                )
            )  # fmt: skip
    header = ("device", "sense", "of", "a", "b", "c", "d", "misfit", "spare")
    return Table("two-term exponentials over the flattening", header, tuple(lines), (_LAWS,))


def pressure_table(inflated: Sequence[Entry]) -> Table:
    """Flattening against pressure at five pressures of the text's range."""
    low, high = (float(end) for end in figures()["c4-pressure-range"]["value"])
    asked = np.linspace(low, high, 5)
    lines = []
    for entry in inflated:
        record = entry.record
        if not {"pressure", "travel"} <= set(record.channels):
            lines.append(
                (_labelled(entry), entry.performer, *["-"] * len(asked), "-", f"{record.status}: {record.reason}")
            )
            continue
        pressure, travel = record["pressure"] / PSI * (1 + 1e-6), record["travel"]
        # A pressure that was not reached has no flattening.
        at = np.interp(asked, pressure, travel, right=math.nan)
        over = f"{travel[-1] / full_pinch():.3g} at {pressure[-1]:.3g} psi"
        why = "" if record.completed else f"{record.status}: {record.reason}"
        lines.append((_labelled(entry), entry.performer, *(shown(_MM * t, "") for t in at), over, why))
    header = ("device", "by", *(f"{p:g} psi [mm]" for p in asked), "flat", "because")
    return Table("flattening against pressure", header, tuple(lines), (_PRESSURE,))
