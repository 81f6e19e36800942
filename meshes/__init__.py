"""Specimen to mesh: structured quadratic hexahedra by gmsh, with named groups and quality figures."""

from meshes.making import make_mesh, quality_path
from meshes.options import MeshOptions
from meshes.reading import read_mesh

__all__ = ["MeshOptions", "make_mesh", "quality_path", "read_mesh"]
