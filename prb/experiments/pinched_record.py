"""Records of pinched tubes: channels as ``lab.experiments`` names them, and the two halves as a picture."""

from collections.abc import Sequence
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.experiments import PinchedBending
from lab.experiments.pinch_drive import STAGES
from lab.records import Channel, Fields, Record, channels
from lab.specimens import PinchedTube
from prb.experiments.common import DOFS, how
from prb.hinge_curves import HingeState
from prb.tube_statics import Point, flexibility, pose
from prb.tube_walk import Row, Walk

Array = NDArray[np.float64]
_VTK_QUAD = 9
#: Corners of a section.
_CORNERS = 64


def pinched_record(head: dict[str, Any], walk: Walk, rows: Sequence[Row], begin: float, **outcome: Any) -> Record:
    """Record of the increments; ``head``, the time of the begin (s), and ``outcome`` go into it."""
    last = walk.model.pinched(rows[-1].state.parameters) if rows[-1].state else walk.model
    facts = how(walk.tube, last, perf_counter() - begin)
    e = walk.experiment
    notes = list(walk.curves.doubts(walk.tube)) if walk.curves else []
    if walk.limited:
        notes.append(f"force_limit {e.force_limit:g} N was reached before the pinch closed")
    elif walk.curves and rows[-1].share > 0 and not walk.curves.touches(e.pinch_angle):
        notes.append("the walls never touched in what the hinge was fitted to")
    turned = max(float(np.linalg.norm(pose(row.chain, row.bent.joints, walk.tube.length)[3:5])) for row in rows)
    if walk.curves and turned > 1.05 * walk.curves.turned > 0:
        learned, reached = np.rad2deg([walk.curves.turned, turned])
        notes.append(f"it turns by {reached:.3g} deg, and its springs were learned up to {learned:.3g} deg")
    if notes:
        facts["notes"] = notes
    return Record(**head, channels=_channels(walk, rows), how=facts, fields=_fields(rows), **outcome)


def _channels(walk: Walk, rows: Sequence[Row]) -> dict[str, Channel]:
    e, tube, along = walk.experiment, walk.tube, ("increment",)
    forces = np.array([walk.force(row) for row in rows])
    bends = isinstance(e, PinchedBending)
    point = Point(e.place, np.array([np.cos(e.direction), np.sin(e.direction), 0.0])) if bends else None
    flexible = [flexibility(row.chain, row.bent, point) for row in rows]
    poses = np.array([pose(row.chain, row.bent.joints, tube.length) for row in rows])
    sections = np.array([_section(tube, row.state) for row in rows])
    soft = f"change of the pose by a small wrench at the face, NaN where no joint gives; {DOFS}"

    def numbers(name: str, unit: str, values: Any, meaning: str) -> Channel:
        return Channel(name, unit, np.array(values, dtype=float), along, meaning)

    def learned(name: str, unit: str, meaning: str) -> Channel:
        values = [getattr(row.state, name.partition("_")[0]) if row.state else np.nan for row in rows]
        return numbers(name, unit, np.nan_to_num(values) if name == "contact_force" else values, f"{meaning}, learned")

    found = [
        Channel("increment", "1", np.arange(len(rows)), along, "recorded increment"),
        Channel("stage", "1", np.array([STAGES.index(row.stage) for row in rows]), along, "; ".join(STAGES)),
        numbers("travel", "m", [row.state.travel if row.state else 0.0 for row in rows], "travel that F_p works on"),
        numbers("force", "N", forces, "F_p"),
        Channel("pair_force", "N", np.outer(forces, e.shares(tube.pairs)), (*along, "pair"), "force of every pair"),
        learned("gap", "m", "smallest between inner walls"),
        learned("contact_force", "N", "between the walls"),
        learned("strain", "1", "largest principal strain of the wall"),
        Channel("pose", "m, rad", poses, (*along, "dof"), f"motion of the distal block's face from rest; {DOFS}"),
        Channel("section", "m", sections, (*along, "corner", "axis"), "ellipse of the learned flattening"),
        Channel("flexibility", "m/N, rad/N, rad/(N*m)", np.array([f for f, _ in flexible]),
                (*along, "dof", "wrench_dof"), soft),
        Channel("unstable", "1", np.array([n for _, n in flexible]), along, "negative eigenvalues of the tangent"),
    ]  # fmt: skip
    if point is not None:
        pushed = [point.motion(row.chain, row.bent.joints) for row in rows]
        found += [
            numbers("load", "N", [row.bent.load for row in rows], "force on the point along the direction"),
            numbers("pushed", "m", pushed, "motion of the point along the direction from rest"),
        ]
    return channels(*found)


def _section(tube: PinchedTube, state: HingeState | None) -> Array:
    """Ellipse (corners, 2), m, of a flatness and the perimeter of the open tube."""
    flat, axis = state.flatness if state else (0.0, 0.0)
    radius = tube.mid_radius
    small = radius * max(1.0 - flat, 0.02)
    large = radius
    for _ in range(30):  # Ramanujan's perimeter, solved for the larger half-axis
        h = ((large - small) / (large + small)) ** 2
        large += 2 * radius - (large + small) * (1 + 3 * h / (10 + np.sqrt(4 - 3 * h)))
    angle = np.linspace(0.0, 2 * np.pi, _CORNERS, endpoint=False)
    turn = np.array([[np.cos(axis), np.sin(axis)], [-np.sin(axis), np.cos(axis)]])
    return np.asarray(np.column_stack([large * np.cos(angle), small * np.sin(angle)]) @ turn)


def _fields(rows: Sequence[Row]) -> Fields:
    """Middle planes of the two halves: at rest, closed, and at the end."""
    ends = [i for i, row in enumerate(rows) if i + 1 == len(rows) or rows[i + 1].stage != row.stage]
    corners = rows[0].chain.plates(rows[0].chain.slack)
    moved = np.array([rows[i].chain.plates(rows[i].bent.joints) for i in ends]) - corners
    channel = Channel("displacement", "m", moved, ("state", "point", "axis"), "displacement of the halves' corners")
    cells = np.arange(len(corners), dtype=np.int64).reshape(-1, 4)
    return Fields(corners, cells, _VTK_QUAD, np.array(ends, dtype=float), {"displacement": channel})
