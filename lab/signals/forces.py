"""What is done with forces and moments."""

import numpy as np

from lab.readers.recording import Array, Recording
from lab.signals.windows import Window, between


def tare(recording: Recording, window: Window) -> Recording:
    """Take the mean force and moment over a window off all of them.

    Raises
    ------
    ValueError
        When there are none.
    """
    wrench = _wrench_of(recording, "tare")
    part = window.of(recording, "tare")
    zero = wrench[part].mean(axis=0)
    text = ", ".join(f"{value:.4g}" for value in zero)
    return recording.noted(
        f"tare: mean force and moment over {between(recording, part)} taken off ({text} in N, N m)",
        wrench=wrench - zero,
    )


def move_moments(recording: Recording, to: Array) -> Recording:
    """Moments about another point: ``to`` (3,) m, from the sensor's origin, which moves along with it."""
    wrench = _wrench_of(recording, "moments").copy()
    wrench[:, 3:] -= np.cross(to, wrench[:, :3])
    text = ", ".join(f"{value * 1e3:.4g}" for value in to)
    return recording.noted(f"moments taken about the point ({text}) mm from the sensor's origin", wrench=wrench)


def reversed_wrench(recording: Recording) -> Recording:
    """The reaction: what the sensor feels against what it does to the part."""
    return recording.noted("force and moment reversed", wrench=-_wrench_of(recording, "reverse-wrench"))


def _wrench_of(recording: Recording, what: str) -> Array:
    if recording.wrench is None:
        raise ValueError(f"{recording.source}: {what}: the file has no forces and moments")
    return recording.wrench
