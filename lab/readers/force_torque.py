"""Forces, moments and the robot's pose as columns of a CSV that a sidecar or the study explains."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lab.readers.clock import clock
from lab.readers.limits import refuse_saturated
from lab.readers.marker_table import time_column
from lab.readers.options import ForceTorqueOptions, PoseOptions, factor, with_sidecar
from lab.readers.recording import Array, Recording
from lab.readers.rotations import matrix_of
from lab.readers.table import Table, table


class _Found(NamedTuple):
    """Something read, and a sentence on it."""

    values: Array
    note: str


def read_force_torque(path: Path, options: ForceTorqueOptions) -> Recording:
    """Read forces and moments, and the pose where columns of it are named; see ``lab.readers.read``.

    Raises
    ------
    ValueError
        In one line with file, row and column.
    """
    options = with_sidecar(options, path)
    cells = table(path, options.delimiter)
    time, rate, source = clock(path.name, cells.rows, time_column(cells, options), options.rate)
    wrench = _wrench(cells, options)
    pose = _pose(cells, options, time, path) if options.pose else None
    notes = [f"read {path.name}: force and torque, {len(time)} samples, {source}", wrench.note]
    return Recording(
        source=path.name, time=time, rate=rate, rows=cells.rows, wrench=wrench.values,
        pose=pose.values if pose else None, leg=_leg(cells, options), specimen=options.specimen,
        declared=options.declared,
    ).noted("; ".join(notes + ([pose.note] if pose else [])))  # fmt: skip


def _wrench(cells: Table, options: ForceTorqueOptions) -> _Found:
    """Force and moment, (n, 6), N and N m, in the axes of the pose."""
    given = {
        "force": options.force, "force_unit": options.force_unit, "moment": options.moment,
        "moment_unit": options.moment_unit,
    }  # fmt: skip
    lacking = [name for name, value in given.items() if value is None]
    if not (options.force and options.force_unit and options.moment and options.moment_unit):
        raise ValueError(
            f"{cells.name}: {lacking[0]!r} is given neither in the study nor in a sidecar {cells.name}.yaml"
        )
    scales = [factor(cells.name, options.force_unit, "N")] * 3 + [factor(cells.name, options.moment_unit, "N*m")] * 3
    titles = [*options.force, *options.moment]
    units = dict(zip(titles, [options.force_unit] * 3 + [options.moment_unit] * 3, strict=True))
    values = cells.numbers([cells.column(title) for title in titles]) * scales
    refuse_saturated(cells, options.limits, units, flat=titles, flat_samples=options.flat_samples)
    notes = [f"force in {options.force_unit}, moment in {options.moment_unit}"]
    notes.append(
        f"saturation looked for at {len(options.limits)} stated limits and "
        + (f"in {options.flat_samples} equal extreme samples" if options.flat_samples else "nowhere else")
    )
    if options.axes:
        turn = matrix_of(options.axes, cells.name)
        values = np.hstack([values[:, :3] @ turn.T, values[:, 3:] @ turn.T])
        notes.append("sensor's axes turned: " + ", ".join(f"{ours} = its {its}" for ours, its in options.axes.items()))
    return _Found(values, "; ".join(notes))


def _pose(cells: Table, options: ForceTorqueOptions, time: Array, path: Path) -> _Found:
    """Position, and rotation vector from the first sample on, (n, 6), m and rad."""
    pose = options.pose
    assert pose is not None
    if pose.file is None:
        return _Found(_poses(cells, pose), f"pose as {pose.rotation_kind}, in the same rows")
    other = table(path.parent / pose.file, options.delimiter)
    if pose.time is None:
        raise ValueError(f"{path.name}: the pose of {pose.file} needs the title of its time column ('time')")
    column = other.numbers([other.column(pose.time)])[:, 0] * factor(other.name, pose.time_unit, "s")
    clocked, _, _ = clock(other.name, other.rows, column, None)
    values = _poses(other, pose)
    at = time + pose.clock_offset
    # Samples that the robot's file does not cover stay unknown, to be cropped by the user.
    merged = np.stack([np.interp(at, clocked, column, left=np.nan, right=np.nan) for column in values.T], axis=1)
    covered = int((~np.isnan(merged[:, 0])).sum())
    return _Found(merged, f"pose of {pose.file} interpolated linearly, {covered} of {len(at)} samples covered")


def _poses(cells: Table, pose: PoseOptions) -> Array:
    from scipy.spatial.transform import Rotation

    place = cells.numbers([cells.column(title) for title in pose.position]) * factor(cells.name, pose.unit, "m")
    angles = cells.numbers([cells.column(title) for title in pose.rotation])
    wide = 4 if pose.rotation_kind == "quaternion" else 3
    if angles.shape[1] != wide:
        raise ValueError(f"{cells.name}: a rotation as {pose.rotation_kind} has {wide} columns, not {angles.shape[1]}")
    if pose.rotation_kind == "quaternion":
        if (zero := np.linalg.norm(angles, axis=1) == 0).any():
            raise ValueError(f"{cells.name}, row {cells.rows[np.argmax(zero)]}: the quaternion is zero")
        turned = Rotation.from_quat(angles)
    else:
        angles = angles * factor(cells.name, pose.rotation_unit, "rad")
        turned = Rotation.from_rotvec(angles) if pose.rotation_kind == "vector" else Rotation.from_euler("xyz", angles)
    # From the first pose on, so that a tool that points down (half a turn) does not jump by a whole one.
    return np.hstack([place, (turned * turned[0].inv()).as_rotvec()])


def _leg(cells: Table, options: ForceTorqueOptions) -> NDArray[np.int64] | None:
    """Number of the leg at every sample, (n,)."""
    if options.leg is None:
        return None
    numbers = cells.numbers([cells.column(options.leg)])[:, 0]
    wrong = np.flatnonzero(numbers != np.round(numbers))
    if len(wrong):
        raise ValueError(f"{cells.name}, row {cells.rows[wrong[0]]}, column {options.leg!r}: no whole number")
    return numbers.astype(np.int64)
