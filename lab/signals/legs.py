"""A dense log of a static test, brought to the increments of the experiment's legs."""

import numpy as np
from numpy.typing import NDArray

from lab.experiments import StaticStiffness
from lab.readers.recording import Array, Recording, runs
from lab.signals.gaps import refuse_missing

_MOTIONS = ("along x", "along y", "along z", "about x", "about y", "about z")
#: A leg must come so close to its end, and nothing else may move by more, in shares of the travel.
_REACHED, _HELD = 0.02, 0.05


def find_legs(recording: Recording, experiment: StaticStiffness, window: float) -> Recording:
    """Means of motion and wrench at every increment of every leg, on the way out.

    A leg is a stretch in which one degree of freedom has the largest share of its travel, always to the same
    side, up to the end of that travel; or what the file's column of legs says.  Of each leg the way out
    counts: from its begin to the last sample near its furthest point.

    Parameters
    ----------
    recording
        Poses from which rest has been taken, and wrenches; any clock.
    experiment
        Says which legs there are, and their increments.
    window
        Samples within this share of an increment on either side of it are averaged.

    Raises
    ------
    ValueError
        When a leg is missing, stands twice, ends early, moves something else as well, or has no sample near
        an increment.
    """
    if recording.pose is None or recording.wrench is None:
        lacking = "pose" if recording.pose is None else "forces"
        raise ValueError(f"{recording.source}: legs: the file has no {lacking}; name its columns")
    if "pose" not in recording.rest:
        raise ValueError(
            f"{recording.source}: legs: the pose is not yet the motion from rest; put a step 'rest' before"
        )
    refuse_missing(recording, "finding the legs")
    size = np.repeat([experiment.translation, experiment.rotation], 3)
    share = recording.pose / size
    wide = window / experiment.increments
    picked, numbers = [], []
    for number, (dof, end) in enumerate(experiment.legs()):
        along = np.sign(end) * share[:, dof]
        first, last = _stretch(recording, share, number, dof, float(np.sign(end)), experiment)
        _refuse_side_motion(recording, share, dof, first, last)
        out = np.arange(first, last + 1)
        out = out[: int(np.flatnonzero(along[out] >= along[out].max() - wide)[-1]) + 1]
        for step in range(1, experiment.increments + 1):
            target = step / experiment.increments
            near = out[np.abs(along[out] - target) <= wide + 1e-12]
            if not len(near):
                raise ValueError(
                    f"{recording.at(first, last)}: leg {number} ({_MOTIONS[dof]}): no sample within "
                    f"{100 * window:.3g} % of an increment around {_amount(target * end, dof)}; take a larger window"
                )
            picked.append(near)
            numbers.append(number)
    return _averaged(recording, picked, np.array(numbers, dtype=np.int64), window)


def _stretch(
    recording: Recording, share: Array, number: int, dof: int, sense: float, experiment: StaticStiffness
) -> tuple[int, int]:
    """First and last sample of one leg."""
    name = f"leg {number} ({_MOTIONS[dof]} to {_amount(experiment.legs()[number][1], dof)})"
    along = sense * share[:, dof]
    if recording.leg is not None:
        if unknown := sorted(set(recording.leg.tolist()) - set(range(-1, len(experiment.legs())))):
            raise ValueError(f"{recording.source}: column of legs: {unknown[0]}; legs are 0 to 5, -1 lies between them")
        mine = recording.leg == number
    else:
        moving = np.abs(share).max(axis=1) > min(0.05, 0.5 / experiment.increments)
        mine = moving & (np.abs(share).argmax(axis=1) == dof) & (along > 0)
    found = [(a, b) for a, b in runs(mine) if along[a : b + 1].max() >= 1 - _REACHED]
    if not found:
        furthest = _amount(max(0.0, float(along.max())) * abs(experiment.legs()[number][1]), dof)
        raise ValueError(f"{recording.source}: {name} is not in the record; the furthest that way is {furthest}")
    if len(found) > 1:
        raise ValueError(
            f"{recording.at(*found[0])} and {recording.at(*found[1])}: {name} stands there twice; crop one of them off"
        )
    a, b = found[0]
    if along[a : b + 1].max() > 1 + _REACHED:
        reached = _amount(float(along[a : b + 1].max()) * experiment.legs()[number][1], dof)
        raise ValueError(f"{recording.at(a, b)}: {name} goes on to {reached}; set the experiment's travel to it")
    return a, b


def _refuse_side_motion(recording: Recording, share: Array, dof: int, first: int, last: int) -> None:
    other = np.abs(np.delete(share[first : last + 1], dof, axis=1))
    if other.max() > _HELD:
        row, column = np.unravel_index(other.argmax(), other.shape)
        moved = np.delete(np.arange(6), dof)[column]
        raise ValueError(
            f"{recording.at(first + int(row))}: while the tip moves {_MOTIONS[dof]}, it also moves {_MOTIONS[moved]} "
            f"by {100 * other.max():.3g} % of that travel; it should be held. Are the axes right?"
        )


def _amount(value: float, dof: int) -> str:
    shown = round(value * 1e3, 4) if dof < 3 else round(float(np.degrees(value)), 4)
    return f"{shown:.4g} {'mm' if dof < 3 else 'deg'}"


def _averaged(
    recording: Recording, picked: list[NDArray[np.int64]], numbers: NDArray[np.int64], window: float
) -> Recording:
    """One sample per increment."""
    assert recording.pose is not None
    assert recording.wrench is not None
    counts = [len(part) for part in picked]
    how = "from the motion" if recording.leg is None else "from the file's column"
    return recording.noted(
        f"legs found {how}: {len(set(numbers.tolist()))} legs, ways out only; each of {len(picked)} increments is the "
        f"mean of {min(counts)} to {max(counts)} samples within {100 * window:.3g} % of an increment",
        time=np.array([recording.time[part].mean() for part in picked]),
        rows=np.array([recording.rows[part[len(part) // 2]] for part in picked]),
        pose=np.array([recording.pose[part].mean(axis=0) for part in picked]),
        wrench=np.array([recording.wrench[part].mean(axis=0) for part in picked]),
        markers={}, leg=numbers,
    )  # fmt: skip
