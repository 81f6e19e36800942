"""Where the edges of a tube's elements lie: on the pads' edges, even around, crowded along to pads and ends."""

import numpy as np
from numpy.typing import NDArray

from lab.specimens import PinchedTube
from meshes.gathering import MeshError
from meshes.options import MeshOptions
from meshes.twist import graded

Array = NDArray[np.float64]


def stations_around(specimen: PinchedTube, options: MeshOptions) -> Array:
    """Angles of the elements' edges from +x, rad, from the first pad's centre once around.

    Raises
    ------
    MeshError
        Fewer elements than the pads need.
    """
    spacing = np.pi / specimen.pairs
    half, fillet = (size / specimen.mid_radius for size in (specimen.pad_width / 2, specimen.pad_fillet))
    bare = spacing - 2 * (half + fillet)
    free, transition, pad = _shares(options.across, (bare, fillet, half), (1, 2, 2), "across")
    one = _joined((half, pad), (fillet, transition), (bare, free), (fillet, transition), (half, pad))
    every = np.arange(2 * specimen.pairs)[:, None] * spacing + one[:-1]
    return np.append(np.pi / 2 + every.ravel(), 2.5 * np.pi)


def stations_along(specimen: PinchedTube, options: MeshOptions) -> Array:
    """Places z of the elements' edges, m, from the proximal to the distal block; errors as ``stations_around``."""
    width, fillet = specimen.pad_width, specimen.pad_fillet
    bare = specimen.length / 2 - width / 2 - fillet
    pad, transition, free = _shares(options.along, (width, fillet, bare), (1, 2, 2), "along")
    result = _joined((bare, free), (fillet, transition), (width, pad), (fillet, transition), (bare, free))
    crowded = bare * graded(np.linspace(0.0, 1.0, free + 1), options.grading_along, free)
    result[: free + 1] = crowded
    result[-free - 1 :] = specimen.length - crowded[::-1]
    return result


def _shares(total: int, sizes: tuple[float, ...], times: tuple[int, ...], field: str) -> tuple[int, ...]:
    """Numbers of elements, ``total`` in all, of segments: one in the middle, the others on both sides of it.

    Elements go where they are longest.
    """
    counts = np.array([2 - total % 2, 1, 1])
    if total < counts @ times:
        raise MeshError(f"{field} {total} is too coarse to follow pads and transitions: at least 5")
    while counts @ times < total:
        longest = int(np.argmax(np.array(sizes) / counts))
        counts[longest] += 2 // times[longest]
    return tuple(int(number) for number in counts)


def _joined(*segments: tuple[float, int]) -> Array:
    """Ends of even elements in segments (length, number), from zero."""
    steps = np.concatenate([np.full(number, length / number) for length, number in segments])
    return np.concatenate([[0.0], np.cumsum(steps)])
