"""CAD solids of tubes and beams."""

import gmsh
import numpy as np
import pytest
import pyvista

from lab.specimens import PinchedTube, TwistedBeam
from meshes import MeshError, mesh_cad, read_mesh, write_cad
from meshes.gmsh_session import gmsh_session
from meshes.tube_size import wall_volume


def solid(path):
    """Volume (mm^3), bounding box (mm) and kinds of faces of a STEP file's only solid."""
    with gmsh_session():
        gmsh.option.setString("Geometry.OCCTargetUnit", "MM")
        ((dim, tag),) = gmsh.model.occ.importShapes(str(path))
        gmsh.model.occ.synchronize()
        kinds = [gmsh.model.getType(*face) for face in gmsh.model.getEntities(2)]
        return gmsh.model.occ.getMass(dim, tag), np.array(gmsh.model.occ.getBoundingBox(dim, tag)), kinds


@pytest.mark.parametrize("pairs", [1, 2, 3])
def test_step_of_a_tube(tmp_path, pairs, capfd):
    tube = PinchedTube(pairs=pairs, imperfection=0.0)
    figures = write_cad(tube, tmp_path / "tube.step")
    blocks = 2 * np.pi * tube.radius**2 * tube.block_length
    # Pads of about 150 mm^3 each, alike but for their corners.
    assert figures["volume"] == pytest.approx(wall_volume(tube) + blocks, abs=2 * pairs * 3e-9)
    volume, box, kinds = solid(tmp_path / "tube.step")
    assert volume == pytest.approx(1e9 * figures["volume"], rel=1e-6)
    np.testing.assert_allclose(box, [-25, -25, -10, 25, 25, 110], atol=1e-3)
    # Of every pad the top, and eight faces around it and as many fillets at their foot.
    assert len(kinds) >= 2 * pairs * 17
    assert kinds.count("Plane") >= 4
    assert [p.name for p in tmp_path.iterdir()] == ["tube.step"]
    assert capfd.readouterr().out == ""


def test_pads_are_in_the_solid(tmp_path):
    """Volumes with and without pads differ by the pads' own, and the bare tube is exact."""
    tube = PinchedTube(pairs=1, imperfection=0.0)
    bare = tube.model_copy(update={"pad_height": 0.0})
    with_pads, without = (write_cad(t, tmp_path / "tube.stp")["volume"] for t in (tube, bare))
    assert without == pytest.approx(wall_volume(bare) + 2 * np.pi * 0.025**2 * 0.01, rel=1e-9)
    assert with_pads - without == pytest.approx(wall_volume(tube) - wall_volume(bare), rel=0.05)


@pytest.mark.parametrize("specimen", [PinchedTube(pairs=1), TwistedBeam(root_angle=0.3)])
def test_stl_is_watertight_and_of_the_solids_volume(tmp_path, specimen):
    figures = write_cad(specimen, tmp_path / "deep" / "body.stl", deviation=2e-4)
    surface = pyvista.read(tmp_path / "deep" / "body.stl").clean()
    assert surface.is_manifold
    assert surface.n_open_edges == 0
    assert surface.n_cells == figures["triangles"]
    assert surface.volume == pytest.approx(1e9 * figures["volume"], rel=0.01)


def test_beam_is_lofted_on_its_twist(tmp_path):
    beam = TwistedBeam(twist=-2.0)
    assert write_cad(beam, tmp_path / "beam.step")["volume"] == pytest.approx(beam.area * beam.length, rel=1e-6)
    volume, box, _ = solid(tmp_path / "beam.step")
    assert volume == pytest.approx(3000, rel=1e-6)
    np.testing.assert_allclose(box[[0, 3]], [0, 50], atol=1e-3)


def test_what_cannot_be_written_says_why(tmp_path):
    with pytest.raises(MeshError, match=r"'tube\.obj': the suffix must be one of \.step, \.stp, \.stl"):
        write_cad(PinchedTube(), tmp_path / "tube.obj")
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_tetrahedra_of_the_wall_with_real_fillets(tmp_path):
    tube = PinchedTube(pairs=1, imperfection=0.0)
    figures = mesh_cad(tube, tmp_path / "tube.msh", 4e-3)
    assert figures["min_sicn"] > 0
    assert figures["straightened"] < 0.02 * figures["elements"]
    mesh = read_mesh(tmp_path / "tube.msh")
    assert mesh.t.shape[1] == figures["elements"]
    named = np.concatenate([mesh.boundaries[name] for name in ("root", "tip", "inside", "outside")])
    np.testing.assert_array_equal(np.sort(named), np.sort(mesh.boundary_facets()))
    radius = np.hypot(*mesh.p[:2, mesh.facets[:, mesh.boundaries["outside"]].ravel()])
    np.testing.assert_allclose(radius, tube.radius, rtol=1e-6)
    for name, z in (("root", 0.0), ("tip", 0.1)):
        np.testing.assert_allclose(mesh.p[2, mesh.facets[:, mesh.boundaries[name]]], z, atol=1e-12)
    from skfem import Basis, ElementTetP2

    volume = Basis(mesh, ElementTetP2(), intorder=4).dx.sum()
    assert volume == pytest.approx(wall_volume(tube), rel=2e-3)
