"""Other axes, and displacements from rest."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from lab.readers.recording import Array, Recording
from lab.signals.windows import Window, between


def turned(recording: Recording, rotation: Array, sentence: str, only: Sequence[str] = ()) -> Recording:
    """Places, forces, moments, motions and the up direction in other axes.

    Parameters
    ----------
    recording
        In the old axes.
    rotation
        Proper rotation from old to new components, (3, 3).
    sentence
        For the history.
    only
        ``markers``, ``wrench``, ``pose``: those; none: all.
    """

    def work(name: str, values: Array) -> Array:
        if only and not any(name.startswith(kind.removesuffix("s")) for kind in only):
            return values
        return np.hstack([part @ rotation.T for part in np.split(values, values.shape[1] // 3, axis=1)])

    changes = recording.each(work)
    if not only or "markers" in only:
        changes["up"] = None if recording.up is None else rotation @ recording.up
        changes["rest"] = {name: rotation @ place for name, place in recording.rest.items()}
    return recording.noted(sentence, **changes)


def kabsch(places: Array, targets: Array) -> tuple[Array, Array]:
    """Rotation and shift that bring ``places`` (n, 3) closest to ``targets`` (n, 3), in least squares.

    Kabsch 1976; a mirror image is not admitted.

    Returns
    -------
    rotation, shift
        (3, 3) and (3,) m: target = rotation @ place + shift.

    Raises
    ------
    ValueError
        When the places lie on one line, about which anything could turn.
    """
    middle, goal = places.mean(axis=0), targets.mean(axis=0)
    left, sizes, right = np.linalg.svd((places - middle).T @ (targets - goal))
    if len(places) < 3 or sizes[1] < 1e-6 * sizes[0]:
        raise ValueError("an alignment needs three markers that do not lie on one line")
    sense = np.sign(np.linalg.det(right.T @ left.T))
    rotation = right.T @ np.diag([1.0, 1.0, sense]) @ left.T
    return rotation, goal - rotation @ middle


def align(recording: Recording, places: Mapping[str, Array], tolerance: float, window: Window) -> Recording:
    """Bring the markers into the frame in which some of them have known places.

    Parameters
    ----------
    recording
        Marker places, not displacements.
    places
        Known place of each of three or more markers, (3,), m.
    tolerance
        Largest distance that may remain between a marker's mean place and the known one, m.
    window
        Stretch over which places are averaged.

    Raises
    ------
    ValueError
        When the markers do not fit: another set, another specimen, or a mirrored one.
    """
    refuse_displacements(recording, "align")
    part = window.of(recording, "align")
    for name in places:
        if np.isnan(recording.markers[name][part]).any():
            raise ValueError(
                f"{recording.source}: align: marker {name!r} is occluded within {between(recording, part)}"
            )
    mean = np.array([recording.markers[name][part].mean(axis=0) for name in places])
    known = np.array([places[name] for name in places])
    try:
        rotation, shift = kabsch(mean, known)
    except ValueError as error:
        raise ValueError(f"{recording.source}: align: {error}") from None
    left = np.linalg.norm(mean @ rotation.T + shift - known, axis=1)
    worst = int(left.argmax())
    if left[worst] > tolerance:
        raise ValueError(
            f"{recording.source}: align: marker {list(places)[worst]!r} stays {left[worst] * 1e3:.3g} mm from its "
            f"known place (allowed: {tolerance * 1e3:.3g} mm): another marker set, or a mirrored one"
        )
    markers = {name: values @ rotation.T + shift for name, values in recording.markers.items()}
    return recording.noted(
        f"aligned to the known places of {', '.join(places)} over {between(recording, part)}: at most "
        f"{left[worst] * 1e3:.3g} mm remain; markers only, forces and poses stay in their axes",
        markers=markers, up=None if recording.up is None else rotation @ recording.up,
    )  # fmt: skip


def refuse_displacements(recording: Recording, what: str) -> None:
    """Stop where rest has been taken off already."""
    if recording.rest:
        raise ValueError(
            f"{recording.source}: {what} needs places, but 'rest' has made them displacements; put it before"
        )


def take_rest(recording: Recording, window: Window) -> Recording:
    """Displacements from the mean place over a window; a pose becomes the motion from its mean.

    Raises
    ------
    ValueError
        When a marker is not seen throughout the window.
    """
    from scipy.spatial.transform import Rotation

    refuse_displacements(recording, "rest")
    part = window.of(recording, "rest")
    for name, values in recording.channels().items():
        if np.isnan(values[part]).any():
            raise ValueError(f"{recording.source}: rest: {name} is not seen throughout {between(recording, part)}")
    rest = {name: values[part].mean(axis=0) for name, values in recording.markers.items()}
    changes: dict[str, Any] = {
        "markers": {name: values - rest[name] for name, values in recording.markers.items()},
        "rest": rest,
    }
    notes = []
    if rest:
        spread = max(float(values[part].std(axis=0).max()) for values in recording.markers.values())
        notes.append(f"markers scatter by up to {spread * 1e6:.3g} um (standard deviation)")
    if recording.pose is not None:
        start = Rotation.from_rotvec(recording.pose[part, 3:]).mean()
        seen = ~np.isnan(recording.pose).any(axis=1)
        motion = np.full_like(recording.pose, np.nan)
        motion[:, :3] = recording.pose[:, :3] - recording.pose[part, :3].mean(axis=0)
        motion[seen, 3:] = (Rotation.from_rotvec(recording.pose[seen, 3:]) * start.inv()).as_rotvec()
        changes |= {"pose": motion, "rest": rest | {"pose": recording.pose[part, :3].mean(axis=0)}}
        notes.append("pose became motion")
    return recording.noted(f"rest: mean over {between(recording, part)}; {'; '.join(notes)}", **changes)
