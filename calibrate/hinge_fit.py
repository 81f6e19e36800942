"""Fit of kind ``hinge``: what a finite-element tube says about the hinge that stands for it.

A record's flexibility of the distal block is that of a hinge, seen from the block's face: turning gives the bending
and torsional stiffness and the axes, the lever from the face to the hinge, and what is left of the sliding.  Nothing
has to be searched.  Bendings say more of the closed tube: their flexibilities are those of states at rest, and forces
and poses give moments and turns of the hinge by inverse statics, from which each spring follows by least squares as two
straight lines that meet in a knee.  Such a spring never gives way, however far beyond the fit it is turned.
"""

from collections.abc import Sequence
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from calibrate.hinge_data import Bend, HingeDatum, bend_of, hinge_of, largest_turn, spring_of, twist_of
from calibrate.hinge_scores import score_of, scores_table, states_table
from calibrate.result import plain
from calibrate.spec import HingeFit
from lab.experiments import Pinch
from lab.experiments.pinch import closing
from lab.experiments.pinch_drive import STAGES
from lab.hinge import section_shape
from lab.pinching import Equivalent, axis_difference, distinct, first_order, pair_shares
from prb.hinge_curves import COLUMNS, STRAIGHT, TOUCH, HingeCurves, HingeTable
from prb.model import PrbModel

__all__ = ["HingeDatum", "fit_hinge", "learn_hinge"]

Array = NDArray[np.float64]
_KNEES = ("knee_soft", "knee_stiff", "beyond_soft", "beyond_stiff")
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
    held = {angle: _held(angle, items) for angle, items in groups.items()}
    known = [found for found in held.values() if found]
    # A pinch angle without a bending has springs with the knees of the others.
    usual = {name: float(np.mean([found[name] for found in known])) for name in _KNEES} if known else {}
    tables = [_table(angle, groups[angle], held[angle] or usual) for angle in sorted(groups)]
    facts = {k: v for k, v in tube.model_dump(mode="json").items() if not k.startswith("imperfection")}
    return HingeCurves(
        pairs=tube.pairs, law=law, shares=tuple(SHARES.tolist()), tables=tuple(tables), turned=largest_turn(data),
        specimen=facts,
    )  # fmt: skip


def _table(angle: float, items: Sequence[HingeDatum], held: dict[str, float]) -> HingeTable:
    """Curves at a distinct pinch angle, of pinches where there are any, else of the pinches of bendings."""
    pinches = [item for item in items if isinstance(item.experiment, Pinch)] or items
    parts = [_columns(item) for item in pinches]
    return HingeTable(
        pinch_angle=angle, touches=all(touches for touches, _ in parts), held=held,
        columns={name: tuple(np.mean([part[name] for _, part in parts], axis=0).tolist()) for name in COLUMNS},
    )  # fmt: skip


def _held(angle: float, items: Sequence[HingeDatum]) -> dict[str, float]:
    """Numbers of the closed tube at a distinct pinch angle by all its bendings, empty where there is none."""
    bends, images = [], []
    for item in items:
        if bend := bend_of(item):
            bends.append(bend)
            images.append(distinct(item.experiment.pinch_angle, item.specimen.pairs))
    if not bends:
        return {}
    law, pairs = items[0].experiment.law, items[0].specimen.pairs
    axis = first_order(pair_shares(angle, pairs, law)).axis
    bends = [_unfolded(bend, image) for bend, image in zip(bends, images, strict=True)]
    flexible = np.array([bend.flexibility[0] for bend in bends])
    tensor, rest = hinge_of(flexible)
    twist, torsion = twist_of(flexible)
    # Which of two mirror images a tube takes is up to its imperfections: all count in the sense of the first.
    twist *= np.sign(twist @ twist[0])[:, None]
    mean, deviation = tensor.mean(axis=0) * [1.0, np.exp(-2j * axis)]
    found = {name: float(values.mean()) for name, values in rest.items()}
    found |= {
        "torsion": float(torsion.mean()), "twist_x": float(twist[:, 0].mean()), "twist_y": float(twist[:, 1].mean()),
    }  # fmt: skip
    soft = axis + float(np.angle(deviation)) / 2
    stiffness = {"soft": float(mean.real - abs(deviation)), "stiff": float(mean.real + abs(deviation))}
    for name, line in (("soft", soft), ("stiff", soft + np.pi / 2)):
        if spring := spring_of(bends, line):
            stiffness[name], found[f"knee_{name}"], found[f"beyond_{name}"] = spring
    turn = np.exp(2j * (soft - axis)) * (stiffness["stiff"] - stiffness["soft"]) / 2
    bend_mean = (stiffness["soft"] + stiffness["stiff"]) / 2
    return {**STRAIGHT, **found, "bend_mean": bend_mean, "bend_along": turn.real, "bend_askew": turn.imag}


def _unfolded(bend: Bend, image: Equivalent) -> Bend:
    """A bending of an image as that of the distinct pinch angle: turned back, then mirrored back."""
    cosine, sine = np.cos(image.turn), np.sin(image.turn)
    change = np.array([[cosine, sine], [-sine, cosine]])
    sense = 1.0
    if image.mirrored:
        cosine, sine = np.cos(2 * image.mirror_axis), np.sin(2 * image.mirror_axis)
        change, sense = np.array([[cosine, sine], [sine, -cosine]]) @ change, -1.0
    whole = np.zeros((6, 6))
    # Turns and moments are axial: a mirror leaves those across it and reverses those in it.
    whole[:2, :2], whole[3:5, 3:5], whole[2, 2], whole[5, 5] = change, sense * change, 1.0, sense
    return Bend(sense * bend.turn @ change.T, sense * bend.moment @ change.T, whole @ bend.flexibility @ whole.T)


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
    touch = closing(record)
    first = touch["touch_travel"].value
    touches = bool(np.isfinite(first))
    ends = [first, max(travel[-1], first * (1 + 1e-9))] if touches else [travel[-1]]
    share = np.interp(travel, [0.0, *ends], [0.0, TOUCH, 1.0][: 1 + len(ends)])
    columns = {name: np.interp(SHARES, share, values) for name, values in given.items()}
    columns |= {name: np.interp(SHARES, share[standing], values) for name, values in stiff.items()}
    if touches:
        # The states beside the first touch do not fall on it: what led there says what it takes.
        open_ = (contact <= 0) & (share < TOUCH)
        at_touch = touch["touch_force"].value * theory.strength
        before, after = SHARES <= TOUCH, SHARES >= TOUCH
        columns["force"][before] = np.interp(SHARES[before], [*share[open_], TOUCH], [*given["force"][open_], at_touch])
        columns["force"][after] = np.interp(SHARES[after], [TOUCH, 1.0], [at_touch, given["force"][-1]])
        # An increment may go far beyond the contact at which a pinch is to end; the tube of the model ends there.
        ends_with = min(given["contact"][-1], e.firmness * given["force"][-1] * (1 + 1e-9))
        columns["contact"] = np.interp(SHARES, [TOUCH, 1.0], [0.0, ends_with])
    return touches, columns


def _filled(values: Array) -> Array:
    """Unknown values as the nearest known ones; zeros where none is known."""
    known = np.flatnonzero(np.isfinite(values))
    return np.interp(np.arange(len(values)), known, values[known]) if len(known) else np.zeros(len(values))
