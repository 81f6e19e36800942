"""What the cases share: published numbers read from ``reference``, and a table of ours beside them."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest


@pytest.fixture(scope="session")
def reference() -> Callable[[str], np.ndarray]:
    """Rows of a file of ``reference``; its source stands in the file."""
    folder = Path(__file__).parent / "reference"
    return lambda name: np.array(json.loads((folder / f"{name}.json").read_text())["rows"])


@pytest.fixture
def compare(request) -> Callable[..., np.ndarray]:
    """Print reference, ours and error; return the largest deviation of each column over its largest reference."""

    def table(names: list[str], at: np.ndarray, expected: np.ndarray, ours: np.ndarray, run=None) -> np.ndarray:
        expected, ours = np.reshape(expected, (len(at), -1)), np.reshape(ours, (len(at), -1))
        size = np.abs(expected).max(axis=0)
        errors = (ours - expected) / size
        print(f"\n{request.node.name}")
        print(f"{'at':>10}" + "".join(f"{name:>12}{'ours':>12}{'error/max':>11}" for name in names))
        for place, row in zip(at, np.stack([expected, ours, errors], axis=2), strict=True):
            print(f"{place:10.4g}" + "".join(f"{a:12.6g}{b:12.6g}{100 * e:10.3f}%" for a, b, e in row))
        if run is not None and "tangents" in run.history:
            counts = ", ".join(
                f"{run.history[k]} {k.replace('_', ' ')}" for k in ("increments", "cut_back", "tangents")
            )
            print(f"{counts}, {run.wall_time:.1f} s")
        return np.abs(errors).max(axis=0)

    return table
