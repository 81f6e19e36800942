"""How a tube with fins looks in a scene: tube, fins in another colour, load fins, and the point P."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.records import Record
from lab.specimens import FinnedTube
from results.painted import add_painted

Array = NDArray[np.float64]

#: Colours of the wall and of the fins, of P, and of the outline at rest.
_WALL, _FIN, _P, _REST = "#9ecae1", "#fdae6b", "#d62728", "#999999"
#: Directions from which the device is seen: from the side above, and along y.
_WHOLE, _ALONG_Y = (0.55, -1.0, 0.75), (0.0, -1.0, 0.0)
#: A point of the middle plane is this close to it, m.
_CLOSE = 1e-6


def add_fins(plotter: Any, record: Record, grid: Any, state: int, along_y: bool) -> tuple[float, ...]:
    """Add the deformed device of one stored state, look at it, and return what the camera shall hold (6,), m.

    Parts of a device that symmetry spared the performer are added as mirror images.

    Parameters
    ----------
    plotter
        A pyvista plotter at the subplot to draw in.
    grid
        Deformed grid of the state, whose points are in the order of the record's fields.
    along_y
        Look along y, at the plane in which the fins travel.
    """
    import pyvista as pv

    assert record.fields is not None
    device, points = FinnedTube.model_validate(dict(record.specimen)), record.fields.points
    grid.point_data["fin"] = fin_share(device, points)
    surface = grid.extract_surface(nonlinear_subdivision=2, algorithm=None)
    mirrored = [axis for axis in (0, 1) if points[:, axis].min() > -_CLOSE]
    whole = _whole(surface, mirrored)
    add_painted(plotter, whole, "fin", (_WALL, _FIN), 40.0, 50.0, 1.0)
    rest = pv.UnstructuredGrid(grid)
    rest.points = points.copy()
    before = _whole(rest.extract_surface(nonlinear_subdivision=2, algorithm=None), mirrored)
    plotter.add_mesh(before.extract_feature_edges(50.0, manifold_edges=False), color=_REST, line_width=1.0)
    if "p" in record.channels:
        row = int(np.argmin(np.abs(record["increment"] - record.fields.values[state])))
        plotter.add_mesh(pv.Sphere(device.fin_thickness, device.tip_corner + record["p"][row]), color=_P, ambient=0.3)
    plotter.view_vector(_ALONG_Y if along_y else _WHOLE, viewup=(0.0, 0.0, 1.0))
    return _room(device)


def _whole(surface: Any, mirrored: list[int]) -> Any:
    """The surface with its mirror images across these axes, without seams between them."""
    for axis in mirrored:
        # Faces in the mirror are inside the device.
        middles = surface.cell_centers().points[:, axis]
        surface = surface.extract_cells(np.flatnonzero(np.abs(middles) > _CLOSE)).extract_surface(algorithm=None)
        image = surface.copy()
        image.points[:, axis] *= -1.0
        surface = surface.merge(image.flip_faces()).clean(tolerance=_CLOSE, absolute=True)
    return surface


def fin_share(device: FinnedTube, points: Array) -> Array:
    """1 on fins, 0 on the tube (n,), for points at rest (n, 3), m: fins begin outside the tube's wall."""
    outside = np.hypot(points[:, 0], points[:, 1]) - device.radius
    share: Array = np.clip(outside / (0.25 * device.fin_thickness), 0.0, 1.0)
    return share


def _room(device: FinnedTube) -> tuple[float, ...]:
    """One size for all panels: the device at rest, and fins that close."""
    tip = device.root_middle + device.fin_length * device.fin_axis
    reach = 1.1 * max(abs(float(tip[0])), 1.3 * device.radius)
    top = max(float(tip[2]) + 0.3 * device.fin_length, device.length)
    return (-reach, reach, -device.radius, device.radius, min(0.0, float(tip[2])), top)
