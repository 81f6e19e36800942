"""``StaticStiffness`` performed: laws that it must obey, and what its record holds."""

import json

import numpy as np
import pytest

from fea import FeaModel, perform
from fea.body import Body
from fea.static_stiffness import HeldTip
from lab.experiments import StaticStiffness
from lab.materials import Material
from lab.specimens import TwistedBeam
from meshes.block import beam_mesh, beam_surface
from meshes.options import MeshOptions

COARSE = MeshOptions(along=5, across=2, through=1)
EXPERIMENT = StaticStiffness(increments=2)


def run(specimen, experiment=EXPERIMENT, model=None, options=COARSE):
    return perform(specimen, experiment, model or FeaModel(), beam_mesh(specimen, options))


@pytest.fixture(scope="module")
def record():
    return run(TwistedBeam(twist=np.pi / 4))


def matrix(record):
    return EXPERIMENT.reduce(record)


def test_record(record):
    assert record.completed
    assert record["motion"].shape == record["wrench"].shape == record["pose"].shape == (12, 6)
    np.testing.assert_array_equal(record["leg"], np.repeat(np.arange(6), 2))
    np.testing.assert_array_equal(record["increment"], np.arange(12))
    np.testing.assert_array_equal(record["pose"], record["motion"])
    np.testing.assert_allclose(record["motion"][:2, 1], [0.0025, 0.005])
    assert record["energy"].min() > 0
    json.dumps(record.how)
    assert record.how["history"]["largest_final_residual"] < 1e-8
    fields = record.fields
    np.testing.assert_array_equal(fields.values, [-1, 1, 3, 5, 7, 9, 11])
    assert fields.point_data["displacement"].values.shape == (7, len(fields.points), 3)
    tip = fields.points[:, 0] > 0.05 - 1e-9
    at_tip = fields.point_data["displacement"].values[1][tip]
    np.testing.assert_allclose(at_tip, [[0, 0.005, 0]] * tip.sum(), atol=1e-15)
    assert fields.cell_data["strain_energy_density"].values.shape == (7, len(fields.cells))


def test_wrench_is_the_gradient_of_energy(record):
    # Along a leg, dW = wrench . d motion; Simpson's rule over 0, 1/2, 1 of the way.
    for leg in range(6):
        rows = record["leg"] == leg
        along = np.einsum("ni,ni->n", record["wrench"][rows], record["motion"][rows][-1:])
        assert (4 * along[0] + along[1]) / 6 == pytest.approx(record["energy"][rows][-1], rel=0.03)


def test_tangent_is_symmetric_and_close_to_small_motion(record):
    tangent = record["tangent_stiffness"]
    np.testing.assert_allclose(tangent, tangent.T, atol=1e-9 * np.abs(tangent).max())
    small = run(TwistedBeam(twist=np.pi / 4), StaticStiffness(translation=1e-6, rotation=1e-5, increments=1))
    for leg, dof in ((0, 1), (2, 2), (4, 3)):
        slope = small["wrench"][leg] / small["motion"][leg, dof]
        np.testing.assert_allclose(slope, tangent[:, dof], rtol=1e-2, atol=1e-3 * np.abs(tangent[:, dof]).max())


def test_mirrored_twist_turns_the_coupling(record):
    here, there = matrix(record), matrix(run(TwistedBeam(twist=-np.pi / 4)))
    for name in ("k_yy", "k_zz"):
        assert there[name].value == pytest.approx(here[name].value, rel=1e-6)
    for name in ("k_yz", "k_zy"):
        assert there[name].value == pytest.approx(-here[name].value, rel=1e-6)


def test_turned_clamp_turns_the_matrix(record):
    here, there = matrix(record), matrix(run(TwistedBeam(twist=np.pi / 4, root_angle=np.pi / 2)))
    for one, other, sign in (("k_yy", "k_zz", 1), ("k_zz", "k_yy", 1), ("k_yz", "k_zy", -1), ("k_zy", "k_yz", -1)):
        assert there[one].value == pytest.approx(sign * here[other].value, rel=1e-6)


def test_wrench_scales_with_the_modulus(record):
    stiff = run(TwistedBeam(twist=np.pi / 4), model=FeaModel.model_validate({"material": {"youngs_modulus": 52e6}}))
    np.testing.assert_allclose(stiff["wrench"], 2 * record["wrench"], rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("change", [{"linear_solver": "superlu"}, {"linear_solver": "pardiso"}])
def test_solvers_agree(record, change):
    np.testing.assert_allclose(run(TwistedBeam(twist=np.pi / 4), model=FeaModel(**change))["wrench"], record["wrench"],
                               rtol=1e-6, atol=1e-7)  # fmt: skip


def test_compliant_rig_is_in_series():
    specimen, stiffness = TwistedBeam(twist=np.pi / 4), 2000.0
    experiment = StaticStiffness(translation=1e-5, rotation=1e-5, increments=1, rig_stiffness=stiffness)
    record = run(specimen, experiment)
    stretch = record["motion"] - record["pose"]
    np.testing.assert_allclose(record["wrench"][:, :3], stiffness * stretch[:, :3], rtol=1e-5, atol=1e-9)
    np.testing.assert_array_equal(stretch[:, 3:], 0)
    tangent = record["tangent_stiffness"][:3, :3]
    series = np.linalg.inv(np.linalg.inv(tangent) + np.eye(3) / stiffness)
    np.testing.assert_allclose(record["wrench"][0, :3] / 1e-5, series[:, 1], rtol=1e-2, atol=1.0)


def test_sprung_rotations_have_a_true_tangent():
    body = Body(beam_mesh(TwistedBeam(), COARSE), Material())
    held = HeldTip(body, np.array([500.0, np.inf, 700.0, 0.2, 0.3, np.inf]))
    held.travel[:] = np.array([1e-3, 2e-3, -1e-3, 0.1, 0.2, -0.1])
    state = 1e-4 * np.random.default_rng(0).standard_normal(len(held.problem.rest))
    state[-4:] = [1e-3, -1e-3, 0.2, 0.1]
    held.problem.linearise(state, 1.0)
    step = np.random.default_rng(1).standard_normal(len(state)) * 1e-8
    slope = held.problem.residual(state + step, 1.0)[0] - held.problem.residual(state - step, 1.0)[0]
    np.testing.assert_allclose(held.problem.solve(slope / 2), step, atol=1e-5 * np.abs(step).max())


def test_lost_equilibrium_is_a_record():
    specimen = TwistedBeam(material=Material(law="neo-hookean"))
    tiny = MeshOptions(along=2, across=1, through=1)
    record = run(specimen, StaticStiffness(translation=5.0, increments=1), options=tiny)
    assert record.status == "diverged"
    assert "leg 1 of 6 (along y to 5) stopped at" in record.reason
    assert len(record["leg"]) == 0
    assert record.how["history"]["cut_back"] > 0


def test_neo_hookean_differs_little(record):
    other = run(TwistedBeam(twist=np.pi / 4), model=FeaModel.model_validate({"material": {"law": "neo-hookean"}}))
    assert other.completed
    assert matrix(other)["k_yy"].value == pytest.approx(matrix(record)["k_yy"].value, rel=0.05)


def shell(**settings):
    return FeaModel.model_validate({"element": "shell", **settings})


def test_shell_record():
    specimen, options = TwistedBeam(twist=np.pi / 4), MeshOptions(along=6, across=2)
    mesh = beam_surface(specimen, options)
    record = perform(specimen, EXPERIMENT, shell(), mesh)
    assert record.completed
    assert record.how["mesh"] == {"elements": 12, "nodes": 2 * 13 * 5, "element": "18-node solid shell"}
    json.dumps(record.how)
    assert record["energy"].min() > 0
    fields = record.fields
    assert fields.cells.shape == (12, 27)
    assert fields.point_data["displacement"].values.shape == (7, len(fields.points), 3)
    tip = np.abs(fields.points[:, 0] - 0.05) < 1e-9
    assert tip.sum() == 3 * 5
    at_tip = fields.point_data["displacement"].values[1][tip]
    np.testing.assert_allclose(at_tip, [[0, 0.005, 0]] * 15, atol=1e-15)
    # The outer nodes lie where those of the solid do.
    solid = beam_mesh(specimen, options.model_copy(update={"through": 1})).doflocs.T
    for point in fields.points[::7]:
        assert np.abs(solid - point).max(axis=1).min() < 1e-12
    tangent = record["tangent_stiffness"]
    np.testing.assert_allclose(tangent, tangent.T, atol=1e-9 * np.abs(tangent).max())


def test_shell_mirrored_twist_turns_the_coupling():
    options = MeshOptions(along=6, across=2)
    beams = [TwistedBeam(twist=sense * np.pi / 4) for sense in (1, -1)]
    here, there = (matrix(perform(beam, EXPERIMENT, shell(), beam_surface(beam, options))) for beam in beams)
    for name in ("k_yy", "k_zz"):
        assert there[name].value == pytest.approx(here[name].value, rel=1e-6)
    for name in ("k_yz", "k_zy"):
        assert there[name].value == pytest.approx(-here[name].value, rel=1e-6)


def test_mesh_must_suit_the_element():
    with pytest.raises(ValueError, match="a MeshQuad2 is no mesh for the element 'solid'"):
        perform(TwistedBeam(), EXPERIMENT, FeaModel(), beam_surface(TwistedBeam(), COARSE))
    with pytest.raises(ValueError, match="a MeshHex2 is no mesh for the element 'shell'"):
        perform(TwistedBeam(), EXPERIMENT, shell(), beam_mesh(TwistedBeam(), COARSE))


def test_default_meshes_depend_on_the_element():
    assert FeaModel().mesh == MeshOptions()
    model = shell(mesh={"along": 5})
    assert model.mesh.along == 5
    assert model.mesh.across == shell().mesh.across
    assert model.motion_mesh == shell().motion_mesh != FeaModel().motion_mesh
    assert FeaModel.model_validate(model.model_dump()) == model
    assert model.model_fields_set == {"element", "mesh"}
