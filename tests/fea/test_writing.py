"""A run as a file: curves, fields of parts of different elements, energy balance; ParaView's reader sees them."""

import numpy as np
import pytest
from skfem import MeshTet

from fea.body import Body
from fea.case import Case
from fea.shell import Shell
from fea.statics import static
from fea.writing import record, von_mises
from lab.materials import Material
from meshes.structured import surface_mesh
from results.store import read_record, write_record

MATERIAL = Material(youngs_modulus=1e6, poisson_ratio=0.3)


@pytest.fixture(scope="module")
def run():
    """A shell that hangs over a block of tetrahedra, is pressed on it by a moved edge, and touches it."""
    block = Body(MeshTet.init_tensor(*(np.linspace(0, s, n) for s, n in ((1.0, 3), (1.0, 3), (0.5, 2)))), MATERIAL)
    sheet = surface_mesh((4, 2), lambda a, b: np.stack([0.5 + 1.0 * a, b, 0.53 + 0 * a], axis=1), ("in", "out", "", ""))
    shell = Shell(sheet, 0.05, MATERIAL)
    case = Case(block, shell).fix(lambda x: x[:, 2] < 1e-9).fix("in", part=shell)
    case.rigid("bar", "out").hold("x", "y", "rx", "ry", "rz").move(z=-0.15)
    lower = "bottom" if shell.points[shell.bottom][:, 2].mean() < 0.53 else "top"
    return static(case.contact(lower, "all", shell, block), np.linspace(0.1, 1, 10))


def test_work_of_supports_is_stored(run):
    assert run.completed, run.reason
    assert run.work[-1] == pytest.approx(run.energy[-1], rel=0.03)
    assert run.reports[-1]["largest penetration [m], term 0"] < 0.01 * 0.05
    assert run.reports[-1]["force z [N], term 0"] != 0.0


def test_file_holds_both_elements_and_reads_back(run, tmp_path):
    pyvista = pytest.importorskip("pyvista")
    path = tmp_path / "run.vtkhdf"
    made = record(run, "sheet on block")
    write_record(path, made, {})
    again = read_record(path)
    np.testing.assert_array_equal(again.fields.cells, made.fields.cells)
    np.testing.assert_array_equal(again.fields.cell_type, made.fields.cell_type)
    assert set(np.unique(made.fields.cell_type)) == {24, 29}
    np.testing.assert_allclose(again.channels["wrench_bar"].values, run.wrench("bar"))
    assert again.channels["displacement_bar"].unit == "m"
    reader = pyvista.get_reader(str(path))
    reader.reader.SetStep(len(run.t) - 1)
    grid = reader.read()
    assert grid.n_cells == len(made.fields.cells)
    assert {"displacement", "contact_pressure", "gap"} <= set(grid.point_data)
    assert {"stress", "von_mises", "strain_energy_density"} <= set(grid.cell_data)
    shown = grid.point_data["displacement"][:, 2].min()
    assert shown == pytest.approx(made.fields.point_data["displacement"].values[-1, :, 2].min(), rel=1e-5)
    assert np.nanmax(grid.point_data["contact_pressure"]) > 0


def test_von_mises_of_plain_states():
    np.testing.assert_allclose(von_mises(np.array([[3.0, 0, 0, 0, 0, 0], [5.0, 5, 5, 0, 0, 0]])), [3.0, 0.0])
    assert von_mises(np.array([0, 0, 0, 2.0, 0, 0])) == pytest.approx(2 * np.sqrt(3))
