"""Structured meshes of the pinched tube."""

import numpy as np
import pytest
from scipy.spatial import cKDTree
from skfem import Basis, ElementHex2

from lab.pinching import pair_spacing
from lab.specimens import PinchedTube, TwistedBeam
from meshes import MeshError, MeshOptions, make_mesh, read_mesh
from meshes.gathering import element_places
from meshes.tube import (
    imperfection,
    pad_share,
    radial_directions,
    tube_solid,
    tube_surface,
    wall_thickness,
)
from meshes.tube_size import wall_area, wall_volume

OPTIONS = MeshOptions(along=12, across=6, through=1, grading_along=0.5)
IDEAL = PinchedTube(imperfection=0.0)


def polar(points):
    return np.hypot(points[:, 0], points[:, 1]), np.arctan2(points[:, 1], points[:, 0])


@pytest.mark.parametrize("pairs", [1, 2, 3, 5])
def test_pads_lie_on_nodes_and_edges_in_their_planes(pairs):
    tube = PinchedTube(pairs=pairs, pad_width=0.005, pad_fillet=0.002)
    mesh = tube_surface(tube, OPTIONS)
    assert mesh.t.shape[1] == 2 * pairs * 6 * 12
    points = mesh.p.T
    half = tube.pad_width / 2
    for angle in tube.pad_directions():
        for turn in (0.0, -half / tube.mid_radius, half / tube.mid_radius):
            for z in (0.05, 0.05 - half, 0.05 + half):
                wanted = np.array([np.cos(angle + turn), np.sin(angle + turn)])
                near = np.abs(points[:, 2] - z) < 1e-9
                assert (points[near][:, :2] @ wanted / polar(points[near])[0]).max() > 1 - 1e-12
    for name, z in (("root", 0.0), ("tip", 0.1)):
        edge = points[mesh.facets[:, mesh.boundaries[name]].ravel()]
        np.testing.assert_allclose(edge[:, 2], z, atol=1e-15)
        np.testing.assert_allclose(polar(edge)[0], tube.mid_radius, rtol=1e-12)
        assert len(mesh.boundaries[name]) == 2 * pairs * 6
    assert len(mesh.boundary_facets()) == 2 * 2 * pairs * 6


@pytest.mark.parametrize("size", ["fea-tube", "printed-tpu", "pet"])
@pytest.mark.parametrize("part", ["whole", "eighth"])
def test_normals_point_outwards(size, part):
    mesh = tube_surface(PinchedTube(size=size), OPTIONS, part)
    frame = element_places(mesh)
    normals = np.cross(frame[:, 1] - frame[:, 0], frame[:, 3] - frame[:, 0])
    outwards = np.einsum("ec,ec->e", normals, radial_directions(PinchedTube(), frame[:, 8]))
    assert (outwards > 0.5 * np.linalg.norm(normals, axis=1)).all()


def test_surface_and_thickness_are_the_solid():
    """Middle surface, radial directions and thickness together reach the solid's faces, which the pads thicken."""
    tube = PinchedTube(imperfection=0.0004)
    surface, solid = tube_surface(tube, OPTIONS), tube_solid(tube, OPTIONS)
    points = surface.doflocs.T
    arm = 0.5 * wall_thickness(tube, points)[:, None] * radial_directions(tube, points)
    every = cKDTree(solid.doflocs.T)
    for face, places in (("inside", points - arm), ("outside", points + arm)):
        assert every.query(places)[0].max() < 1e-15
        corners = np.unique(solid.facets[:, solid.boundaries[face]])
        assert cKDTree(places).query(solid.p.T[corners])[0].max() < 1e-15
    thickness = wall_thickness(tube, points)
    assert thickness.max() == pytest.approx(0.003, rel=1e-12)
    assert thickness.min() == pytest.approx(0.001, rel=1e-12)
    centre = tube.mid_radius * np.column_stack([np.cos(tube.pad_directions()), np.sin(tube.pad_directions())])
    np.testing.assert_allclose(pad_share(tube, np.column_stack([centre, np.full(6, 0.05)])), 1.0)
    # On a transition half-way, and beyond it.
    beside = (np.pi / 2 + np.array([4.5e-3, 6.1e-3]) / tube.mid_radius)[:, None]
    places = np.hstack([np.cos(beside), np.sin(beside), np.full((2, 1), 0.05)])
    np.testing.assert_allclose(pad_share(tube, places), [0.25, 0.0], atol=1e-12)


def test_imperfection_has_its_size_no_symmetry_and_does_not_reach_the_blocks():
    tube = PinchedTube(imperfection=0.0003)
    angle, z = (grid.ravel() for grid in np.meshgrid(np.linspace(0, 2 * np.pi, 361), np.linspace(0, 0.1, 101)))
    found = imperfection(tube, angle, z)
    assert np.abs(found).max() == pytest.approx(0.0003, rel=1e-3)
    assert np.abs(found[(z == 0) | (z == 0.1)]).max() < 1e-12
    for turn in np.arange(1, 6) * pair_spacing(3):
        for image in (angle + turn, turn - angle):
            for height in (z, 0.1 - z):
                assert np.abs(imperfection(tube, image, height) - found).max() > 1e-4
    assert np.abs(imperfection(tube, -angle, z) - found).max() > 1e-4
    assert np.abs(imperfection(tube, angle, 0.1 - z) - found).max() > 1e-4
    turned = tube.model_copy(update={"imperfection_angle": 0.4})
    np.testing.assert_allclose(imperfection(turned, angle + 0.4, z), found, atol=1e-15)
    # The mesh has it, as a radius.
    ideal, real = (tube_surface(t, OPTIONS).doflocs.T for t in (tube.model_copy(update={"imperfection": 0.0}), tube))
    wanted = imperfection(tube, polar(ideal)[1], ideal[:, 2])
    np.testing.assert_allclose(polar(real)[0] - polar(ideal)[0], wanted, atol=1e-12)


@pytest.mark.parametrize("pairs", [1, 2, 3])
def test_eighth_is_an_eighth_of_the_ideal_tube(pairs):
    tube = IDEAL.model_copy(update={"pairs": pairs})
    whole, eighth = tube_solid(tube, OPTIONS), tube_solid(tube, OPTIONS, "eighth")
    assert cKDTree(whole.doflocs.T).query(eighth.doflocs.T)[0].max() < 1e-15
    volumes = [Basis(mesh, ElementHex2(), intorder=5).dx.sum() for mesh in (whole, eighth)]
    assert volumes[0] / volumes[1] == pytest.approx(8.0, rel=1e-9)
    planes = {"side": (1, 0.0), "crest": (0, 0.0), "middle": (2, 0.05), "tip": (2, 0.1)}
    for name, (axis, at) in planes.items():
        np.testing.assert_allclose(eighth.p[axis, eighth.facets[:, eighth.boundaries[name]]], at, atol=1e-15)
    named = np.concatenate([eighth.boundaries[name] for name in (*planes, "inside", "outside")])
    np.testing.assert_array_equal(np.sort(named), np.sort(eighth.boundary_facets()))


def test_fine_sums_are_the_known_volume_and_area():
    bare = IDEAL.model_copy(update={"pad_height": 0.0})
    assert wall_volume(bare) == pytest.approx(np.pi * (0.025**2 - 0.024**2) * 0.1, rel=1e-9)
    assert wall_area(bare, "eighth") == pytest.approx(2 * np.pi * 0.0245 * 0.1 / 8, rel=1e-9)
    assert wall_volume(IDEAL, "eighth") == pytest.approx(wall_volume(IDEAL) / 8, rel=1e-5)
    # Volume of a pad in a flat wall: height times the square, four straight transitions of a third and four corners,
    # each a quarter of the integral of s^2 over a circle, s = 1 - r / f.
    width, fillet = IDEAL.pad_width, IDEAL.pad_fillet
    pads = 6 * IDEAL.pad_height * (width**2 + 4 * width * fillet / 3 + 2 * np.pi * fillet**2 / 12)
    # They lie further in than the middle of the wall, where their width is told.
    assert wall_volume(IDEAL) - wall_volume(bare) == pytest.approx(pads * 23 / 24.5, rel=0.01)


@pytest.mark.parametrize("element", ["shell", "solid"])
@pytest.mark.parametrize("part", ["whole", "eighth"])
def test_gmsh_makes_the_same_mesh(tmp_path, element, part):
    tube, name = PinchedTube(imperfection=0.0003), "area" if element == "shell" else "volume"
    figures = make_mesh(tube, OPTIONS, tmp_path / "tube.msh", element, part)
    mesh = read_mesh(tmp_path / "tube.msh")
    in_memory = (tube_surface if element == "shell" else tube_solid)(tube, OPTIONS, part)
    assert mesh.doflocs.shape == in_memory.doflocs.shape
    assert cKDTree(in_memory.doflocs.T).query(mesh.doflocs.T)[0].max() < 1e-12
    assert figures["elements"] == mesh.t.shape[1] == in_memory.t.shape[1]
    assert figures["nodes"] == mesh.doflocs.shape[1]
    assert figures["min_sicn"] > 0.01
    assert abs(figures[f"{name}_deviation"]) < 2e-3
    assert set(mesh.boundaries) == set(in_memory.boundaries)
    for group, facets in mesh.boundaries.items():
        middles, wanted = (
            m.p[:, m.facets[:, f]].mean(axis=1).T for m, f in ((mesh, facets), (in_memory, in_memory.boundaries[group]))
        )
        assert len(middles) == len(wanted)
        assert cKDTree(wanted).query(middles)[0].max() < 1e-12
    if element == "shell":
        frame = element_places(mesh)
        normals = np.cross(frame[:, 1] - frame[:, 0], frame[:, 3] - frame[:, 0])
        assert (np.einsum("ec,ec->e", normals, radial_directions(tube, frame[:, 8])) > 0).all()


def test_bad_numbers_are_refused_before_meshing(tmp_path):
    with pytest.raises(MeshError, match="across 4 is too coarse .* at least 5"):
        tube_surface(IDEAL, OPTIONS.model_copy(update={"across": 4}))
    with pytest.raises(MeshError, match="along 3 is too coarse"):
        make_mesh(IDEAL, OPTIONS.model_copy(update={"along": 3}), tmp_path / "tube.msh")
    with pytest.raises(MeshError, match="along 13 must be even"):
        tube_surface(IDEAL, OPTIONS.model_copy(update={"along": 13}), "eighth")
    with pytest.raises(MeshError, match="across 7 with 3 pairs"):
        tube_surface(IDEAL, OPTIONS.model_copy(update={"across": 7}), "eighth")
    with pytest.raises(MeshError, match="'eighth': a twisted beam"):
        make_mesh(TwistedBeam(), OPTIONS, tmp_path / "beam.msh", "shell", "eighth")
    assert not list(tmp_path.iterdir())
    # Odd numbers are fine for the whole, and the smallest too.
    for along, across in ((5, 5), (13, 7)):
        mesh = tube_surface(IDEAL, MeshOptions(along=along, across=across))
        assert mesh.t.shape[1] == 6 * along * across
