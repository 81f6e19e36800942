"""``NaturalModes`` by shells and solids: what the record holds, scaling, and what is refused."""

import json

import numpy as np
import pytest

from fea import FeaModel, perform
from fea.model import DEFAULT_MESHES
from lab.experiments import NaturalModes
from lab.materials import Material
from lab.specimens import TwistedBeam
from meshes.block import beam_mesh, beam_surface
from meshes.options import MeshOptions

COARSE = MeshOptions(along=8, across=2, through=1, grading_along=0.5, grading_across=0.0)
BEAM = TwistedBeam(twist=np.pi / 2)


def record_of(specimen, element="shell", count=6, options=COARSE):
    mesh = (beam_surface if element == "shell" else beam_mesh)(specimen, options)
    return perform(specimen, NaturalModes(count=count), FeaModel.model_validate({"element": element}), mesh)


@pytest.mark.parametrize("element", ["shell", "solid"])
def test_record(element):
    record = record_of(BEAM, element)
    assert record.completed, record.reason
    assert record["frequency"].shape == (6,)
    assert (np.diff(record["frequency"]) > 0).all()
    np.testing.assert_array_equal(record["mode"], np.arange(1, 7))
    assert record["tip"].shape == (6, 6)
    assert record.how["history"]["missed"] in (0, None)
    json.dumps(record.how)
    assert set(NaturalModes().reduce(record)) == {f"f_{n}" for n in range(1, 7)}
    assert NaturalModes.kinds(record) == ["bending", "bending", "torsion", "bending", "bending", "torsion"]
    shapes = record.fields.point_data["displacement"].values
    np.testing.assert_allclose(np.linalg.norm(shapes, axis=2).max(axis=1), 0.1 * BEAM.length)
    np.testing.assert_array_equal(record.fields.values, record["mode"])
    # Strains of a linear vibration: energy is w^2/2 for a modal mass of 1 kg at the amplitude that is shown.
    energy = record.fields.cell_data["strain_energy_density"].values
    assert energy.min() >= 0
    assert np.isfinite(energy).all()


def test_shells_and_solids_agree():
    shell = record_of(BEAM, options=DEFAULT_MESHES["shell"]["mesh"])
    solid = record_of(BEAM, "solid", options=DEFAULT_MESHES["solid"]["mesh"])
    np.testing.assert_allclose(shell["frequency"], solid["frequency"], rtol=0.012)
    for mine, theirs in zip(shell["tip"][:2], solid["tip"][:2], strict=True):
        np.testing.assert_allclose(mine[1:3], theirs[1:3], atol=0.01 * np.abs(mine[:3]).max())
        np.testing.assert_allclose(mine[3:], theirs[3:], atol=0.02 * np.abs(mine[3:]).max())


def test_a_light_beam_with_a_heavy_tip_has_the_tips_modal_mass():
    light = TwistedBeam(twist=0.0, mass=1e-6, tip_mass=4.0)
    record = record_of(light, count=2)
    assert np.linalg.norm(record["tip"][0, :3]) == pytest.approx(0.5, rel=2e-3)
    assert abs(record["tip"][0, 2]) > 0.49  # along z, across the flat side
    assert abs(record["tip"][1, 1]) > 0.48 or abs(record["tip"][1, 3]) > 1.0


def test_mean_rotation_of_the_face():
    """A clamped beam's first bending shape turns its end by 1.3765 of the deflection over the length."""
    slender = TwistedBeam(length=0.2, width=0.01, thickness=0.004, twist=0.0, material=Material(poisson_ratio=0.0))
    tip = record_of(slender, count=1)["tip"][0]
    assert tip[4] / tip[2] == pytest.approx(-1.3765 / slender.length, rel=5e-3)
    assert np.abs(tip[[0, 1]]).max() < 1e-6 * abs(tip[2])


def test_frequencies_scale_with_the_root_of_the_modulus_and_ignore_damping():
    stiff = BEAM.model_copy(update={"material": Material(youngs_modulus=4 * 26e6, viscous_time=0.01, mass_damping=3.0)})
    one, other = record_of(BEAM, count=3), record_of(stiff, count=3)
    np.testing.assert_allclose(other["frequency"], 2 * one["frequency"], rtol=1e-9)


def test_mirrored_beams_have_mirrored_shapes():
    one, other = record_of(BEAM, count=3), record_of(BEAM.mirrored(), count=3)
    np.testing.assert_allclose(other["frequency"], one["frequency"], rtol=1e-8)
    swap = np.array([1, 1, -1, -1, -1, 1.0])
    for mine, theirs in zip(one["tip"], other["tip"], strict=True):
        sense = np.sign(theirs @ (swap * mine))
        np.testing.assert_allclose(sense * theirs, swap * mine, atol=1e-5 * np.abs(mine).max())


def test_more_modes_than_a_mesh_has_are_said_to_be_too_many():
    options = MeshOptions(along=1, across=1, through=1, grading_along=0.0, grading_across=0.0)
    record = record_of(TwistedBeam(twist=0.3), "shell", 40, options)
    assert record.status == "failed"
    assert "between 1 and 35 modes of 36 unknowns" in record.reason
