"""What pinched tubes do under loads, as tables: push tests, dead loads, recovery, hysteresis."""

import math
from collections.abc import Sequence

import numpy as np

from lab.experiments import PinchedBending, ShapeRecovery
from lab.formulas import hinge_stiffness_ratio
from lab.published import figures
from lab.tube_theory import open_stiffness
from results.accuracy import Entry
from results.pinch_tables import degrees, nearby
from results.push_tests import PushTest, pairs
from results.slugs import words
from results.tables import Table, shown
from results.tubes import RECOVERED, free_way, way

_PUSH = (
    "slope of force against motion in N/m; theory: the open tube as a beam with shear, its pads left out; lab: 3.5.1, "
    "a printed tube whose pusher, travel and plate are not described"
)
_DIRECTIONS = (
    "motion of the block's face by the load in mm, x and y as fig. 3.2(d) shows them; with the load first, from rest; "
    "axis: about which the block turned, from +x; way: motion across the tube from the load's direction about +z, "
    "which a hinge that is free about its ideal axis alone would make the value in brackets; deg"
)
_RECOVERY = (
    f"flattening left, % of what the pinch made of the loaded tube; round again: less than {RECOVERED:.0%} (assumed: "
    "the text says no number); drop: motion of the weight in mm"
)
_LOSS = "loss: share of the work of bending that is not returned; k: slope on the way there"


def label(entry: Entry) -> str:
    """Specimen and swept values of a sample, but for those that have columns of their own."""
    swept = ((name, text) for name, text in words(entry.slug).items() if name not in ("pinch_angle", "load", "pinched"))
    return ", ".join([entry.specimen, *(f"{name.replace('_', ' ')} {text}" for name, text in swept)])


def push_tables(tests: Sequence[PushTest]) -> list[Table]:
    """Tests of tubes as they are beside the lab's, then those of sweeps."""
    known = figures()
    published = [shown(known[id]["value"], "") for id in ("c3-k-unpinched", "c3-k-pinched")]
    ratio = shown(float(np.asarray(hinge_stiffness_ratio())), "")
    lab = ("printed tube", "lab", "-", published[0], "-", published[1], ratio, "")
    header = ("tube", "by", "alpha [deg]", "open", "theory, open", "pinched", "open over pinched", "because")
    plain: list[tuple[str, ...]] = []
    swept: list[tuple[str, ...]] = []
    for opened, closed in pairs(tests):
        both = [test for test in (opened, closed) if test is not None]
        (plain if all(test.is_plain for test in both) else swept).append(_push_line(opened, closed))
    return [
        Table("push tests", header, (lab, *plain) if plain else (), (_PUSH,)),
        Table("push tests of sweeps", header, (lab, *swept) if swept else (), (_PUSH,), detail=True),
    ]


def _push_line(opened: PushTest | None, closed: PushTest | None) -> tuple[str, ...]:
    one = closed or opened
    assert one is not None
    both = opened.k / closed.k if opened and closed else math.nan
    # What gives behind the pusher is in series with the tube: beam theory knows nothing of it.
    theory = open_stiffness(one.specimen, one.experiment.place) if one.experiment.rig_stiffness is None else math.nan
    said = dict.fromkeys(_because(test.entry) for test in (opened, closed) if test)
    return (
        label(one.entry), one.entry.performer, degrees(closed.experiment.pinch_angle) if closed else "-",
        shown(opened.k if opened else math.nan, ""), shown(theory, ""), shown(closed.k if closed else math.nan, ""),
        shown(both, ""), "; ".join(text for text in said if text),
    )  # fmt: skip


def load_table(title: str, entries: Sequence[Entry]) -> Table:
    """Fig. 3.2(d), hanging weights, and every other dead load."""
    header = (
        "tube", "by", "alpha [deg]", "load [N]", "order", "x [mm]", "y [mm]", "z [mm]", "turn [deg]", "axis",
        "ideal axis", "way (free hinge)", "because",
    )  # fmt: skip
    lines = []
    for entry in entries:
        bending = entry.experiment
        if isinstance(bending, PinchedBending) and bending.load is not None:
            numbers = {name: scalar.value for name, scalar in entry.scalars().items()}
            x, y, z, turn, axis = (
                numbers.get(name, math.nan) for name in ("move_x", "move_y", "move_z", "turn", "turn_axis")
            )
            closed = bending.pinched and bending.pair_forces is None
            ideal = (bending.pinch_angle / 2) % math.pi if closed else math.nan
            lines.append(
                (
                    label(entry), entry.performer, degrees(bending.pinch_angle) if closed else "-",
                    shown(bending.load, ""), bending.order if bending.pinched else "open",
                    *(shown(round(1e3 * move, 6) + 0.0, "") for move in (x, y, z)), degrees(turn), nearby(axis, ideal),
                    degrees(ideal), _way(x, y, bending.direction, ideal), _because(entry),
                )
            )  # fmt: skip
    return Table(title, header, tuple(lines), (_DIRECTIONS,))


def _way(x: float, y: float, direction: float, ideal: float) -> str:
    if math.isnan(x):
        return "-"
    free = free_way(ideal, direction) if math.isfinite(ideal) else math.nan
    return _whole(way(x, y, direction)) + (f" ({_whole(free)})" if math.isfinite(free) else "")


def _whole(angle: float) -> str:
    """An angle (rad) in whole degrees, without a sign where it is none."""
    return f"{round(math.degrees(angle)) + 0}"


def recovery_table(entries: Sequence[Entry]) -> Table:
    """Whether tubes came back under their weights (3.6)."""
    header = (
        "tube", "by", "alpha [deg]", "load [N]", "let go [%]", "pinched across [%]", "and let go [%]", "by itself",
        "with help", "drop loaded", "pinched", "let go", "after help", "because",
    )  # fmt: skip
    lines = []
    for entry in entries:
        if isinstance(entry.experiment, ShapeRecovery):
            numbers = {name: scalar.value for name, scalar in entry.scalars().items()}
            left = [numbers.get(f"flat_after_{stage}", math.nan) for stage in ("release", "recover", "let_go")]
            drops = [numbers.get(f"drop_{stage}", math.nan) for stage in ("load", "pinch", "release", "let_go")]
            lines.append(
                (
                    label(entry), entry.performer, degrees(entry.experiment.pinch_angle),
                    shown(entry.experiment.load, ""), *(shown(100 * share, "") for share in left), _round(left[0]),
                    _round(left[2]), *(shown(1e3 * drop, "") for drop in drops), _because(entry),
                )
            )  # fmt: skip
    return Table("recovery", header, tuple(lines), (_RECOVERY,))


def _round(left: float) -> str:
    return "-" if math.isnan(left) else "round again" if left < RECOVERED else "stays flat"


def loss_table(entries: Sequence[Entry]) -> Table:
    """What bending there and back cost."""
    lines = []
    for entry in entries:
        bending = entry.experiment
        if isinstance(bending, PinchedBending) and bending.returns:
            numbers = {name: scalar.value for name, scalar in entry.scalars().items()}
            state = f"closed at {degrees(bending.pinch_angle)}" if bending.pinched else "open"
            how = f"{bending.load:g} N" if bending.load is not None else f"{1e3 * (bending.push or 0.0):g} mm"
            lines.append(
                (
                    label(entry), entry.performer, state, how, shown(numbers.get("k", math.nan), ""),
                    shown(100 * numbers.get("loss", math.nan), ""), _because(entry),
                )
            )  # fmt: skip
    header = ("tube", "by", "state", "bent by", "k [N/m]", "loss [%]", "because")
    return Table("hysteresis of bending", header, tuple(lines), (_LOSS,))


def _because(entry: Entry) -> str:
    """Why there is no result, and what the performer notes."""
    record = entry.record
    if not record.completed:
        return f"{record.status}: {record.reason}"
    notes = record.how.get("notes") or ()
    return "; ".join(map(str, (notes,) if isinstance(notes, str) else notes))
