"""A batch gives what ``perform`` gives, from meshes that it keeps."""

import numpy as np
import pytest

from fea import FeaModel, perform
from fea.batch import Batch
from lab.experiments import BaseShake, NaturalModes, RingDown, StaticStiffness
from lab.fields import with_numbers
from lab.requests import Request
from lab.specimens import TwistedBeam
from meshes.block import beam_mesh, beam_surface

COARSE = {"along": 4, "across": 1, "through": 1, "grading_along": 0.0, "grading_across": 0.0}
MODEL = FeaModel.model_validate({"element": "shell", "mesh": COARSE, "motion_mesh": COARSE, "time_step": 0.7e-3})
SPECIMEN = TwistedBeam(tip_mass=2e-3)
RELEASE = RingDown(duration=0.01, load_mass=0.02)


@pytest.mark.parametrize(
    ("experiment", "names"),
    [
        (RELEASE, ("time", "markers")),
        (StaticStiffness(translation=1e-3, rotation=0.1, increments=1), ("leg", "motion", "wrench")),
        (BaseShake(frequency=24.0), ("time", "markers")),
        (NaturalModes(count=2), ("frequency", "tip")),
    ],
)
def test_gives_what_perform_gives(experiment, names):
    record = perform(SPECIMEN, experiment, MODEL, beam_surface(SPECIMEN, MODEL.mesh_for(experiment)))
    (response,) = Batch(MODEL)([Request(SPECIMEN, experiment)])
    assert tuple(response) == names
    for name in names:
        np.testing.assert_array_equal(response[name], record[name])


def test_solids_too():
    model = FeaModel.model_validate({"motion_mesh": COARSE, "time_step": 1.4e-3})
    experiment = RELEASE.model_copy(update={"duration": 1 / 360})
    record = perform(SPECIMEN, experiment, model, beam_mesh(SPECIMEN, model.motion_mesh))
    (response,) = Batch(model)([Request(SPECIMEN, experiment)])
    np.testing.assert_array_equal(response["markers"], record["markers"])


def test_specimens_carry_everything_the_models_changes_are_left_to_them():
    changed = MODEL.model_copy(
        update={"thickness": 2.5e-3, "material": MODEL.material.model_copy(update={"youngs_modulus": 40e6})}
    )
    record = perform(SPECIMEN, RELEASE, changed, beam_surface(SPECIMEN, MODEL.motion_mesh))
    batch = Batch(changed)
    applied, plain = batch([Request(changed.applied_to(SPECIMEN), RELEASE), Request(SPECIMEN, RELEASE)])
    np.testing.assert_array_equal(applied["markers"], record["markers"])
    np.testing.assert_array_equal(plain["markers"], Batch(MODEL)([Request(SPECIMEN, RELEASE)])[0]["markers"])


def test_the_middle_surface_serves_every_thickness_and_material():
    batch = Batch(MODEL)
    others = ({"thickness": 2e-3}, {"material.youngs_modulus": 40e6}, {"twist": 0.5})
    requests = [Request(with_numbers(SPECIMEN, other), RELEASE) for other in others]
    thin, stiff, flat = batch(requests)
    assert len(batch._meshes) == 2
    for request, response in zip(requests, (thin, stiff, flat), strict=True):
        fresh = perform(request.specimen, RELEASE, MODEL, beam_surface(request.specimen, MODEL.motion_mesh))
        np.testing.assert_array_equal(response["markers"], fresh["markers"])


def test_a_lost_run_is_none_with_its_reason():
    hopeless = with_numbers(SPECIMEN, {"material.youngs_modulus": 1e3})
    batch = Batch(MODEL)
    good, bad = batch([Request(SPECIMEN, RELEASE), Request(hopeless, RELEASE.model_copy(update={"load_mass": 5.0}))])
    assert good is not None
    assert bad is None
    assert list(batch.failures) == [1]
    assert batch.failures[1].startswith("diverged: the hanging load was reached to")
    batch([Request(SPECIMEN, RELEASE)])
    assert not batch.failures


def test_values_are_refused():
    with pytest.raises(ValueError, match=r"take no values \(k\): the specimen carries all"):
        Batch(MODEL)([Request(SPECIMEN, RELEASE, {"k": 1.0})])


def test_processes_do_not_change_the_result():
    requests = [Request(with_numbers(SPECIMEN, {"thickness": t}), RELEASE) for t in (2e-3, 3e-3)]
    batch = Batch(MODEL, workers=2)
    try:
        for one, other in zip(Batch(MODEL)(requests), batch(requests), strict=True):
            # The solver's threads add up in another order.
            np.testing.assert_allclose(one["markers"], other["markers"], rtol=0, atol=1e-10)
    finally:
        batch.close()
