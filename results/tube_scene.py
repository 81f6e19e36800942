"""How a pinched tube looks in a scene: wall, pads in another colour, and the rigid blocks at both ends."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.records import Record
from lab.specimens import PinchedTube
from results.painted import add_painted

Array = NDArray[np.float64]

#: Colours from the wall to the pads, of the blocks, and of a load.
_WALL, _PAD, _BLOCK, _LOAD = "#9ecae1", "#e6550d", "#8c8c8c", "#006d2c"
#: Directions from which a whole tube, a bent one and a proximal half are seen.
_WHOLE, _BENT, _CUT = (0.75, -1.0, 0.45), (1.0, -0.45, 0.3), (0.15, -0.3, 1.0)
#: Sides of the polygon that stands for a block's rim.
_SIDES = 96


def add_tube(plotter: Any, record: Record, grid: Any, state: int, cut: bool) -> tuple[float, ...]:
    """Add the deformed tube of one stored state, look at it, and return what the camera shall hold (6,), m.

    Parameters
    ----------
    plotter
        A pyvista plotter at the subplot to draw in.
    grid
        Deformed grid of the state, whose points are in the order of the record's fields.
    cut
        Show the proximal half only, from above: the section at mid-length.
    """
    assert record.fields is not None
    tube, points = PinchedTube.model_validate(dict(record.specimen)), record.fields.points
    grid.point_data["pad"] = pad_share(tube, points)
    if cut:
        cells = record.fields.cells
        heights = np.where(cells >= 0, points[cells, 2], np.nan)
        grid = grid.extract_cells(np.flatnonzero(np.nanmean(heights, axis=1) < tube.length / 2))
    surface = grid.extract_surface(nonlinear_subdivision=2, algorithm=None)
    add_painted(plotter, surface, "pad", (_WALL, _PAD), 50.0, 60.0, 1.2)
    _add_block(plotter, tube, np.zeros(6), outwards=-1.0)
    if not cut:
        row = int(np.argmin(np.abs(record["increment"] - record.fields.values[state])))
        _add_block(plotter, tube, record["pose"][row], outwards=1.0)
        if "load" in record.channels and record["load"][row]:
            _add_load(plotter, tube, record["pose"][row], float(record.experiment["direction"]))
    whole = _BENT if "direction" in record.experiment else _WHOLE
    plotter.view_vector(_CUT if cut else whole, viewup=(0.0, 1.0, 0.0) if cut else (0.0, 0.0, 1.0))
    return _room(tube, grid, cut)


def _room(tube: PinchedTube, grid: Any, cut: bool) -> tuple[float, ...]:
    """One size for all panels, unless the tube is bent out of it."""
    wide, ends = (
        1.5 * tube.radius,
        (0.0, tube.length / 2) if cut else (-tube.block_length, tube.length + tube.block_length),
    )
    least = np.array([[-wide, wide], [-wide, wide], ends])
    bounds = np.reshape(grid.bounds, (3, 2))
    both = np.stack([np.minimum(least, bounds)[:, 0], np.maximum(least, bounds)[:, 1]], axis=1)
    return tuple(float(x) for x in both.ravel())


def _add_block(plotter: Any, tube: PinchedTube, pose: Array, outwards: float) -> None:
    """A block at the tube's proximal (-1) or distal (1) end, moved by ``pose`` (6,), m and rotation vector."""
    import pyvista as pv

    middle = (0.0, 0.0, outwards * tube.block_length / 2)
    block = pv.Cylinder(middle, (0.0, 0.0, 1.0), tube.radius, tube.block_length, _SIDES)
    face = [0.0, 0.0, tube.length if outwards > 0.0 else 0.0]
    block.points = block.points @ rotation(pose[3:]).T + pose[:3] + face
    plotter.add_mesh(block, color=_BLOCK, ambient=0.2)


def _add_load(plotter: Any, tube: PinchedTube, pose: Array, direction: float) -> None:
    """An arrow that pulls at the distal block."""
    import pyvista as pv

    way = np.array([np.cos(direction), np.sin(direction), 0.0])
    start = pose[:3] + rotation(pose[3:]) @ [0.0, 0.0, tube.block_length / 2] + [0.0, 0.0, tube.length]
    arrow = pv.Arrow(
        start + tube.radius * way, way, scale=tube.radius, tip_length=0.35, tip_radius=0.12, shaft_radius=0.05
    )
    plotter.add_mesh(arrow, color=_LOAD, ambient=0.3)


def pad_share(tube: PinchedTube, points: Array) -> Array:
    """1 on pads, falling to 0 over their transition (n,), for points at rest (n, 3), m."""
    spacing = np.pi / tube.pairs
    angle = np.arctan2(points[:, 1], points[:, 0]) - tube.pad_directions()[0]
    around = np.abs((angle + spacing / 2) % spacing - spacing / 2) * tube.mid_radius
    away = [np.maximum(d - tube.pad_width / 2, 0.0) for d in (around, np.abs(points[:, 2] - tube.length / 2))]
    share: Array = np.clip(1.0 - np.hypot(*away) / tube.pad_fillet, 0.0, 1.0)
    return share


def rotation(vector: Array) -> Array:
    """Matrix (3, 3) of a rotation vector (3,), rad."""
    angle = float(np.linalg.norm(vector))
    x, y, z = vector / angle if angle else np.zeros(3)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    matrix: Array = np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross
    return matrix
