"""A record as a hinge: what a fit of kind ``hinge`` reads out of it."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter

from lab.experiments import Experiment, Pinch, PinchedBending
from lab.experiments.pinch_drive import STAGES
from lab.records import Record
from lab.specimens import PinchedTube, Specimen

Array = NDArray[np.float64]
#: Turn below which a bending says nothing about hardening, rad.
_SMALL_TURN = np.deg2rad(1.0)


@dataclass(frozen=True)
class HingeDatum:
    """A record that the fit sees (``used``) or is judged by, under its name in the result."""

    label: str
    used: bool
    record: Record

    @property
    def specimen(self) -> PinchedTube:
        """The tube; ValueError for anything else."""
        found: Any = TypeAdapter(Specimen).validate_python(dict(self.record.specimen))
        if not isinstance(found, PinchedTube):
            raise ValueError(f"{self.label} is of a {found.kind}; a hinge is fitted to a PinchedTube")
        return found

    @property
    def experiment(self) -> Any:
        """``Pinch`` or ``PinchedBending``; ValueError for anything else."""
        found: Any = TypeAdapter(Experiment).validate_python(dict(self.record.experiment))
        if not isinstance(found, Pinch | PinchedBending):
            raise ValueError(f"{self.label} is a {found.kind}; a hinge is fitted to Pinch and PinchedBending")
        return found


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


def hardening(items: Sequence[HingeDatum], *, closed: bool) -> Array | None:
    """Cubic terms about the soft and the stiff axis (2,), N*m/rad^3, zero where nothing turned far enough.

    An open tube has no soft axis: both are that of the turn.  None: no bending at all.
    """
    bendings = [item for item in items if isinstance(item.experiment, PinchedBending)]
    sums = np.zeros((2, 2))
    for item in bendings:
        for place, (turn, moment, stiffness) in enumerate(_turns(item, closed)):
            far = np.abs(turn).max()
            if far > _SMALL_TURN:
                # Of records with other turns, each counts by its own size.
                sums[place] += np.array([turn**3 @ (moment - stiffness * turn), turn**3 @ turn**3]) / far**6
    if not bendings:
        return None
    cubic = np.array([top / bottom if bottom > 0 else 0.0 for top, bottom in sums])
    return cubic if closed else cubic[[0, 0]]


def largest_turn(items: Sequence[HingeDatum]) -> float:
    """Of all bendings, rad; 0 where there is none."""
    found = [0.0]
    for item in items:
        bending = np.flatnonzero(item.record["stage"] == STAGES.index("bend"))
        if len(bending):
            turn = item.record["pose"][bending, 3:5] - item.record["pose"][bending[0] - 1, 3:5]
            found.append(float(np.linalg.norm(turn, axis=1).max()))
    return max(found)


def _turns(item: HingeDatum, closed: bool) -> Iterator[tuple[Array, Array, float]]:
    """Turn, moment and stiffness at rest about the soft, then the stiff axis, by the forces and poses of a record."""
    from scipy.spatial.transform import Rotation

    record, e, tube = item.record, item.experiment, item.specimen
    rows = np.flatnonzero(record["stage"] == STAGES.index("bend"))
    if not len(rows):
        return
    start = rows[0] - 1
    bend, rest = hinge_of(record["flexibility"][[start]])
    moved = record["pose"] - record["pose"][0]
    before = Rotation.from_rotvec(moved[start, 3:])
    face = np.array([0.0, 0.0, tube.length]) + moved[:, :3]
    hinge = face[start] - before.apply([0.0, 0.0, rest["lever"][0]])
    now = Rotation.from_rotvec(moved[rows, 3:])
    turned = (now * before.inv()).as_rotvec()
    force = record["load"][rows, None] * np.array([np.cos(e.direction), np.sin(e.direction), 0.0])
    moment = np.cross(face[rows] + now.apply([0.0, 0.0, e.place]) - hinge, force)
    axis = float(np.angle(bend[0, 1])) / 2 if closed else e.direction + np.pi / 2
    mean, size = float(bend[0, 0].real), float(abs(bend[0, 1])) if closed else 0.0
    for angle, stiffness in ((axis, mean - size), (axis + np.pi / 2, mean + size)):
        line = np.array([np.cos(angle), np.sin(angle), 0.0])
        yield turned @ line, moment @ line, stiffness
