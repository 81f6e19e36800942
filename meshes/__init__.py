"""Meshes of complete quadratic cells with named boundaries: from specimens, files, meshio, or functions."""

from meshes.gathering import MeshError
from meshes.joining import joined
from meshes.making import Element, make_mesh, quality_path
from meshes.options import MeshOptions
from meshes.reading import from_meshio, read_mesh
from meshes.structured import solid_mesh, surface_mesh, thickened

__all__ = [
    "Element", "MeshError", "MeshOptions", "from_meshio", "joined", "make_mesh", "quality_path", "read_mesh",
    "solid_mesh", "surface_mesh", "thickened",
]  # fmt: skip
