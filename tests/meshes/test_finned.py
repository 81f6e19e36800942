"""Meshes and CAD solids of the tube with fins."""

import numpy as np
import pytest
from scipy.spatial import cKDTree
from skfem.quadrature import get_quadrature
from skfem.refdom import RefQuad

from lab.specimens import FinnedTube, PinchedTube
from lab.specimens.finned_tube import Chambers
from meshes import MeshError, MeshOptions, make_mesh, read_mesh
from meshes.finned_grid import quarter_grid
from meshes.finned_size import chamber_volume, fin_volume, surface_area, tube_volume
from meshes.finned_tube import (
    PARTS,
    fin_parameters,
    finned_surface,
    half_thickness,
)
from meshes.gathering import QUADRILATERAL, element_places, jacobians

DEG = np.pi / 180
COARSE = MeshOptions(along=12, across=8, grading_along=0.4)
TUBE = FinnedTube()


def design(arc, angle, **fields):
    return FinnedTube(fin_arc=arc * DEG, attachment_angle=angle * DEG, **fields)


def nodes(mesh, body):
    return np.unique(mesh.dofs.element_dofs[:, mesh.subdomains[body]])


def edge(mesh, name, body="fin"):
    """Nodes of an edge of one body, middle nodes included."""
    return np.intersect1d(mesh.dofs.get_facet_dofs(mesh.boundaries[name]).flatten(), nodes(mesh, body))


@pytest.mark.parametrize("arc", [35, 65, 75, 90, 105, 120])
@pytest.mark.parametrize("angle", [35, 43, 60, 75, 90])
@pytest.mark.parametrize("options", [COARSE, MeshOptions(along=16, across=12, grading_along=0.0)])
def test_roots_coincide_with_the_tubes_outer_layer_and_elements_are_sound(arc, angle, options):
    tube = design(arc, angle)
    mesh = finned_surface(tube, options, "quarter")
    points, places = mesh.doflocs.T, element_places(mesh)
    wall, root = nodes(mesh, "tube"), edge(mesh, "crease")
    outside = points[wall] + half_thickness(tube, points[wall], "tube")
    np.testing.assert_allclose(np.hypot(*outside.T[:2]), tube.radius, rtol=1e-14)
    arm = half_thickness(tube, points[root], "fin")
    for layer in (points[root] - arm, points[root] + arm):
        np.testing.assert_allclose(np.hypot(*layer.T[:2]), tube.radius, atol=1e-15)
        assert cKDTree(outside).query(layer)[0].max() < 1e-12
    assert len(root) == 2 * quarter_grid(tube, options).fin_across + 1
    share = jacobians(QUADRILATERAL, places)
    assert (share.min(axis=1) / share.max(axis=1)).min() > 0.15
    sides = np.linalg.norm(places[:, :4] - places[:, [1, 2, 3, 0]], axis=2)
    assert (sides.max(axis=1) / sides.min(axis=1)).max() < 5.0


@pytest.mark.parametrize("angle", [20, 35, 60, 90, 120])
def test_all_nodes_lie_on_their_cylinders_and_faces_are_parallel(angle):
    tube = design(65, angle)
    mesh = finned_surface(tube, COARSE)
    points = mesh.doflocs.T
    np.testing.assert_allclose(np.hypot(*points[nodes(mesh, "tube")].T[:2]), tube.mid_radius, rtol=1e-14)
    fin = points[nodes(mesh, "fin")]
    arm = half_thickness(tube, fin, "fin")
    for depth, layer in ((0.0, fin - arm), (0.5, fin), (1.0, fin + arm)):
        off = np.cross(layer - tube.fin_centre, tube.fin_axis)
        np.testing.assert_allclose(np.linalg.norm(off, axis=1), tube.face_radius(depth), rtol=1e-12)
    psi, s = fin_parameters(tube, fin)
    assert np.abs(psi).max() == pytest.approx(tube.fin_arc / 2, rel=1e-12)
    # Far from the root directors are normal to the surface, and the tip is cut across the generators.
    far = s > tube.crown_along + 8 * tube.fin_thickness
    np.testing.assert_allclose(np.linalg.norm(arm[far], axis=1), tube.fin_thickness / 2, rtol=1e-12)
    tip = fin_parameters(tube, points[edge(mesh, "tip")])[1]
    np.testing.assert_allclose(tip, tube.tip_along, rtol=1e-12)


@pytest.mark.parametrize("angle", [35, 60, 90])
def test_the_root_is_nearly_plane_as_the_crease_of_the_middle_surfaces_is(angle):
    """The mean of the two faces' curves lies off the crease's plane, for the fin ends on the tube's outside."""
    tube = design(65, angle)
    mesh = finned_surface(tube, COARSE, "half-x")
    root = mesh.doflocs.T[edge(mesh, "crease")]
    half = tube.attachment_angle / 2
    off = root @ [np.sin(half), 0, np.cos(half)] - tube.fin_centre[2] * np.cos(half)
    # At the crown two straight lines, half a wall apart, meet the plane that halves their angle.
    crown = np.argmin(np.abs(root[:, 1]))
    assert off[crown] == pytest.approx(tube.wall / (4 * np.sin(half)), rel=1e-9)
    assert np.ptp(off) < 0.15 * tube.wall


@pytest.mark.parametrize("part", PARTS)
def test_upper_sides_are_the_convex_ones(part):
    mesh = finned_surface(TUBE, COARSE, part)
    frame = element_places(mesh)
    normals = np.cross(frame[:, 1] - frame[:, 0], frame[:, 3] - frame[:, 0])
    for body, cells in mesh.subdomains.items():
        outwards = half_thickness(TUBE, frame[cells, 8], body)
        cosine = np.einsum("ec,ec->e", normals[cells], outwards)
        assert (cosine > 0.5 * np.linalg.norm(normals[cells], axis=1) * np.linalg.norm(outwards, axis=1)).all()


@pytest.mark.parametrize("part", PARTS)
def test_parts_have_their_edges_and_are_pieces_of_the_whole(part):
    mesh, whole = finned_surface(TUBE, COARSE, part), finned_surface(TUBE, COARSE)
    points = mesh.doflocs.T
    every = cKDTree(whole.doflocs.T)
    assert every.query(points)[0].max() < 1e-12
    cuts = {"whole": set(), "half": {"side"}, "half-x": {"crest"}, "quarter": {"side", "crest"}}[part]
    assert set(mesh.boundaries) == {"lower end", "upper end", "crease", "tip", "fin edge"} | cuts
    assert set(mesh.subdomains) == {"tube", "fin"} | ({"other fin"} if part in ("whole", "half") else set())
    for name, axis in (("side", 1), ("crest", 0)):
        if name in cuts:
            assert points[:, axis].min() > -1e-15
            on = np.flatnonzero(np.abs(points[:, axis]) < 1e-12)
            np.testing.assert_array_equal(np.unique(mesh.dofs.get_facet_dofs(mesh.boundaries[name]).flatten()), on)
    for name, z in (("lower end", 0.0), ("upper end", TUBE.length)):
        np.testing.assert_allclose(mesh.p[2, mesh.facets[:, mesh.boundaries[name]]], z, atol=1e-15)
    named = np.concatenate(list(mesh.boundaries.values()))
    np.testing.assert_array_equal(np.sort(named), np.sort(mesh.boundary_facets()))


def test_the_whole_is_its_own_mirror_image():
    points = finned_surface(TUBE, COARSE).doflocs.T
    every = cKDTree(points)
    for mirror in ([-1, 1, 1], [1, -1, 1]):
        assert every.query(points * mirror)[0].max() < 1e-14


@pytest.mark.parametrize("length", [0.006, 0.014, 0.030])
def test_elements_at_the_crest_end_where_the_pinch_does(length):
    tube = FinnedTube(chambers=Chambers(length=length))
    mesh = finned_surface(tube, COARSE, "quarter")
    z = np.sort(mesh.p[2, np.unique(mesh.facets[:, mesh.boundaries["crest"]])])
    for end in (tube.length / 2 - length / 2, tube.length / 2 + length / 2):
        assert np.abs(z - end).min() < 1e-15
    assert np.diff(z).min() > 0.4 * np.diff(z).max()


def test_areas_approach_those_of_the_surfaces():
    off = []
    _, weights = get_quadrature(RefQuad, 7)
    for options in (COARSE, COARSE.refined()):
        mesh = finned_surface(TUBE, options)
        places = element_places(mesh)
        for body, cells in mesh.subdomains.items():
            # The rule's own points lie between the centre and the nodes.
            share = jacobians(QUADRILATERAL, places[cells], 7)[:, 1 : 1 + len(weights)]
            off.append(float((share @ weights).sum()) / surface_area(TUBE, body) - 1)
    assert np.abs(off[:3]).max() < 5e-6
    assert np.abs(off[3:]).max() < 0.1 * np.abs(off[:3]).max()


def test_sizes_against_closed_forms_and_fine_sums():
    straight = design(65, 90)
    psi = (np.arange(20000) + 0.5) / 20000 * straight.fin_arc - straight.fin_arc / 2
    # At 90 deg the root lies at s = sqrt(R^2 - r^2 sin^2 psi) on the face of radius r.
    radii = straight.face_radius(0.0) + (np.arange(200) + 0.5) / 200 * straight.fin_thickness
    along = [straight.tip_along - np.sqrt(straight.radius**2 - (r * np.sin(psi)) ** 2).mean() for r in radii]
    expected = straight.fin_arc * straight.fin_thickness * np.mean(radii * along)
    assert fin_volume(straight) == pytest.approx(expected, rel=1e-6)
    assert surface_area(straight, "fin") * straight.fin_thickness == pytest.approx(expected, rel=1e-3)
    assert tube_volume(TUBE) == pytest.approx(2 * np.pi * TUBE.mid_radius * TUBE.wall * TUBE.length)
    chambers = TUBE.chambers
    flat = chambers.width * chambers.length * chambers.height - 4.2e-3 * 13.2e-3 * 4.6e-3
    # The curved floor lies less deep beside the middle.
    assert 0.9 * flat < chamber_volume(TUBE) < flat
    for part, share in (("half", 0.5), ("half-x", 1.0), ("quarter", 0.5)):
        assert surface_area(TUBE, "fin", part) == share * surface_area(TUBE, "fin")


@pytest.mark.parametrize("part", PARTS)
def test_gmsh_makes_the_same_mesh(tmp_path, part):
    path = tmp_path / "finned.msh"
    figures = make_mesh(TUBE, COARSE, path, "shell", part)
    mesh, direct = read_mesh(path), finned_surface(TUBE, COARSE, part)
    assert figures["elements"] == mesh.t.shape[1] == direct.t.shape[1]
    assert figures["nodes"] == mesh.doflocs.shape[1] == direct.doflocs.shape[1]
    assert abs(figures["area_deviation"]) < 5e-6
    assert figures["min_sicn"] > 0.5
    assert figures["max_aspect_ratio"] < 3.0
    assert cKDTree(mesh.doflocs.T).query(direct.doflocs.T)[0].max() < 1e-14
    for there, here in ((mesh.boundaries, direct.boundaries), (mesh.subdomains, direct.subdomains)):
        assert {name: len(found) for name, found in there.items()} == {name: len(f) for name, f in here.items()}
    fin = read_mesh(path, group="fin")
    assert fin.t.shape[1] == len(direct.subdomains["fin"])
    assert "crease" in fin.boundaries
    assert "lower end" not in fin.boundaries
    frame = element_places(mesh)[mesh.subdomains["fin"]]
    normals = np.cross(frame[:, 1] - frame[:, 0], frame[:, 3] - frame[:, 0])
    assert (np.einsum("ec,ec->e", normals, half_thickness(TUBE, frame[:, 8], "fin")) > 0).all()


def test_what_cannot_be_meshed_says_why(tmp_path):
    with pytest.raises(MeshError, match="no mesh of hexahedra.*choose element shell"):
        make_mesh(TUBE, COARSE, tmp_path / "finned.msh", "solid")
    with pytest.raises(MeshError, match="part 'eighth': a tube with fins has whole, half, half-x, quarter"):
        make_mesh(TUBE, COARSE, tmp_path / "finned.msh", "shell", "eighth")
    with pytest.raises(MeshError, match="part 'quarter': a pinched tube has the whole and an eighth"):
        make_mesh(PinchedTube(), COARSE, tmp_path / "finned.msh", "shell", "quarter")
    with pytest.raises(MeshError, match="across 3 and along 5 are too coarse"):
        finned_surface(TUBE, MeshOptions(along=5, across=3))
    assert not list(tmp_path.iterdir())
