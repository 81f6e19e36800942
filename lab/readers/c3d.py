"""C3D files, by ezc3d (imported when one is read)."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from lab.readers.markers import occlusions, wanted
from lab.readers.options import C3dOptions, factor, with_sidecar
from lab.readers.recording import Recording
from lab.readers.rotations import axis_of


def read_c3d(path: Path, options: C3dOptions, names: Sequence[str] | None = None) -> Recording:
    """Read the points of a C3D file; see ``lab.readers.read``.

    A point counts as occluded where its residual is negative, as the format has it, and where it stands
    exactly at the origin, as some programs write it.  Analog channels are left alone.

    Raises
    ------
    ValueError
        In one line with the file.
    """
    import ezc3d

    options = with_sidecar(options, path)
    if not path.is_file():
        raise ValueError(f"{path.name}: no such file in {path.parent.name or '.'}/")
    if path.stat().st_size == 0:
        raise ValueError(f"{path.name}: the file is empty")
    try:
        document = ezc3d.c3d(str(path))
    except (OSError, RuntimeError, ValueError, IndexError) as error:
        raise ValueError(f"{path.name}: not readable as C3D: {' '.join(str(error).split())}") from None
    point = document["parameters"]["POINT"]
    labels = _labels(point)
    points = np.asarray(document["data"]["points"][:3], dtype=np.float64).transpose(1, 2, 0)
    if points.shape[1] < 2:
        raise ValueError(f"{path.name}: {points.shape[1]} frames; at least 2 are needed")
    unseen = (document["data"]["meta_points"]["residuals"][0] < 0) | (points == 0).all(axis=2)
    points[unseen] = np.nan
    chosen = wanted(path.name, labels, names)
    for name in chosen:
        if labels.count(name) > 1:
            raise ValueError(f"{path.name}: {labels.count(name)} points are called {name!r}; rename them")
    unit = str(_first(point, "UNITS", ""))
    scale = factor(path.name, unit, "m")
    if len(labels) < len(points):
        raise ValueError(f"{path.name}: {len(points)} points, but only {len(labels)} names (POINT:LABELS)")
    rate = float(document["header"]["points"]["frame_rate"])
    stated = float(_first(point, "RATE", rate))
    if not rate > 0 or abs(stated / rate - 1) > 1e-4:
        raise ValueError(f"{path.name}: frame rate {rate:g} Hz in the header, {stated:g} Hz in POINT:RATE")
    first = int(document["header"]["points"]["first_frame"]) + 1
    frames = np.arange(first, first + points.shape[1])
    markers = {name: points[labels.index(name)] * scale for name in chosen}
    return Recording(
        source=path.name, time=np.arange(len(frames)) / rate, rate=rate, rows=frames, unit_of_rows="frame",
        markers=markers, up=axis_of(options.up or _up(point)), specimen=options.specimen, declared=options.declared,
    ).noted(
        f"read {path.name}: C3D, {len(frames)} frames at {rate:g} Hz, points in {unit}, {occlusions(markers)}"
    )  # fmt: skip


def _labels(point: Mapping[str, Any]) -> list[str]:
    """Names of all points; beyond 255 they go on in LABELS2 and so forth."""
    parts = ["LABELS", *(f"LABELS{number}" for number in range(2, 256) if f"LABELS{number}" in point)]
    return [str(label).strip() for part in parts for label in point[part]["value"]]


def _first(point: Mapping[str, Any], name: str, default: Any) -> Any:
    values = point[name]["value"] if name in point else []
    return values[0] if len(values) else default


def _up(point: Mapping[str, Any]) -> str | None:
    """The axis that points up on the screen, as ``z`` or ``-y``."""
    text = str(_first(point, "Y_SCREEN", "")).strip().lower().removeprefix("+")
    return text if text in ("x", "y", "z", "-x", "-y", "-z") else None
