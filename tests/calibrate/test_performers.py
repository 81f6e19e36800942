"""Models as fits see them."""

import numpy as np
import pytest

import prb
from calibrate.performers import FeaPerformer, PrbPerformer, free_coordinates, performer_of
from fea.model import FeaModel, MaterialChange
from lab.experiments import RingDown
from lab.specimens import PinchedTube, TwistedBeam
from prb.model import PrbModel

BEAM = TwistedBeam()


def test_models_find_their_performer():
    assert isinstance(performer_of(PrbModel(topology="five-hinge")), PrbPerformer)
    assert isinstance(performer_of(FeaModel(element="shell")), FeaPerformer)


def test_a_prb_run_carries_every_parameter_and_matches_a_single_run():
    model = PrbModel(topology="five-hinge", parameters={"k": 0.5})
    performer, ring = performer_of(model), RingDown(duration=0.02)
    request = performer.request(BEAM, ring, {"b": 0.002})
    assert request.values == {**model.values(BEAM), "b": 0.002}
    (response,) = performer.run([request])
    alone = prb.perform(BEAM, ring, model.model_copy(update={"parameters": {"k": 0.5, "b": 0.002}}))
    assert response["markers"] == pytest.approx(alone["markers"], abs=1e-12)


def test_a_model_s_own_value_is_the_nominal_one():
    declared = performer_of(PrbModel(topology="five-hinge", parameters={"k": 0.5})).declared(BEAM)
    assert declared["k"].nominal == 0.5
    assert (declared["l2"].unit, declared["l2"].shown_in) == ("m", "mm")


def test_fea_figures_go_into_the_specimen():
    model = FeaModel(element="shell", material=MaterialChange(youngs_modulus=70e6))
    performer = performer_of(model)
    declared = performer.declared(BEAM)
    assert set(declared) == {"youngs_modulus", "viscous_time", "mass_damping", "poisson_ratio", "thickness"}
    assert declared["youngs_modulus"].nominal == 70e6
    assert (declared["youngs_modulus"].lower, declared["youngs_modulus"].upper) == pytest.approx((7e6, 700e6))
    request = performer.request(BEAM, RingDown(), {"viscous_time": 2e-3, "thickness": 0.0031})
    assert request.values == {}
    assert request.specimen.thickness == 0.0031
    assert request.specimen.material.viscous_time == 2e-3
    assert request.specimen.material.youngs_modulus == 70e6


def test_solids_have_no_thickness_to_fit():
    performer = performer_of(FeaModel())
    with pytest.raises(ValueError, match="FEA with solid elements has no parameter 'thickness'; it has youngs_modulus"):
        free_coordinates(performer, [BEAM], {"thickness": None})


def test_tubes_have_a_wall_instead_of_a_thickness():
    declared = FeaPerformer(FeaModel(element="shell")).declared(PinchedTube())
    assert "thickness" not in declared
    assert declared["youngs_modulus"].nominal == PinchedTube().material.youngs_modulus


def test_bounds_hold_for_all_specimens():
    performer = performer_of(PrbModel(topology="five-hinge"))
    beams = [BEAM, BEAM.model_copy(update={"length": 0.060})]
    (place,) = free_coordinates(performer, beams, {"l2": None})
    each = [performer.declared(beam)["l2"] for beam in beams]
    assert place.lower == max(c.lower for c in each)
    assert place.upper == min(c.upper for c in each)
    with pytest.raises(ValueError, match="topology five-hinge has no parameter 'E'; it has k, b, l2"):
        free_coordinates(performer, beams, {"E": None})


@pytest.mark.slow
def test_fea_runs_in_memory():
    performer = performer_of(FeaModel(element="shell"))
    ring = RingDown(duration=0.02, rate=100.0)
    soft, stiff = performer.run([performer.request(BEAM, ring, {"youngs_modulus": e}) for e in (30e6, 60e6)])
    assert np.linalg.norm(soft["markers"][0]) > 1.5 * np.linalg.norm(stiff["markers"][0])


def test_rough_runs_are_nearly_right_and_exact_where_long_steps_fail():
    performer = performer_of(PrbModel(topology="gauss-chain", time_step=0.5e-3))
    ring = RingDown(duration=0.05)
    fine, rough = (p.run([performer.request(BEAM, ring, {})])[0] for p in (performer, performer.rough()))
    miss = np.linalg.norm(fine["markers"] - rough["markers"]) / np.linalg.norm(fine["markers"])
    assert 0 < miss < 0.1
    # Hardly damped and stiff: long steps are not stable, short ones are.
    stiff = performer_of(PrbModel(topology="gauss-chain", time_step=0.05e-3))
    request = stiff.request(BEAM, RingDown(duration=0.01), {"tau": 1e-5, "tau_t": 1e-5})
    long = performer_of(PrbModel(topology="gauss-chain", time_step=0.15e-3)).run([request])
    assert long == [None]
    (exact,), (again,) = stiff.run([request]), stiff.rough().run([request])
    assert np.array_equal(exact["markers"], again["markers"])
