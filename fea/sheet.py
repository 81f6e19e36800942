"""A thin body of shells or of hexahedra, known by its middle surface."""

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from fea.body import Body
from fea.parts import Deformable
from fea.shell import Shell
from fea.surface import FROM_BELOW, Surface
from lab.materials import Material
from meshes.layered import edge_nodes, layered
from meshes.making import Element

if TYPE_CHECKING:
    from skfem import MeshQuad2

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Face = Literal["lower", "upper"]


@dataclass(frozen=True, repr=False)
class Sheet:
    """A part of a case with nodes on both faces of a middle surface.

    Attributes
    ----------
    mesh
        The middle surface; nodes of the surface are its.
    part
        One layer of elements on it.
    through
        Nodes in the case from the lower to the upper face (surface nodes, layers).
    """

    mesh: "MeshQuad2"
    part: Deformable
    through: Ints

    @classmethod
    def make(
        cls, mesh: "MeshQuad2", half: Array, material: Material, element: Element, first: int,
        middle: Array | None = None,
    ) -> "Sheet":  # fmt: skip
        """Shells or 27-node hexahedra between the faces ``mesh`` -+ ``half`` (n, 3), m.

        ``first`` is their first node in the case.

        ``middle``: nodes of a solid between the faces, see ``meshes.layered``.
        """
        if element == "shell":
            thickness = 2.0 * np.linalg.norm(half, axis=1)
            part = Shell(mesh, thickness, material, directors=2.0 * half / thickness[:, None])
            return cls(mesh, part, first + np.stack([part.bottom, part.top], axis=1))
        solid, through = layered(mesh, half, middle)
        return cls(mesh, Body(solid, material), first + through)

    @cached_property
    def mid(self) -> Array:
        """Middle surface at rest (surface nodes, 3), m."""
        return np.ascontiguousarray(self.mesh.doflocs.T)

    @property
    def cells(self) -> Ints:
        """Surface nodes of every element (elements, 9)."""
        return np.asarray(self.mesh.dofs.element_dofs.T, dtype=np.int64)

    def edge(self, name: str) -> Ints:
        """Surface nodes on a named edge, ascending."""
        return edge_nodes(self.mesh, name)

    def face(self, face: Face, cells: Ints | slice = slice(None)) -> Surface:
        """One face, or that of some elements, its normal out of the part."""
        nodes = self.cells[cells]
        return Surface(self.through[nodes[:, FROM_BELOW], 0] if face == "lower" else self.through[nodes, -1])

    def moved(self, x: Array, nodes: Ints) -> Array:
        """Displacements (..., 3), m, of surface nodes, half-way between the faces; ``x`` is the case's (N, 3), m."""
        return 0.5 * (x[self.through[nodes, 0]] + x[self.through[nodes, -1]])

    def now(self, x: Array, nodes: Ints) -> Array:
        """Where surface nodes are (..., 3), m."""
        return self.mid[nodes] + self.moved(x, nodes)
