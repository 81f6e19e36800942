"""Fit of kind ``hinge``: what a finite-element tube says about the hinge that stands for it.

A record's flexibility of the distal block is that of a hinge, seen from the block's face: turning gives the bending
and torsional stiffness and the axes, the lever from the face to the hinge, and what is left of the sliding.  Nothing
has to be searched.  How the springs harden comes from bendings by inverse statics: forces and poses of a record give
moment and turn of the hinge, and the cubic term follows by least squares.
"""

from collections.abc import Sequence
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from calibrate.hinge_data import HingeDatum, hardening, hinge_of, largest_turn
from calibrate.hinge_scores import score_of, scores_table, states_table
from calibrate.result import plain
from calibrate.spec import HingeFit
from lab.experiments import Pinch, PinchedBending
from lab.experiments.pinch import closing
from lab.experiments.pinch_drive import STAGES
from lab.hinge import section_shape
from lab.pinching import axis_difference, distinct, first_order, pair_shares
from prb.hinge_curves import COLUMNS, TOUCH, HingeCurves, HingeTable
from prb.model import PrbModel

__all__ = ["HingeDatum", "fit_hinge", "learn_hinge"]

Array = NDArray[np.float64]
#: Shares of the pinch at which the curves stand.
SHARES = np.unique(np.concatenate([np.linspace(0.0, TOUCH, 73), np.linspace(TOUCH, 1.0, 9)]))


def fit_hinge(spec: HingeFit, model: PrbModel, data: Sequence[HingeDatum]) -> dict[str, Any]:
    """Curves of the hinge, and how ``model`` follows every record with them, as plain JSON data.

    Parameters
    ----------
    spec
        The fit, for its kind.
    model
        Topology that the scores are of; the curves do not depend on it.
    data
        Records, used and held out.

    Returns
    -------
    result
        ``hinge`` (see ``prb.hinge_curves.HingeCurves``), ``scores`` of the records, ``tables``, ``notes``.

    Raises
    ------
    ValueError
        In one line: nothing to learn from, or records that do not belong together.
    """
    begin = perf_counter()
    curves = learn_hinge([item for item in data if item.used])
    scores = [score_of(model.model_copy(update={"hinge": curves}), item) for item in data]
    used = [item.label for item in data if item.used]
    notes = [f"Learned from {', '.join(used)} in {perf_counter() - begin:.1f} s; nothing is searched."]
    if len(used) == len(data):
        notes.append("Nothing is held out of this fit: all its errors are in sample.")
    return plain({
        "kind": spec.kind, "hinge": curves.model_dump(mode="json"), "parameters": [], "scores": scores,
        "tables": [states_table(curves), scores_table(scores, notes)], "notes": notes, "used": used,
        "wall_time_s": perf_counter() - begin,
    })  # fmt: skip


def learn_hinge(data: Sequence[HingeDatum]) -> HingeCurves:
    """Curves from records of one tube and law at one or more pinch angles; ValueError as ``fit_hinge``."""
    for item in data:
        if getattr(item.experiment, "order", "pinch first") != "pinch first":
            raise ValueError(f"{item.label} is loaded first, so its pinch is not that of a free tube; hold it out")
    pinched = [item for item in data if getattr(item.experiment, "pinched", True)]
    if not pinched:
        raise ValueError("no used record pinches a free tube; name a Pinch, or a PinchedBending that pinches first")
    tube = data[0].specimen
    for item in data[1:]:
        if item.specimen != tube:
            raise ValueError(f"{item.label} is of another specimen than {data[0].label}; a hinge is fitted to one tube")
    laws = {item.experiment.law for item in pinched}
    if len(laws) > 1 or any(item.experiment.pair_forces is not None for item in pinched):
        raise ValueError("used records must share one law of forces, and pair_forces are none")
    (law,) = laws
    groups: dict[float, list[HingeDatum]] = {}
    for item in pinched:
        groups.setdefault(round(distinct(item.experiment.pinch_angle, tube.pairs).pinch_angle, 9), []).append(item)
    open_tube = [item for item in data if isinstance(item.experiment, PinchedBending) and not item.experiment.pinched]
    closed = {angle: hardening(items, closed=True) for angle, items in groups.items()}
    known = [found for found in closed.values() if found is not None]
    # A pinch angle without a bending hardens as the others do.
    usual = np.mean(known, axis=0) if known else np.zeros(2)
    unbent = hardening(open_tube, closed=False)
    at_rest = np.zeros(2) if unbent is None else unbent
    tables = []
    for angle in sorted(groups):
        found = closed[angle]
        tables.append(_table(angle, groups[angle], at_rest, usual if found is None else found))
    facts = {k: v for k, v in tube.model_dump(mode="json").items() if not k.startswith("imperfection")}
    return HingeCurves(
        pairs=tube.pairs, law=law, shares=tuple(SHARES.tolist()), tables=tuple(tables), turned=largest_turn(data),
        specimen=facts,
    )  # fmt: skip


def _table(angle: float, items: Sequence[HingeDatum], unbent: Array, closed: Array) -> HingeTable:
    """Curves at a distinct pinch angle, of pinches where there are any, else of the pinches of bendings.

    Hardening (soft, stiff) goes evenly from that of the open tube to that of the closed one.
    """
    pinches = [item for item in items if isinstance(item.experiment, Pinch)] or items
    parts = [_columns(item) for item in pinches]
    columns = {name: np.mean([part[name] for _, part in parts], axis=0) for name in parts[0][1]}
    for name, at_end, at_rest in zip(("harden_soft", "harden_stiff"), closed, unbent, strict=True):
        columns[name] = at_rest + SHARES * (at_end - at_rest)
    return HingeTable(
        pinch_angle=angle, touches=all(touches for touches, _ in parts),
        columns={name: tuple(columns[name].tolist()) for name in COLUMNS},
    )  # fmt: skip


def _columns(item: HingeDatum) -> tuple[bool, dict[str, Array]]:
    """Whether walls or pads touch, and columns over ``SHARES``."""
    record, e, tube = item.record, item.experiment, item.specimen
    rows = np.flatnonzero(record["stage"] <= STAGES.index("pinch"))
    travel = record["travel"][rows]
    # A travel that stands still has nothing between its states.
    rising = np.concatenate([[True], np.diff(np.maximum.accumulate(travel)) > 1e-6 * travel.max()])
    rows, travel = rows[rising], travel[rising]
    # Amid a snap the flexibility is that of no state that could stand, and passes through infinity.
    standing = record["unstable"][rows] <= 0
    standing[[0, -1]] = True
    if len(rows) < 3:
        raise ValueError(f"{item.label} holds {len(rows)} states along its pinch; at least 3 are needed")
    image = distinct(e.pinch_angle, tube.pairs)
    theory = first_order(pair_shares(e.pinch_angle, tube.pairs, e.law))
    sense = -1.0 if image.mirrored else 1.0
    contact = record["contact_force"][rows]
    bend, rest = hinge_of(record["flexibility"][rows[standing]])
    shapes = [section_shape(section) for section in record["section"][rows]]
    flat = np.array([1.0 - shape.width / shapes[0].width for shape in shapes])
    turned = np.array([axis_difference(shape.axis, theory.axis) for shape in shapes])
    flattening = flat * np.exp(2j * sense * np.nan_to_num(turned))
    stiffer = np.exp(-2j * theory.axis) * bend[:, 1]
    given = {
        "travel": travel / theory.strength, "force": record["force"][rows] * theory.strength,
        "contact": contact * theory.strength, "gap": _filled(record["gap"][rows]),
        "strain": _filled(record["strain"][rows]), "flat_along": flattening.real, "flat_askew": flattening.imag,
        "shortening": -(record["pose"][rows, 2] - record["pose"][0, 2]),
    }  # fmt: skip
    stiff = {"bend_mean": bend[:, 0].real, "bend_along": stiffer.real, "bend_askew": sense * stiffer.imag, **rest}
    first = closing(record)["touch_travel"].value
    touches = bool(np.isfinite(first))
    ends = [first, max(travel[-1], first * (1 + 1e-9))] if touches else [travel[-1]]
    share = np.interp(travel, [0.0, *ends], [0.0, TOUCH, 1.0][: 1 + len(ends)])
    columns = {name: np.interp(SHARES, share, values) for name, values in given.items()}
    columns |= {name: np.interp(SHARES, share[standing], values) for name, values in stiff.items()}
    if touches:
        # The states beside the first touch do not fall on it.
        columns["contact"][SHARES <= TOUCH] = 0.0
    return touches, columns


def _filled(values: Array) -> Array:
    """Unknown values as the nearest known ones; zeros where none is known."""
    known = np.flatnonzero(np.isfinite(values))
    return np.interp(np.arange(len(values)), known, values[known]) if len(known) else np.zeros(len(values))
