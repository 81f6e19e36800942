"""gmsh meshes of the twisted beam."""

import json

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from skfem import Basis, ElementHex2, FacetBasis

from lab.specimens import TwistedBeam
from meshes import MeshOptions, make_mesh, quality_path, read_mesh
from meshes.block import beam_mesh, beam_surface
from meshes.gathering import element_places
from meshes.node_order import VTK_CELL_TYPE, skfem_to_vtk, vtk_reference, vtk_to_skfem
from meshes.twist import graded

COUNTS = st.builds(MeshOptions, along=st.integers(8, 12), across=st.integers(1, 3), through=st.integers(1, 2))


@settings(max_examples=8, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    twist=st.floats(-np.pi, np.pi), root=st.floats(-np.pi, np.pi), length=st.floats(0.03, 0.1),
    thickness=st.floats(0.001, 0.02), options=COUNTS,
)  # fmt: skip
def test_invariants(tmp_path, twist, root, length, thickness, options):
    specimen = TwistedBeam(twist=twist, root_angle=root, length=length, thickness=thickness)
    figures = make_mesh(specimen, options, tmp_path / "beam.msh")
    mesh = read_mesh(tmp_path / "beam.msh")
    assert figures["elements"] == mesh.t.shape[1] == options.along * options.across * options.through
    assert figures["nodes"] == mesh.doflocs.shape[1]
    assert figures["min_sicn"] > 0.01
    assert abs(figures["volume_deviation"]) < 5e-3
    dx = Basis(mesh, ElementHex2(), intorder=5).dx
    assert Basis(mesh, ElementHex2(), intorder=5).mapping.detDF(np.full((3, 1), 0.5)).min() > 0
    assert dx.sum() == pytest.approx(figures["volume"], rel=1e-6)
    for name in ("root", "tip"):
        face = FacetBasis(mesh, ElementHex2(), facets=mesh.boundaries[name], intorder=5)
        assert face.dx.sum() == pytest.approx(specimen.area, rel=1e-9)
        x = mesh.doflocs[0, np.unique(face.get_dofs(name).flatten())]
        np.testing.assert_allclose(x, 0 if name == "root" else length, atol=1e-12)
    boundary = np.concatenate([mesh.boundaries[name] for name in ("root", "tip", "sides")])
    np.testing.assert_array_equal(np.sort(boundary), np.sort(mesh.boundary_facets()))


def test_nodes_lie_on_the_twisted_sections(tmp_path):
    specimen = TwistedBeam(root_angle=0.3)
    options = MeshOptions(along=6, across=2, through=1, grading_along=0.0, grading_across=0.0)
    make_mesh(specimen, options, tmp_path / "beam.msh")
    points = read_mesh(tmp_path / "beam.msh").doflocs
    turned = np.exp(-1j * specimen.section_angle(points[0])) * (points[1] + 1j * points[2])
    grid = specimen.width * (np.arange(5) / 4 - 0.5), specimen.thickness * (np.arange(3) / 2 - 0.5)
    stations = specimen.length * np.arange(13) / 12
    for value, allowed in ((turned.real, grid[0]), (turned.imag, grid[1]), (points[0], stations)):
        assert np.abs(value[:, None] - allowed).min(axis=1).max() < 1e-12
    in_memory = beam_mesh(specimen, options).doflocs
    rounded = [np.unique(np.round(p.T / 1e-9).astype(int), axis=0) for p in (points, in_memory)]
    assert all(len(r) == points.shape[1] for r in rounded)
    for found in points.T[::7]:
        assert np.abs(in_memory.T - found).max(axis=1).min() < 1e-12


def test_file_sidecar_and_no_leftovers(tmp_path):
    path = tmp_path / "deep" / "beam.msh"
    figures = make_mesh(TwistedBeam(), MeshOptions(along=2, across=1, through=1), path)
    assert json.loads(quality_path(path).read_text()) == figures
    assert sorted(p.name for p in path.parent.iterdir()) == ["beam.msh", "beam.quality.json"]
    assert path.read_text().startswith("$MeshFormat\n4.1 0 8")
    first = path.read_bytes()
    make_mesh(TwistedBeam(), MeshOptions(along=2, across=1, through=1), path)
    assert path.read_bytes() == first


def test_middle_surface(tmp_path):
    specimen, options = TwistedBeam(root_angle=0.3), MeshOptions(along=10, across=3)
    figures = make_mesh(specimen, options, tmp_path / "beam.msh", "shell")
    mesh, in_memory = read_mesh(tmp_path / "beam.msh"), beam_surface(specimen, options)
    assert figures["elements"] == mesh.t.shape[1] == 30
    assert figures["nodes"] == mesh.doflocs.shape[1] == 21 * 7
    assert abs(figures["area_deviation"]) < 1e-4
    assert figures["min_sicn"] > 0.01
    for found in (mesh, in_memory):
        turned = np.exp(-1j * specimen.section_angle(found.doflocs[0])) * (found.doflocs[1] + 1j * found.doflocs[2])
        np.testing.assert_allclose(turned.imag, 0.0, atol=1e-14)
        np.testing.assert_allclose(np.ptp(turned.real), specimen.width)
        assert {name: len(edges) for name, edges in found.boundaries.items()} == {"root": 3, "tip": 3, "sides": 20}
        np.testing.assert_allclose(found.p[0, found.facets[:, found.boundaries["tip"]]], specimen.length)
        frame = element_places(found)
        normal = np.cross(frame[:, 1] - frame[:, 0], frame[:, 3] - frame[:, 0])
        angle = specimen.section_angle(frame[:, 8, 0])
        assert (normal[:, 2] * np.cos(angle) - normal[:, 1] * np.sin(angle) > 0).all()
    for found in in_memory.doflocs.T[::7]:
        assert np.abs(mesh.doflocs.T - found).max(axis=1).min() < 1e-12


def test_vtk_order_is_vtks_own():
    import pyvista

    np.testing.assert_array_equal(ElementHex2.doflocs[skfem_to_vtk()], vtk_reference())
    np.testing.assert_array_equal(vtk_to_skfem()[skfem_to_vtk()], np.arange(27))
    from vtkmodules.vtkCommonDataModel import vtkTriQuadraticHexahedron

    cell = vtkTriQuadraticHexahedron()
    parametric = np.array([cell.GetParametricCoords()[n] for n in range(81)]).reshape(27, 3)
    np.testing.assert_array_equal(vtk_reference(), parametric)
    mesh = beam_mesh(TwistedBeam(), MeshOptions(along=4, across=2, through=1))
    cells = Basis(mesh, ElementHex2(), intorder=2).element_dofs.T[:, skfem_to_vtk()]
    grid = pyvista.UnstructuredGrid({VTK_CELL_TYPE: cells}, mesh.doflocs.T)
    assert grid.compute_cell_sizes()["Volume"].sum() == pytest.approx(3e-6, rel=0.02)
    assert grid.compute_cell_sizes()["Volume"].min() > 0


def test_grading_keeps_ends_order_and_middle_nodes():
    places = graded(np.linspace(0, 1, 33), 0.85, 16)
    np.testing.assert_allclose(places[[0, 16, 32]], [0, 0.5, 1], atol=1e-15)
    assert np.diff(places).min() > 0
    np.testing.assert_allclose(places[1::2], (places[:-1:2] + places[2::2]) / 2)
    assert places[2] == pytest.approx(0.0107, rel=0.01)


def test_few_strongly_graded_elements_do_not_fold():
    beam_mesh(TwistedBeam(), MeshOptions(along=3, across=1, through=1, grading_along=0.95))
