"""The joint misfit: scales, weights, windows, nuisances, derivatives, failed candidates."""

import numpy as np
import pytest

from calibrate.objective import Problem
from calibrate.spec import DataSpec
from lab.experiments import RingDown, StaticStiffness
from lab.measures import tracking_error, tracking_rms

ALONG_Y, ALONG_Z = RingDown(duration=0.2), RingDown(duration=0.1, direction=np.pi / 2)


def data(**more) -> DataSpec:
    return DataSpec(campaign="c", reference="lab", used=["a"], **more)


def place(problem, bench, **changes):
    values = {**bench.truth, **changes}
    return problem.space.place(np.array([values.get(n, 0.0) for n in problem.space.names]))


def test_rms_is_eq_5_13_over_all_records(bench):
    targets = [bench.target("y", ALONG_Y), bench.target("z", ALONG_Z)]
    problem = Problem(bench.performer, targets, "rms", {"k": None})
    off = bench.record(ALONG_Y, k=160.0)["markers"], bench.record(ALONG_Z, k=160.0)["markers"]
    each = [tracking_rms(model, t.record["markers"]) for model, t in zip(off, targets, strict=True)]
    problem.fixed = {**bench.truth}
    (found,) = problem.objectives(place(problem, bench, k=160.0)[None])
    # Records of different length weigh the same.
    assert found == pytest.approx(np.sqrt(np.mean(np.square(each))), rel=1e-9)
    weighted = [bench.target("y", ALONG_Y, data(weight=3.0)), targets[1]]
    problem = Problem(bench.performer, weighted, "rms", {"k": None}, bench.truth)
    (found,) = problem.objectives(place(problem, bench, k=160.0)[None])
    assert found == pytest.approx(np.sqrt((3 * each[0] ** 2 + each[1] ** 2) / 4), rel=1e-9)


def test_relative_is_the_mean_of_squared_tracking_errors(bench):
    static = bench.target("k", StaticStiffness(), data(quantities=["k_yy", "k_zz", "n_xx"]))
    problem = Problem(bench.performer, [bench.target("y", ALONG_Y), static], "relative", {"k": None}, bench.truth)
    (found,) = problem.objectives(place(problem, bench, k=160.0)[None])
    track = tracking_error(bench.record(ALONG_Y, k=160.0)["markers"], bench.record(ALONG_Y)["markers"])
    # Both stiffnesses over the larger one; torsion is exact.
    numbers = np.array([10.0, 30.0, 0.0]) / np.array([450.0, 450.0, 1.0])
    assert found == pytest.approx(np.sqrt((track**2 + np.mean(numbers**2)) / 2), rel=1e-6)


def test_rms_takes_markers_only(bench):
    with pytest.raises(ValueError, match=r"record k: objective rms \(eq. 5.13\) is in metres and takes markers only"):
        Problem(bench.performer, [bench.target("k", StaticStiffness())], "rms", {"k": None})


def test_wrong_problems_are_refused(bench):
    one = bench.target("y", ALONG_Y)
    with pytest.raises(ValueError, match="oscillator has no parameter 'E'; it has k, c, m, kt, ct"):
        Problem(bench.performer, [one], "rms", {"E": None})
    with pytest.raises(ValueError, match="record y is given more than once"):
        Problem(bench.performer, [one, one], "rms", {"k": None})
    with pytest.raises(ValueError, match="at least one record"):
        Problem(bench.performer, [], "rms", {"k": None})


def test_the_truth_has_no_residual_whatever_the_sensors_did(bench):
    nuisances = data(nuisances=dict.fromkeys(["release_time", "offset", "gain"]))
    one = bench.target("y", ALONG_Y, nuisances, late=0.0031, gain=1.1, offset=0.002)
    problem = Problem(bench.performer, [one], "rms", {"k": None, "c": None}, bench.truth)
    assert problem.space.names == ("k", "c", "y: release_time", "y: gain")
    at = place(problem, bench, **{"y: release_time": 0.0031, "y: gain": 1.1})
    # Interpolation, and the record's own clock of 0.01 ms.
    assert problem.objectives(at[None])[0] < 1e-5
    assert problem.objectives(at[None] + [0, 0, 0.1, 0])[0] > 1e-4


def test_a_window_leaves_the_rest_out_and_shortens_the_run(bench):
    one = bench.target("y", ALONG_Y, data(window=(0.02, 0.05)))
    problem = Problem(bench.performer, [one], "rms", {"k": None}, bench.truth)
    assert problem.size == 11 * 9
    assert problem.views[0].experiment.samples == 19
    assert problem.objectives(place(problem, bench)[None])[0] < 1e-12


def test_everything_goes_in_one_batch(bench):
    targets = [bench.target("y", ALONG_Y), bench.target("z", ALONG_Z)]
    problem = Problem(bench.performer, targets, "rms", {"k": None, "c": None, "m": None})
    bench.performer.asked.clear()
    problem.residuals(np.random.default_rng(0).random((10, 3)))
    problem.derivative(np.full(3, 0.5))
    assert bench.performer.asked == [20, 12]
    assert problem.evaluations == 16


def test_the_derivative_is_that_of_the_residual(bench):
    problem = Problem(bench.performer, [bench.target("y", ALONG_Y)], "rms", {"k": None, "c": None}, bench.truth)
    unit, step = np.array([0.4, 0.5]), 1e-6
    derivative = problem.derivative(unit)
    for column in range(2):
        shift = step * np.eye(2)[column]
        up, down = problem.residuals(np.array([unit + shift, unit - shift]))
        assert derivative[:, column] == pytest.approx((up - down) / (2 * step), abs=2e-4 * np.abs(derivative).max())
    assert np.array_equal(problem.derivative(unit, [1]), derivative[:, 1:])


def test_failed_candidates_are_penalised_and_differences_turn_one_sided(bench):
    performer = type(bench.performer)(broken_above=150.0)
    problem = Problem(performer, [bench.target("y", ALONG_Y)], "rms", {"k": None}, bench.truth)
    edge = problem.space.place(np.array([149.99]))
    assert problem.objectives(np.array([[0.9]]))[0] == problem.penalty
    assert problem.penalty > problem.objectives(np.array([[0.01]]))[0]
    whole = Problem(bench.performer, problem.targets, "rms", {"k": None}, bench.truth)
    two_sided = whole.derivative(edge)
    assert problem.derivative(edge) == pytest.approx(two_sided, abs=0.05 * np.abs(two_sided).max())
    assert np.all(problem.derivative(np.array([0.9])) == 0.0)
