"""CAD solids of the tube with fins, and tetrahedra of them."""

import gmsh
import numpy as np
import pytest
import pyvista
from skfem import Basis, ElementTetP2

from lab.specimens import FinnedTube, PinchedTube
from lab.specimens.finned_tube import Chambers
from meshes import MeshError, mesh_cad, read_mesh, write_cad
from meshes.finned_cad import CAD_PARTS, cad_volume
from meshes.finned_size import chamber_volume, fin_volume, tube_volume
from meshes.gmsh_session import gmsh_session

DEG = np.pi / 180
TUBE = FinnedTube()


def signed_volume(path):
    """Of an STL's triangles by their winding, mm^3, and the surface."""
    surface = pyvista.read(path).clean()
    corners = surface.points.astype(float)[surface.faces.reshape(-1, 4)[:, 1:]]
    return float(np.linalg.det(corners).sum() / 6), surface


@pytest.mark.parametrize("part", CAD_PARTS)
def test_stl_is_watertight_and_its_hollows_are_hollow(tmp_path, part):
    figures = write_cad(TUBE, tmp_path / "finned.stl", part=part)
    assert figures["volume"] == pytest.approx(cad_volume(TUBE, part), rel=1e-6)
    volume, surface = signed_volume(tmp_path / "finned.stl")
    assert surface.is_manifold
    assert surface.n_open_edges == 0
    assert surface.n_cells == figures["triangles"]
    assert volume == pytest.approx(1e9 * figures["volume"], rel=0.01)
    hollows = surface.connectivity()["RegionId"].max()
    assert hollows == (0 if part == "bare" else 18)


def test_step_is_one_solid_of_the_shells_volume(tmp_path):
    figures = write_cad(TUBE, tmp_path / "finned.step")
    shells = tube_volume(TUBE) + 2 * fin_volume(TUBE)
    assert figures["volume"] == pytest.approx(shells + 18 * chamber_volume(TUBE), rel=1e-6)
    with gmsh_session():
        gmsh.option.setString("Geometry.OCCTargetUnit", "MM")
        gmsh.option.setNumber("Geometry.OCCBoundsUseStl", 1)
        ((dim, tag),) = gmsh.model.occ.importShapes(str(tmp_path / "finned.step"))
        gmsh.model.occ.synchronize()
        assert gmsh.model.occ.getMass(dim, tag) == pytest.approx(1e9 * figures["volume"], rel=1e-6)
        box = gmsh.model.occ.getBoundingBox(dim, tag)
    # The convex face's crown reaches out furthest, the concave one's edges up.
    reach = TUBE.fin_places(np.zeros(1), np.array([TUBE.tip_along]), TUBE.face_radius(1.0))[0, 0]
    rise = TUBE.fin_places(np.array([TUBE.fin_arc / 2]), np.array([TUBE.tip_along]), TUBE.face_radius(0.0))[0, 2]
    np.testing.assert_allclose(box, 1e3 * np.array([-reach, -0.025, 0, reach, 0.025, rise]), atol=0.02)


@pytest.mark.parametrize(("arc", "angle"), [(35, 35), (120, 90), (65, 120)])
def test_cad_of_other_designs(tmp_path, arc, angle):
    tube = FinnedTube(fin_arc=arc * DEG, attachment_angle=angle * DEG)
    figures = write_cad(tube, tmp_path / "finned.step", part="bare")
    assert figures["volume"] == pytest.approx(tube_volume(tube) + 2 * fin_volume(tube), rel=1e-5)


def test_cad_refuses_parts_that_are_not_there(tmp_path):
    bare = FinnedTube(chambers=Chambers(number=0))
    assert cad_volume(bare) == cad_volume(bare, "bare")
    for specimen, part, why in (
        (TUBE, "fin", "part 'fin': there is whole, bare, actuator"),
        (bare, "actuator", "this tube has no chambers"),
        (PinchedTube(), "bare", "only a FinnedTube has it; a PinchedTube has the whole"),
    ):
        with pytest.raises(MeshError, match=why):
            write_cad(specimen, tmp_path / "finned.step", part=part)
    with pytest.raises(MeshError, match="a quarter is of a tube with fins"):
        mesh_cad(PinchedTube(), tmp_path / "finned.msh", 4e-3, quarter=True)


def test_tetrahedra_of_the_quarter(tmp_path):
    figures = mesh_cad(TUBE, tmp_path / "finned.msh", 3e-3, quarter=True)
    assert figures["min_sicn"] > 0
    mesh = read_mesh(tmp_path / "finned.msh")
    volume = Basis(mesh, ElementTetP2(), intorder=4).dx.sum()
    assert volume == pytest.approx(tube_volume(TUBE) / 4 + fin_volume(TUBE) / 2, rel=1e-3)
    names = {"lower end", "upper end", "crest", "side", "inside", "outside", "fin", "tip"}
    assert set(mesh.boundaries) == names
    np.testing.assert_array_equal(
        np.sort(np.concatenate(list(mesh.boundaries.values()))), np.sort(mesh.boundary_facets())
    )
    points = mesh.p[:, mesh.facets[:, mesh.boundaries["fin"]].ravel()].T
    off = np.linalg.norm(np.cross(points - TUBE.fin_centre, TUBE.fin_axis), axis=1) - TUBE.mid_radius
    assert np.abs(off).max() < TUBE.fin_thickness / 2 * (1 + 1e-6)
    for name, radius in (("inside", TUBE.inner_radius), ("outside", TUBE.radius)):
        np.testing.assert_allclose(np.hypot(*mesh.p[:2, mesh.facets[:, mesh.boundaries[name]].ravel()]), radius)
