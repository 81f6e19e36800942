"""3D pictures (pyvista), drawn in a child process: VTK without EGL ends in a segmentation fault."""

import json
import signal
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NotRequired, TypedDict

import numpy as np

from lab.records import Fields
from results.fin_scene import add_fins
from results.store import read_record
from results.tube_scene import add_tube

#: What draws the devices that do not look alike all over.
_SHOWN = {"PinchedTube": add_tube, "FinnedTube": add_fins}
#: Colour of a scene: how far every point has moved.
DISPLACEMENT = "displacement"


class Panel(TypedDict):
    """One picture in a row: a record file, the state to show (an index of its stored states), a caption.

    ``cut`` shows the proximal half of a pinched tube, to see the section at mid-length, and a tube with fins along y.
    """

    file: str
    state: int
    caption: str
    cut: NotRequired[bool]


class Scene(TypedDict):
    """A grid of panels in one PNG.

    ``colour`` names a cell field, shown on a logarithmic scale that all panels share; ``displacement`` stands for the
    size of the displacement in each panel, and nothing for the bare mesh.  Tubes show their pads or
    fins instead.
    """

    output: str
    colour: str
    panels: list[Panel]
    columns: int


class Drawing:
    """Scenes that a child process draws while the caller goes on."""

    def __init__(self, scenes: Sequence[Scene]) -> None:
        self._wanted = [Path(scene["output"]) for scene in scenes]
        for path in self._wanted:
            path.unlink(missing_ok=True)
        self._folder = tempfile.TemporaryDirectory()
        spec = Path(self._folder.name) / "scenes.json"
        spec.write_text(json.dumps(list(scenes)), encoding="utf-8")
        command = [sys.executable, "-m", "results.scenes", str(spec)]
        self._child = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)

    def wait(self, timeout: float = 300.0) -> tuple[list[Path], str]:
        """Pictures that were drawn, and why the others were not (empty when all were)."""
        try:
            _, said = self._child.communicate(timeout=timeout)
            reason = "" if not self._child.returncode else _why(self._child.returncode, said)
        except subprocess.TimeoutExpired:
            self._child.kill()
            self._child.communicate()
            reason = f"the renderer took longer than {timeout:.0f} s"
        self._folder.cleanup()
        return [path for path in self._wanted if path.is_file()], reason


def _why(code: int, said: str) -> str:
    last = (said.strip().splitlines() or ["no message"])[-1]
    if code < 0:
        name = signal.Signals(-code).name
        return f"the renderer ended with {name}, as VTK does without EGL (Debian: libegl1); it said: {last}"
    return f"the renderer ended with code {code}: {last}"


def _grid(fields: Fields, state: int, scale: float = 1.0) -> Any:
    """Grid of one state, deformed, with its cell fields."""
    import pyvista as pv

    displacement = fields.point_data["displacement"].values[state]
    cells = np.column_stack([(fields.cells >= 0).sum(axis=1), fields.cells]).ravel()
    types = np.broadcast_to(np.asarray(fields.cell_type, "u1"), len(fields.cells))
    grid = pv.UnstructuredGrid(cells[cells >= 0], types, fields.points + scale * displacement)
    for name, channel in fields.cell_data.items():
        grid.cell_data[name] = channel.values[state]
    return grid


def _draw_scene(scene: Scene) -> None:
    import pyvista as pv

    panels = scene["panels"]
    columns = min(scene["columns"], len(panels))
    rows = -(-len(panels) // columns)
    plotter = pv.Plotter(shape=(rows, columns), off_screen=True, window_size=(420 * columns, 340 * rows), border=False)
    plotter.set_background("white", all_renderers=True)
    records = {file: read_record(Path(file)) for file in dict.fromkeys(panel["file"] for panel in panels)}
    limit = _limit([record.fields for record in records.values() if record.fields], scene["colour"])
    for i, panel in enumerate(panels):
        plotter.subplot(i // columns, i % columns)
        record, room = records[panel["file"]], None
        plotter.view_vector((-0.9, -1.1, 0.7), viewup=(0, 0, 1))
        if record.fields is not None and (add := _SHOWN.get(str(record.specimen.get("kind")))):
            room = add(plotter, record, _grid(record.fields, panel["state"]), panel["state"], panel.get("cut", False))
        elif record.fields is not None:
            _add(plotter, record.fields, panel["state"], scene["colour"], limit, i == 0)
        plotter.add_text(panel["caption"], font_size=8, color="black", position="upper_left")
        plotter.reset_camera(bounds=room)
        plotter.camera.zoom(1.25)
    plotter.screenshot(scene["output"])
    plotter.close()


def _limit(fields: Sequence[Fields], colour: str) -> float:
    """Largest value of a cell field in any panel."""
    return float(max((f.cell_data[colour].values.max() for f in fields if colour in f.cell_data), default=1.0))


def _add(plotter: Any, fields: Fields, state: int, colour: str, limit: float, first: bool) -> None:
    grid = _grid(fields, state)
    if colour == DISPLACEMENT:
        grid.point_data[DISPLACEMENT] = np.linalg.norm(fields.point_data[DISPLACEMENT].values[state], axis=1)
    surface = grid.extract_surface(nonlinear_subdivision=2, algorithm=None)
    if colour == DISPLACEMENT:
        _add_outline(plotter, fields)
        plotter.add_mesh(surface, scalars=DISPLACEMENT, cmap="viridis", show_scalar_bar=False)
    elif colour and colour in fields.cell_data:
        _add_outline(plotter, fields)
        _add_logarithmic(plotter, surface, colour, fields.cell_data[colour].unit, limit, first)
    else:
        plotter.add_mesh(surface, color="#9ecae1", smooth_shading=False)
        plotter.add_mesh(grid.extract_all_edges(), color="black", line_width=1)


def _add_outline(plotter: Any, fields: Fields) -> None:
    """The shape at rest as an outline: a second surface would shine through the first."""
    outline = _grid(fields, 0, scale=0.0).extract_surface(nonlinear_subdivision=2, algorithm=None)
    plotter.add_mesh(outline.extract_feature_edges(40.0), color="grey", line_width=1)


def _add_logarithmic(plotter: Any, surface: Any, colour: str, unit: str, limit: float, first: bool) -> None:
    """A surface by a cell field; logarithmic, since legs and designs differ by orders of magnitude."""
    bar = {
        "title": f"{colour.replace('_', ' ')} [{unit}]", "color": "black", "fmt": "%.0e", "n_labels": 4,
        "title_font_size": 13, "label_font_size": 12,
        "width": 0.8, "height": 0.1, "position_x": 0.1, "position_y": 0.02,
    }  # fmt: skip
    plotter.add_mesh(
        surface, scalars=colour, cmap="viridis", clim=(1e-3 * limit, limit), log_scale=True, show_scalar_bar=first,
        scalar_bar_args=bar if first else {},
    )  # fmt: skip


def main(spec: str) -> None:
    """Draw all scenes of a spec file; the child's entry."""
    for scene in json.loads(Path(spec).read_text(encoding="utf-8")):
        Path(scene["output"]).parent.mkdir(parents=True, exist_ok=True)
        _draw_scene(scene)


if __name__ == "__main__":
    main(sys.argv[1])
