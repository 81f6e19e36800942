"""What a model changes in a specimen."""

import numpy as np
import pytest

from fea import FeaModel, perform
from fea.setting_up import make_part
from lab.experiments import RingDown
from lab.specimens import TwistedBeam
from meshes.block import beam_mesh, beam_surface
from meshes.options import MeshOptions

COARSE = MeshOptions(along=5, across=1, through=1, grading_along=0.0, grading_across=0.0)


def test_material_and_thickness_are_replaced():
    model = FeaModel.model_validate({"element": "shell", "thickness": 2e-3, "material": {"youngs_modulus": 40e6}})
    applied = model.applied_to(TwistedBeam(mass=5e-3))
    assert (applied.thickness, applied.material.youngs_modulus, applied.beam_mass) == (2e-3, 40e6, 5e-3)
    assert applied.material.poisson_ratio == TwistedBeam().material.poisson_ratio
    assert FeaModel().applied_to(TwistedBeam()) == TwistedBeam()


def test_a_thickness_beyond_the_width_is_refused():
    with pytest.raises(ValueError, match="exceeds width"):
        FeaModel.model_validate({"element": "shell", "thickness": 30e-3}).applied_to(TwistedBeam())


def test_a_solids_mesh_must_have_the_models_thickness():
    specimen, model = TwistedBeam(), FeaModel(thickness=2e-3)
    assert make_part(specimen, model, beam_mesh(model.applied_to(specimen), COARSE)).kind
    with pytest.raises(ValueError, match=r"a tip of 60 mm\^2, the specimen of this model 40 mm\^2"):
        make_part(specimen, model, beam_mesh(specimen, COARSE))


def test_bending_goes_with_the_cube_of_the_models_thickness():
    specimen = TwistedBeam(length=0.1, width=0.01, twist=0.0, thickness=1e-3)
    experiment = RingDown(direction=np.pi / 2, load_mass=1e-5, duration=1 / 360)
    mesh = beam_surface(specimen, COARSE)
    records = [
        perform(specimen, experiment, FeaModel.model_validate({"element": "shell", "thickness": t}), mesh)
        for t in (None, 2e-3)
    ]
    thin, thick = (record["tip"][0, 2] for record in records)
    assert thin / thick == pytest.approx(8.0, rel=0.02)
    assert [record.how["thickness"] for record in records] == [1e-3, 2e-3]
    assert records[1].specimen["thickness"] == 1e-3
