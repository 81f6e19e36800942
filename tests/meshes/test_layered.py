"""Sheets taken from a mesh, and made solid."""

import numpy as np
import pytest
from skfem import Basis, ElementHex2

from lab.specimens import FinnedTube
from meshes import MeshOptions, finned_surface
from meshes.finned_tube import fin_middle, half_thickness
from meshes.gathering import MeshError, element_places
from meshes.layered import body_alone, edge_nodes, layered
from meshes.structured import surface_mesh

TUBE = FinnedTube()
MESH = finned_surface(TUBE, MeshOptions(along=8, across=6, grading_along=0.5), "half")


def test_a_body_alone_keeps_its_places_and_edges():
    counts = {body: len(cells) for body, cells in MESH.subdomains.items()}
    for body, count in counts.items():
        alone = body_alone(MESH, body)
        assert alone.nelements == count
        assert element_places(alone) == pytest.approx(element_places(MESH)[MESH.subdomains[body]], abs=1e-15)
    assert set(body_alone(MESH, "tube").boundaries) == {"side", "lower end", "upper end"}
    fin = body_alone(MESH, "fin")
    assert set(fin.boundaries) == {"crease", "tip", "side", "fin edge"}
    assert fin.doflocs[0].min() > 0 > body_alone(MESH, "other fin").doflocs[0].max()
    assert fin.doflocs[1, edge_nodes(fin, "side")] == pytest.approx(0.0, abs=1e-12)


def test_a_layer_has_the_volume_between_its_faces():
    radius, wall, length = 0.025, 0.0015, 0.05
    mesh = body_alone(MESH, "tube")
    solid, nodes = layered(mesh, half_thickness(TUBE, mesh.doflocs.T, "tube"))
    places = solid.doflocs.T
    assert np.hypot(*places[nodes[:, 0], :2].T) == pytest.approx(radius - wall)
    assert np.hypot(*places[nodes[:, 2], :2].T) == pytest.approx(radius)
    assert places[nodes[:, 1]] == pytest.approx(mesh.doflocs.T, abs=1e-15)
    assert len(np.unique(nodes)) == solid.doflocs.shape[1]
    expected = np.pi * (radius**2 - (radius - wall) ** 2) * length / 2
    assert Basis(solid, ElementHex2()).dx.sum() == pytest.approx(expected, rel=5e-5)


def test_nodes_between_the_faces_of_a_root_lie_on_the_tube():
    fin = body_alone(MESH, "fin")
    middle = fin_middle(TUBE, fin)
    root = edge_nodes(fin, "crease")
    assert np.hypot(*middle[root, :2].T) == pytest.approx(TUBE.radius, rel=1e-12)
    assert np.abs(middle - fin.doflocs.T).max() < 2e-5
    assert np.setdiff1d(np.flatnonzero((middle != fin.doflocs.T).any(axis=1)), root).size == 0
    solid, nodes = layered(fin, half_thickness(TUBE, fin.doflocs.T, "fin"), middle)
    assert solid.doflocs.T[nodes[:, 1]] == pytest.approx(middle, abs=1e-15)


def test_faces_that_fold_are_refused():
    mesh = surface_mesh((2, 2), lambda a, b: np.column_stack([np.cos(3 * a), np.sin(3 * a), b]))
    outwards = mesh.doflocs.T * [1.0, 1.0, 0.0]
    with pytest.raises(MeshError, match="inverted or folded"):
        layered(mesh, 1.5 * outwards)
