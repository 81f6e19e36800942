"""Meshes of complete quadratic cells with named boundaries: from specimens, files, meshio, or functions.

Importing this room is light: study files need its options, not SciPy.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from meshes.options import MeshOptions

if TYPE_CHECKING:
    from meshes.cad import mesh_cad as mesh_cad
    from meshes.cad import write_cad as write_cad
    from meshes.finned_tube import finned_surface as finned_surface
    from meshes.gathering import MeshError as MeshError
    from meshes.joining import joined as joined
    from meshes.making import Element as Element
    from meshes.making import make_mesh as make_mesh
    from meshes.making import quality_path as quality_path
    from meshes.reading import from_meshio as from_meshio
    from meshes.reading import read_mesh as read_mesh
    from meshes.structured import solid_mesh as solid_mesh
    from meshes.structured import surface_mesh as surface_mesh
    from meshes.structured import thickened as thickened
    from meshes.tube import tube_solid as tube_solid
    from meshes.tube import tube_surface as tube_surface

#: Public names and the modules that hold them, loaded when they are first asked for.
_PUBLIC = {
    "MeshError": "gathering", "joined": "joining", "Element": "making", "make_mesh": "making",
    "quality_path": "making", "from_meshio": "reading", "read_mesh": "reading", "solid_mesh": "structured",
    "surface_mesh": "structured", "thickened": "structured", "mesh_cad": "cad", "write_cad": "cad",
    "tube_solid": "tube", "tube_surface": "tube", "finned_surface": "finned_tube",
}  # fmt: skip

__all__ = ["MeshOptions", *_PUBLIC]  # noqa: PLE0604


def __getattr__(name: str) -> Any:
    if name not in _PUBLIC:
        raise AttributeError(f"meshes has no {name!r}")
    return getattr(import_module(f"meshes.{_PUBLIC[name]}"), name)
