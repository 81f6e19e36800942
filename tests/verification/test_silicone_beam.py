"""Real recordings of a silicone cantilever: fitted to one, the declared model predicts the other; ``-s`` shows figures.

The recordings are not part of this project, see ``examples/silicone_beam/README.md``.
"""

import os
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from calibrate.fitting import fit
from calibrate.result import FitResult
from lab.experiments import RingDown
from lab.materials import Material
from lab.recordings import perform
from lab.requests import Request
from lab.specimens import TwistedBeam
from pipeline.plan import Plan
from pipeline.stages.fit import mjcf_of, model_of, targets_of
from pipeline.study import load_study
from prb.batch import Batch
from prb.declaration import read_declaration
from prb.mujoco_model import compile_mechanism
from prb.statics import Chain, tip_compliance

ROOT = Path(__file__).parents[2]
EXAMPLE = ROOT / "examples" / "silicone_beam"
VARIABLE = "SCRAM_SILICONE_BEAM"
FOLDER = Path(os.environ.get(VARIABLE) or ROOT.parent / "shared" / "reference" / "ringdown_silicone_beam")
OWN_WEIGHT, LOADED = FOLDER / "beam_gravity_V2_a.csv", FOLDER / "beam_load101_V2_a.csv"
PUBLISHED_MODULUS = 263.824e3

recorded = pytest.mark.skipif(
    not (OWN_WEIGHT.is_file() and LOADED.is_file()),
    reason=f"no recordings {OWN_WEIGHT.name} and {LOADED.name} in {FOLDER}; set {VARIABLE} to their folder",
)
RUBBER = Material(law="saint-venant-kirchhoff", youngs_modulus=250e3, poisson_ratio=0.499, density=1070.0)


def beam(tip_mass=0.0):
    return TwistedBeam(length=0.1, width=0.03, thickness=0.03, twist=0.0, tip_mass=tip_mass, material=RUBBER)


def declared():
    return read_declaration(EXAMPLE / "model.yaml")


@cache
def plan():
    os.environ[VARIABLE] = str(FOLDER)
    return Plan(load_study(EXAMPLE / "study.yaml"))


@cache
def fitted(name) -> FitResult:
    """A fit of the study, without the rest of the pipeline."""
    samples = [s for s in plan().samples.values() if s.performer == "bench"]
    records = {s.id: perform(s.specimen, s.experiment, s.model, plan().lab_file(s)) for s in samples}
    used, held_out = targets_of(plan(), name, records)
    found = fit(plan().study.fits[name], model_of(plan(), name), used, held_out, threads=2)
    print(f"\n{name}: {found.evaluations} runs in {found.wall_time_s:.0f} s")
    for p in found.parameters:
        print(f"  {p.name} = {p.value:.5g} +- {p.standard_error:.2g} {p.unit}")
    for t in found.targets:
        print(f"  {t.name} {t.use}: {100 * t.error:.2f} %, {1e3 * t.rms:.3f} mm, {t.nuisances}")
    return found


def errors(found):
    """Tracking error by use, %."""
    return {t.use: 100 * t.error for t in found.targets}


def test_the_chain_bends_like_a_timoshenko_beam():
    model, specimen = declared(), beam()
    values = model.values(specimen, {"g": 1e-4})
    compliance, _ = tip_compliance(Chain(compile_mechanism(model.build(specimen, values))))
    inertia, nu = 0.03**4 / 12, RUBBER.poisson_ratio
    kappa, shear_modulus = 10 * (1 + nu) / (12 + 11 * nu), RUBBER.youngs_modulus / (2 * (1 + nu))
    bending = 0.1**3 / (3 * RUBBER.youngs_modulus * inertia)
    assert compliance[2, 2] == pytest.approx(bending + 0.1 / (kappa * shear_modulus * 0.03**2), rel=1e-3)
    # A tenth of it is shear, which hinges alone would have put into the modulus.
    assert compliance[2, 2] / bending == pytest.approx(1.08, abs=0.01)


def released(tip_mass, load_mass=0.135, **values):
    """Heights of the tip's markers above rest after a release, (samples,), m."""
    model = declared()
    test = RingDown(
        own_weight=np.pi / 2, direction=-np.pi / 2, load_mass=load_mass, rate=400.0, duration=0.6, markers=((0, 0, 0),)
    )
    specimen = beam(tip_mass)
    batch = Batch(model, time_step=0.84e-3)
    (response,) = batch([Request(specimen, test, model.values(specimen, values))])
    assert response is not None, batch.failures
    return -response["markers"][:, 0, 2]


def test_a_weight_on_a_thread_cannot_hold_the_beam_back():
    # The tip of a straight beam falls at 1.5 g (exactly that when it is a rigid bar on a hinge), a weight at 1 g.
    height = released(0.101)
    fallen = height[0] - height[12]
    assert fallen > 1.15 * 9.81 * 0.03**2 / 2
    # Later the thread is taut: three times slower than without the weight.
    bare = released(0.0, 0.03)
    assert np.argmin(height) > 2.0 * np.argmin(bare)


def test_friction_stops_the_loaded_beam_but_not_the_bare_one():
    without, with_friction = released(0.101, friction=1e-6), released(0.101, friction=3e-3)
    assert np.ptp(with_friction[160:]) < 0.8 * np.ptp(without[160:])
    np.testing.assert_allclose(released(0.0, 0.03, friction=3e-3), released(0.0, 0.03, friction=1e-6), atol=2e-5)


@recorded
def test_the_recordings_are_read_as_the_study_says():
    for sample in (s for s in plan().samples.values() if s.performer == "bench"):
        record = perform(sample.specimen, sample.experiment, sample.model, plan().lab_file(sample))
        assert record.origin == "lab"
        assert record.completed
        assert record["markers"].shape == (201, 3, 3)
        drop = -record["markers"][0, :, 2].mean()
        assert drop == pytest.approx({0.0: 6.4e-3, 0.101: 25.8e-3}[sample.specimen.tip_mass], rel=0.03)


@recorded
def test_a_recording_with_another_weight_is_refused(tmp_path):
    taken = tmp_path / LOADED.name
    taken.write_bytes(LOADED.read_bytes())
    (tmp_path / f"{LOADED.name}.yaml").write_text((EXAMPLE / "recording.csv.yaml").read_text())
    sample = next(s for s in plan().samples.values() if s.id == "release.bench.tip_mass=101g")
    perform(sample.specimen, sample.experiment, sample.model, taken)
    with pytest.raises(ValueError, match=r"another specimen: tip_mass 101 g, the study's has 0 g"):
        perform(beam(), sample.experiment, sample.model, taken)


@recorded
@pytest.mark.slow
def test_own_weight_predicts_the_weight_on_the_thread():
    found = fitted("own-weight")
    assert errors(found)["in sample"] < 6.0
    assert errors(found)["held out"] < 9.0
    assert found.values()["E"] == pytest.approx(PUBLISHED_MODULUS, rel=0.08)


@recorded
@pytest.mark.slow
def test_the_weight_on_the_thread_predicts_own_weight():
    found = fitted("loaded")
    assert errors(found)["in sample"] < 9.0
    assert errors(found)["held out"] < 11.0
    assert found.values()["E"] == pytest.approx(PUBLISHED_MODULUS, rel=0.08)


@recorded
@pytest.mark.slow
def test_both_recordings_give_one_modulus():
    first, second = (fitted(name).values()["E"] for name in ("own-weight", "loaded"))
    assert first == pytest.approx(second, rel=0.02)


@recorded
@pytest.mark.slow
def test_linear_hinges_do_much_worse():
    linear, ours = errors(fitted("hinges-own-weight")), errors(fitted("own-weight"))
    assert linear["in sample"] > 3 * ours["in sample"]
    assert linear["held out"] > 3 * ours["held out"]


@recorded
@pytest.mark.slow
def test_the_fitted_model_goes_into_a_simulator():
    sample = next(s for s in plan().samples.values() if s.id == "release.from-own-weight.tip_mass=101g")
    text = mjcf_of(model_of(plan(), "own-weight"), fitted("own-weight").values(), sample.specimen, sample.experiment)
    assert 'frictionloss="' in text
    assert 'name="thread below"' in text
