"""The two solid elements: shape functions, quadrature, facets and the order that VTK wants."""

from dataclasses import dataclass
from functools import cache
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from skfem import ElementHex2, ElementQuad2, ElementTetP2, ElementTriP2, MeshHex2, MeshTet2
from skfem.mesh import MeshHex1, MeshTet1
from skfem.quadrature import get_quadrature

from meshes.node_order import VTK_CELL_TYPE, skfem_to_vtk

Array = NDArray[np.float64]
Cells = NDArray[np.int64]


@dataclass(frozen=True)
class SolidElement:
    """An isoparametric solid element of scikit-fem.

    Parameters
    ----------
    name
        What a person calls it.
    element, facet_element, facet_shape
        scikit-fem's elements of the volume and of a facet; the latter's name in ``fea.surface``.
    straight_order, curved_order, mass_order
        Polynomial orders that quadrature integrates exactly: forces of elements with straight and with curved edges
        such that a uniform stress is in equilibrium, and masses.
    volume_order
        Order of the polynomials, in reference coordinates, onto which nearly incompressible laws project the
        volume ratio: the richest that is stable with these displacements.
    pointwise_bulk
        Bulk modulus over shear modulus up to which nothing is projected, see ``fea.body.Body``.
    vtk_type
        VTK's number of the cell.
    """

    name: str
    element: Any
    facet_element: Any
    facet_shape: Literal["quad9", "tri6"]
    straight_order: int
    curved_order: int
    mass_order: int
    volume_order: Literal[0, 1]
    pointwise_bulk: float
    vtk_type: int

    def shapes(self, order: int) -> tuple[Array, Array, Array]:
        """Values (points, k), slopes (points, 3, k) and weights (points,) on the reference element."""
        element = self.element()
        places, weights = self.rule(order)
        pairs = [element.lbasis(places, i) for i in range(len(element.doflocs))]
        values = np.stack([np.broadcast_to(value, places.shape[1]) for value, _ in pairs], axis=1)
        slopes = np.stack([np.broadcast_to(np.asarray(slope), places.shape) for _, slope in pairs], axis=2)
        return values, slopes.transpose(1, 0, 2), weights

    def rule(self, order: int) -> tuple[Array, Array]:
        """Places (3, points) and weights (points,) of the quadrature of an order on the reference element."""
        if self.facet_shape == "tri6" and order == 3:
            return _inner_eight()
        places, weights = get_quadrature(self.element, order)
        return places, weights

    def order_for(self, corners: Array) -> int:
        """Quadrature order that the elements with nodes at ``corners`` (elements, k, 3) need."""
        if self.straight_order == self.curved_order:
            return self.straight_order
        # Vertices come first; an affine map of theirs reaches the other nodes of a straight element.
        places = self.element.doflocs
        affine = np.hstack([1 - places.sum(axis=1, keepdims=True), places])
        off = np.abs(affine @ corners[:, :4] - corners).max(axis=(1, 2))
        size = np.ptp(corners, axis=1).max(axis=1)
        return self.curved_order if (off > 1e-7 * size).any() else self.straight_order

    def facets(self) -> Cells:
        """Nodes of every facet in the facet element's order, its normal outward, (facets, nodes)."""
        return np.array(_facets(self))

    def mirrored(self) -> Cells:
        """Nodes in the order that turns a left-handed element into a right-handed one, (k,)."""
        places = self.element.doflocs
        return _find(places[:, [1, 0, 2]], places)

    def mirrored_facet(self) -> Cells:
        """Nodes of a facet in the order that turns its normal round, (nodes,)."""
        places = self.facet_element.doflocs
        return _find(places[:, [1, 0]], places)

    def vtk_order(self) -> Cells:
        """Nodes in VTK's order, (k,); tetrahedra agree with it."""
        return skfem_to_vtk() if self is HEXAHEDRON else np.arange(len(self.element.doflocs))


def _inner_eight() -> tuple[Array, Array]:
    """Quadrature of degree 3 on the unit tetrahedron, inner points and positive weights, which scikit-fem has not.

    Two times four points at a part t of the way from the centroid to the vertices (backwards where negative). All of
    them together have a share 1 - w, w of the volume.  Degree 2 asks for sum w t^2 = 1/5, degree 3 for
    sum w t^3 = 1/15; one t is free.
    """
    parts, shares = (-0.32, 0.5291149226816985), (0.4503347032087994, 0.5496652967912006)
    corners = np.vstack([np.zeros(3), np.eye(3)])
    places = np.vstack([0.25 + part * (corners - 0.25) for part in parts])
    return places.T, np.repeat(np.array(shares) / 24, 4)


#: 27 points: exact for uniform stress in any element and for products of shape functions in parallelepipeds.
HEXAHEDRON = SolidElement(
    "27-node hexahedron", ElementHex2, ElementQuad2, "quad9", 5, 5, 5, 1, 0.0, VTK_CELL_TYPE
)  # fmt: skip
#: 4 points integrate products of strains exactly and leave no motion but the rigid ones without stiffness
#: (4 x 6 = 30 - 6); with curved edges a uniform stress needs degree 3, 8 points.  24: VTK_QUADRATIC_TETRA.
TETRAHEDRON = SolidElement(
    "10-node tetrahedron", ElementTetP2, ElementTriP2, "tri6", 2, 3, 5, 0, 2.9 / 0.3, 24
)  # fmt: skip


def quadratic(mesh: Any) -> tuple[Any, SolidElement]:
    """The mesh with quadratic nodes and its boundaries, and its element.

    Raises
    ------
    TypeError
        When the mesh is of neither hexahedra nor tetrahedra.
    ValueError
        When it has nodes that no element uses.
    """
    for element, linear, full in ((HEXAHEDRON, MeshHex1, MeshHex2), (TETRAHEDRON, MeshTet1, MeshTet2)):
        if isinstance(mesh, linear):
            _refuse_loose_nodes(mesh)
            if isinstance(mesh, full):
                return mesh, element
            made = full.from_mesh(mesh)
            return full(made.doflocs, made.t, _boundaries=mesh.boundaries, _subdomains=mesh.subdomains), element
    raise TypeError(f"a solid needs a mesh of hexahedra or tetrahedra, not {type(mesh).__name__}")


def _refuse_loose_nodes(mesh: Any) -> None:
    vertices = mesh.doflocs.shape[1] if mesh.nnodes == len(mesh.elem.doflocs) else int(mesh.t.max()) + 1
    loose = np.setdiff1d(np.arange(vertices), mesh.t)
    if len(loose):
        raise ValueError(f"no element uses the nodes {some(loose)} of {vertices}; remove them from the mesh")


def some(numbers: Cells) -> str:
    """The first few of ``numbers`` as text."""
    shown = ", ".join(str(n) for n in numbers[:5])
    return shown if len(numbers) <= 5 else f"{shown} and {len(numbers) - 5} more"


@cache
def _facets(kind: SolidElement) -> tuple[tuple[int, ...], ...]:
    domain, places, flat = kind.element.refdom, kind.element.doflocs, kind.facet_element.doflocs
    result = []
    for corners, normal in zip(domain.facets, domain.normals, strict=True):
        # Second and last corner are the neighbours of the first.
        origin, along, across = (domain.p[:, corners[n]] for n in (0, 1, -1))
        if np.cross(along - origin, across - origin) @ normal < 0:
            along, across = across, along
        on_facet = origin + flat[:, :1] * (along - origin) + flat[:, 1:] * (across - origin)
        result.append(tuple(int(n) for n in _find(on_facet, places)))
    return tuple(result)


def _find(wanted: Array, places: Array) -> Cells:
    """Row of ``places`` of every row of ``wanted``."""
    return np.argmin(np.abs(wanted[:, None] - places[None]).sum(axis=2), axis=1)
