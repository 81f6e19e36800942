"""Meshes placed by a function, and merged ones."""

import numpy as np
import pytest
from skfem import Basis, ElementHex2, FacetBasis

from meshes import MeshError, joined, solid_mesh, surface_mesh, thickened
from meshes.gathering import HEXAHEDRON, QUADRILATERAL, element_places, jacobians

RADIUS, LENGTH, WALL = 0.025, 0.1, 0.001


def tube(a, b):
    return np.column_stack([RADIUS * np.cos(2 * np.pi * a), RADIUS * np.sin(2 * np.pi * a), LENGTH * b])


def volume(mesh):
    return Basis(mesh, ElementHex2(), intorder=5).dx.sum()


def test_tube_has_no_seam():
    surface = surface_mesh((12, 5), tube, closed=True)
    assert surface.doflocs.shape == (3, 24 * 11)
    assert {name: len(edges) for name, edges in surface.boundaries.items()} == {"b0": 12, "b1": 12}
    np.testing.assert_array_equal(np.sort(np.concatenate([*surface.boundaries.values()])), surface.boundary_facets())
    np.testing.assert_allclose(np.linalg.norm(surface.doflocs[:2], axis=0), RADIUS, rtol=1e-14)
    solid = solid_mesh((12, 5, 2), thickened(tube, WALL), ("", "", "foot", "head", "inside", "outside"), closed=True)
    assert solid.doflocs.shape == (3, 24 * 11 * 5)
    assert {name: len(faces) for name, faces in solid.boundaries.items()} == {
        "foot": 24, "head": 24, "inside": 60, "outside": 60
    }  # fmt: skip
    assert volume(solid) == pytest.approx(2 * np.pi * RADIUS * LENGTH * WALL, rel=3e-4)
    outside = FacetBasis(solid, ElementHex2(), facets=solid.boundaries["outside"], intorder=5)
    assert outside.dx.sum() == pytest.approx(2 * np.pi * (RADIUS + WALL / 2) * LENGTH, rel=3e-4)


def test_solid_and_surface_describe_the_same_body():
    counts = (4, 3)
    surface = surface_mesh(counts, tube, ("start", "end", "edge", "edge"))
    solid = solid_mesh(
        (*counts, 1), thickened(tube, lambda a, b: WALL * (1 + b)), ("start", "end", "edge", "edge", "", "")
    )
    assert set(surface.boundaries) == set(solid.boundaries) == {"start", "end", "edge"}
    radii = np.linalg.norm(solid.doflocs[:2], axis=0)
    middle = solid.doflocs[:, np.abs(radii - RADIUS) < 1e-9]
    np.testing.assert_allclose(np.sort(middle), np.sort(surface.doflocs), atol=1e-14)
    outer = radii > RADIUS + 1e-9
    np.testing.assert_allclose(radii[outer], RADIUS + WALL / 2 * (1 + solid.doflocs[2, outer] / LENGTH), rtol=1e-9)
    assert jacobians(QUADRILATERAL, element_places(surface)).min() > 0
    assert jacobians(HEXAHEDRON, element_places(solid)).min() > 0


def test_wrong_parameters():
    with pytest.raises(MeshError, match="inverted or folded"):
        solid_mesh((2, 2, 1), lambda a, b, c: np.column_stack([b, a, c]))
    with pytest.raises(ValueError, match="three elements around"):
        surface_mesh((2, 2), tube, closed=True)
    with pytest.raises(ValueError, match="2 counts and 4 names"):
        surface_mesh((2, 2, 2), tube)


def box(offset, count):
    return solid_mesh(
        (count, 2, 1), lambda a, b, c: np.column_stack([offset + a, b, c]), ("l", "r", "s", "s", "z", "z")
    )


def test_joined_bodies():
    whole = joined({"one": box(0.0, 2), "two": box(1.0, 3)})
    assert volume(whole) == pytest.approx(2.0)
    assert whole.doflocs.shape[1] == (2 * 5 + 1) * 5 * 3
    assert len(whole.subdomains["one"]) == 4
    assert len(whole.subdomains["two"]) == 6
    assert len(whole.boundaries["s"]) == 10
    # The left faces of both: one is inside now.
    assert len(whole.boundaries["l"]) == 4
    assert len(np.intersect1d(whole.boundaries["l"], whole.boundary_facets())) == 2


def test_joined_sheets():
    panel = surface_mesh((2, 3), lambda a, b: np.column_stack([a, b, 0 * a]))
    wall = surface_mesh((4, 3), lambda a, b: np.column_stack([1 + 0 * a, b, a]))
    corner = joined({"panel": panel, "wall": wall})
    assert corner.doflocs.shape[1] == (2 * (2 + 4) + 1) * 7
    assert len(corner.boundaries["a0"]) == 6


def test_meshes_that_do_not_fit():
    with pytest.raises(MeshError, match="no corner in common"):
        joined({"one": box(0.0, 1), "two": box(5.0, 1)})
    with pytest.raises(MeshError, match="MeshHex2, MeshQuad2 cannot be merged"):
        joined({"one": box(0.0, 1), "two": surface_mesh((8, 1), tube)})
    bent = solid_mesh((1, 2, 1), lambda a, b, c: np.column_stack([1 + a + 0.3 * b * (0.5 - b) * (1 - b), b, c]))
    with pytest.raises(MeshError, match="place the nodes of their common edge or face"):
        joined({"one": box(0.0, 1), "two": bent})
