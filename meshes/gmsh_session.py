"""gmsh without a trace: its own session, no settings of the user's, files that appear whole or not at all."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any


@contextmanager
def gmsh_session() -> Iterator[Any]:
    """The gmsh module, started, silent; complete quadratic cells and MSH 4.1 are set."""
    import gmsh

    gmsh.initialize(["-noenv"], readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Mesh.MshFileVersion", 4.1)
        gmsh.option.setNumber("Mesh.SecondOrderIncomplete", 0)
        yield gmsh
    finally:
        gmsh.finalize()


@contextmanager
def appearing(path: Path) -> Iterator[Path]:
    """A path of the same suffix to write to; it becomes ``path`` at the end, or nothing if that is not reached."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.stem}.{os.getpid()}.tmp{path.suffix}")
    try:
        yield temporary
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)
