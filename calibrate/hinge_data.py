"""A record as a hinge: what a fit of kind ``hinge`` reads out of it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.bench_datum import BenchDatum
from lab.experiments import Pinch, PinchedBending
from lab.experiments.pinch_drive import STAGES
from lab.specimens import PinchedTube

Array = NDArray[np.float64]
#: Range of turns below which a bending says nothing about a spring, rad.
_SMALL_TURN = np.deg2rad(1.5)
#: States of a bending of which the first can be spared.
_FEWEST = 4
#: Where a knee may be over the largest turn.
_KNEES = np.linspace(0.2, 0.8, 25)
#: Slope beyond a knee over that before: a spring neither gives way nor becomes a stop beyond what was seen.
_SLOPES = (0.2, 5.0)


@dataclass(frozen=True)
class HingeDatum(BenchDatum):
    """Of a hinge."""

    learner = "a hinge"
    specimens = (PinchedTube,)
    experiments = (Pinch, PinchedBending)


def hinge_of(flexibility: Array) -> tuple[Array, dict[str, Array]]:
    """Mean and complex deviation of the bending stiffness (n, 2), exp(2 i axis) times its size, and the other columns.

    About a point the lever h before the face, a moment only turns: from there the turned block moves by h.
    """
    symmetric = (flexibility + flexibility.swapaxes(1, 2)) / 2
    bend = np.linalg.inv(symmetric[:, 3:5, 3:5])
    mean = (bend[:, 0, 0] + bend[:, 1, 1]) / 2
    deviation = -((bend[:, 0, 0] - bend[:, 1, 1]) / 2 + 1j * bend[:, 0, 1])
    arm = np.array([[0.0, 1.0], [-1.0, 0.0]])  # motion (x, y) at unit height above a turn about (x, y)
    turned = np.einsum("ij,njk->nik", arm, symmetric[:, 3:5, 3:5])
    moved = symmetric[:, 0:2, 3:5]
    lever = np.einsum("nij,nij->n", moved, turned) / np.einsum("nij,nij->n", turned, turned)
    shift = np.tile(np.eye(4), (len(lever), 1, 1))
    shift[:, 0:2, 2:4] = -lever[:, None, None] * arm
    lateral = np.ix_(range(len(lever)), [0, 1, 3, 4], [0, 1, 3, 4])
    at_hinge = (shift @ symmetric[lateral] @ shift.swapaxes(1, 2))[:, :2, :2]
    axis = np.angle(deviation) / 2
    along = np.stack([np.cos(axis), np.sin(axis)], axis=1)
    across = np.stack([-np.sin(axis), np.cos(axis)], axis=1)
    gives = [np.einsum("ni,nij,nj->n", line, at_hinge, line) for line in (across, along)]
    return np.column_stack([mean, deviation]), {
        "torsion": 1.0 / symmetric[:, 5, 5], "lever": lever, "give_across": gives[0], "give_along": gives[1],
    }  # fmt: skip


@dataclass(frozen=True)
class Bend:
    """How the closed tube of a record is bent, its tendons held, seen from its rest.

    Parameters
    ----------
    turn, moment
        About x and y, (n, 2), rad and N*m: the moment of the load on the straight tube that the model turns.
    flexibility
        Of the block's face, (n, 6, 6).
    """

    turn: Array
    moment: Array
    flexibility: Array


def bend_of(item: HingeDatum) -> Bend | None:
    """States of a record's bending that could stand, None where there is none.

    A pinch that moved until its tendons are held is not at rest, and settles with the first load.  The first state is
    left out, therefore, where there are enough, and rest is where the flexibility of the next one leads to.
    """
    from scipy.spatial.transform import Rotation

    record, e = item.record, item.experiment
    if not isinstance(e, PinchedBending) or not e.pinched:
        return None
    rows = np.flatnonzero(record["stage"] == STAGES.index("bend"))
    if not len(rows):
        return None
    before = Rotation.from_rotvec(record["pose"][rows[0] - 1, 3:])
    rows = rows[1:] if len(rows) > _FEWEST else rows
    rows = rows[record["unstable"][rows] <= 0]
    if not len(rows):
        return None
    turn = (Rotation.from_rotvec(record["pose"][rows, 3:]) * before.inv()).as_rotvec()
    flexible = (record["flexibility"][rows] + record["flexibility"][rows].swapaxes(1, 2)) / 2
    arm = np.array([0.0, 0.0, float(hinge_of(flexible[:1])[1]["lever"][0]) + e.place])
    force = record["load"][rows, None] * np.array([np.cos(e.direction), np.sin(e.direction), 0.0])
    turn -= turn[0] - flexible[0, 3:, 3:] @ np.cross(arm, force[0])
    moment = np.cross(Rotation.from_rotvec(turn).apply(arm), force)
    return Bend(turn[:, :2], moment[:, :2], flexible)


def twist_of(flexibility: Array) -> tuple[Array, Array]:
    """Twist over the turn about x and y that a bend brings with it, (n, 2), and stiffness against other twist (n,)."""
    bend = np.linalg.inv(flexibility[:, 3:5, 3:5])
    twist = np.einsum("ni,nij->nj", flexibility[:, 5, 3:5], bend)
    rest = flexibility[:, 5, 5] - np.einsum("ni,ni->n", twist, flexibility[:, 5, 3:5])
    return twist, 1.0 / rest


def spring_of(bends: Sequence[Bend], axis: float) -> tuple[float, float, float] | None:
    """Spring about an axis (rad from +x): stiffness, knee (rad), and slope beyond over that before.

    Least squares over moments and turns of all bendings that turn far enough.  None: nothing does.
    """
    line = np.array([np.cos(axis), np.sin(axis)])
    seen = [(bend.turn @ line, bend.moment @ line) for bend in bends]
    seen = [(turn, moment) for turn, moment in seen if np.ptp(turn) > _SMALL_TURN]
    if not seen:
        return None
    turn, moment = (np.concatenate(parts) for parts in zip(*seen, strict=True))
    best, found = np.inf, None
    for knee in np.abs(turn).max() * _KNEES:
        columns = np.column_stack([turn, np.sign(turn) * np.maximum(np.abs(turn) - knee, 0.0)])
        stiffness, change = np.linalg.lstsq(columns, moment, rcond=None)[0]
        off = float(np.linalg.norm(columns @ [stiffness, change] - moment))
        if stiffness > 0 and off < best:
            best, found = off, (float(stiffness), float(knee), float(np.clip(1.0 + change / stiffness, *_SLOPES)))
    return found


def largest_turn(items: Sequence[HingeDatum]) -> float:
    """Of all bendings, rad; 0 where there is none."""
    found = [0.0]
    for item in items:
        bending = np.flatnonzero(item.record["stage"] == STAGES.index("bend"))
        if len(bending):
            turn = item.record["pose"][bending, 3:5] - item.record["pose"][bending[0] - 1, 3:5]
            found.append(float(np.linalg.norm(turn, axis=1).max()))
    return max(found)
