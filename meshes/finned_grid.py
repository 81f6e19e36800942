"""Where the edges of the elements of a quarter of the tube with fins lie (x >= 0, y >= 0).

Columns run along the tube: from y = 0 over the fin's columns to the crest, x = 0.  Rows run around it; two of them
follow the curves in which the fin's faces meet the tube, go on smoothly beside the fin, and end at the crest, where
rows are even and two end where the pinch does.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lab.specimens import FinnedTube
from meshes.gathering import MeshError
from meshes.options import MeshOptions

Array = NDArray[np.float64]
#: Share of the room between a curve and the tube's end that the curve may rise through beside the fin.
_RISE = 0.5


@dataclass(frozen=True)
class QuarterGrid:
    """Columns and rows by number, halves between them included.

    Parameters
    ----------
    specimen
        Lengths in m.
    across, fin_across
        Columns of elements from y = 0 to the crest, and those of the fin among them.
    along, below
        Rows of elements along the tube, and those below the fin's convex face; the next is between its faces.
    fin_along
        Elements along the fin.
    crest
        z of the rows' edges at the crest (along + 1,), m.
    grading
        0: even rows; 1 minus this shrinks elements at the crease.
    """

    specimen: FinnedTube
    across: int
    fin_across: int
    along: int
    below: int
    fin_along: int
    crest: Array
    grading: float

    def wall(self, column: Array, row: Array) -> tuple[Array, Array]:
        """Angle from +x, rad (n,), and z, m (n,), in the tube's wall of columns and rows (n,)."""
        curves = [self._curve(column, depth) for depth in (1.0, 0.0)]
        share = np.clip(row - self.below, 0.0, 1.0)
        angle = curves[0][0] + share * (curves[1][0] - curves[0][0])
        low = np.floor(np.minimum(row, self.along - 0.25))
        ends = [self._height(column, low + step, curves[0][1], curves[1][1]) for step in (0.0, 1.0)]
        return angle, ends[0] + (row - low) * (ends[1] - ends[0])

    def fin_share(self, share: Array) -> Array:
        """Places on 0..1 from root to tip, crowded to the root; middle nodes half-way between ends."""
        ends = np.linspace(0.0, 1.0, self.fin_along + 1)
        return np.interp(share, ends, 1.0 - crowded(1.0 - ends, self.grading))

    def _height(self, column: Array, row: Array, lower: Array, upper: Array) -> Array:
        """z of whole rows where the two curves are at the heights ``lower`` and ``upper``."""
        above = self.along - self.below - 1
        down = lower * crowded(np.clip(row / self.below, 0.0, 1.0), self.grading)
        up = self.specimen.length - (self.specimen.length - upper) * crowded(
            np.clip((self.along - row) / above, 0.0, 1.0), self.grading
        )
        share = self._beside(column)
        blend = share**2 * (3.0 - 2.0 * share)
        return (1.0 - blend) * np.where(row <= self.below, down, up) + blend * self.crest[row.astype(int)]

    def _beside(self, column: Array) -> Array:
        """0 on the fin, 1 at the crest."""
        return np.clip((column - self.fin_across) / (self.across - self.fin_across), 0.0, 1.0)

    def _curve(self, column: Array, depth: float) -> tuple[Array, Array]:
        """Angle and z of the curve of the fin's face of ``depth`` (1 convex), continued beside the fin."""
        half, share = self.specimen.fin_arc / 2, self._beside(column)
        radius = self.specimen.face_radius(depth)
        psi = half * np.clip(column / self.fin_across, 0.0, 1.0)
        points = self.specimen.root(psi, radius)
        angle = np.arctan2(points[:, 1], points[:, 0])
        step = 1e-6
        (x0, y0, z0), (x1, y1, z1) = self.specimen.root(np.array([half - step, half]), radius)
        edge = float(np.arctan2(y1, x1))
        width = np.pi / 2 - edge
        # What it would rise at its slope; this fades to nothing at the crest, sooner where there is little room.
        rise = float((z1 - z0) / (edge - np.arctan2(y0, x0)) * width)
        room = _RISE * (self.specimen.length - z1)
        fading = max(2.0, rise / room)
        return angle + width * share, points[:, 2] + rise * (1.0 - (1.0 - share) ** fading) / fading


def quarter_grid(specimen: FinnedTube, options: MeshOptions) -> QuarterGrid:
    """Grid of ``options.across`` columns over the quarter and ``options.along`` rows.

    Raises
    ------
    MeshError
        Fewer elements than fin and pinch need.
    """
    across, along = options.across, options.along
    if across < 4 or along < 6:
        raise MeshError(
            f"across {across} and along {along} are too coarse for a tube with fins: at least 4 over a quarter of the "
            "circumference and 6 along"
        )
    fin_across = int(np.clip(round(across * specimen.fin_arc / np.pi), 2, across - 2))
    # By the fin's edge, which wide fins have far above their crown.
    edge = float(specimen.root(np.array([specimen.fin_arc / 2]), specimen.mid_radius)[0, 2])
    below = int(np.clip(round((along - 1) * edge / specimen.length), 2, along - 3))
    fin_along = max(round(along * specimen.fin_length / specimen.length), 3)
    return QuarterGrid(
        specimen, across, fin_across, along, below, fin_along, _crest(specimen, along), options.grading_along
    )


def crowded(place: Array, grading: float) -> Array:
    """Places on 0..1 crowded to 1: x + grading sin(pi x) / pi."""
    return place + grading * np.sin(np.pi * place) / np.pi


def _crest(specimen: FinnedTube, along: int) -> Array:
    """z of the rows' edges at the crest, m: even up to where the pinch begins, along it, and beyond."""
    pinch = min(specimen.chambers.length, 0.8 * specimen.length)
    bare = (specimen.length - pinch) / 2
    counts = np.array([1, 1 + (along - 1) % 2, 1])
    sizes = np.array([bare, pinch, bare])
    while counts.sum() < along:
        # Two at a time, so that the ends stay alike.
        longest = int(np.argmax((sizes / (counts + [0, 1, 0]))[:2]))
        counts += [1, 0, 1] if longest == 0 else [0, 2, 0]
    parts = [np.linspace(0.0, size, n + 1)[1:] for size, n in zip(sizes, counts, strict=True)]
    return np.concatenate([[0.0], parts[0], bare + parts[1], bare + pinch + parts[2]])
