"""Bootstrap against the covariance, and how its records are made."""

import numpy as np
import pytest

from calibrate.bootstrap import bootstrap, resampled
from calibrate.objective import Problem
from calibrate.search import polish
from calibrate.spec import DataSpec
from calibrate.uncertainty import uncertainty
from lab.experiments import RingDown, StaticStiffness

NOISE = 1e-4


def data(**more) -> DataSpec:
    return DataSpec(campaign="c", reference="lab", used=["a"], **more)


def optimum(bench, targets, free=("k", "c", "m"), objective="rms"):
    problem = Problem(bench.performer, targets, objective, dict.fromkeys(free), bench.truth)
    start = problem.space.place(np.array([bench.truth[n] for n in problem.space.names]))
    unit, residual = polish(problem, start, problem.residuals(start[None])[0])
    derivative = problem.derivative(unit)
    return problem, unit, derivative, uncertainty(problem, unit, residual, derivative)


@pytest.mark.parametrize("noise", [None, "0.1 mm"])
def test_white_noise_spreads_refits_as_the_covariance_says(bench, noise):
    found = optimum(bench, [bench.target("y", RingDown(duration=0.25), data(noise=noise), noise=NOISE, seed=1)])
    again = bootstrap(*found, 300, seed=4)
    assert again.method.startswith("parametric" if noise else "moving blocks of 5 to 5 samples")
    assert again.failed == 0
    assert again.standard_errors == pytest.approx(found[3].standard_errors, rel=0.25)
    assert np.array(again.correlation) == pytest.approx(found[3].correlation, abs=0.15)
    low, high = np.array(again.intervals).T
    assert (high - low) / 3.92 == pytest.approx(found[3].standard_errors, rel=0.25)


def test_the_same_seed_gives_the_same_spread(bench):
    found = optimum(bench, [bench.target("y", RingDown(duration=0.2), noise=NOISE, seed=1)])
    assert bootstrap(*found, 20, seed=4) == bootstrap(*found, 20, seed=4)
    assert bootstrap(*found, 20, seed=4) != bootstrap(*found, 20, seed=5)


def test_blocks_keep_the_correlation_of_model_error(bench):
    target = bench.target("y", RingDown(duration=0.25), noise=NOISE, seed=1)
    wave = 5 * NOISE * np.sin(2 * np.pi * 9 * target.record["time"])
    target.record["markers"][:, :, 1] += wave[:, None]
    problem, unit, derivative, known = optimum(bench, [target])
    ((references,), method) = resampled(problem, unit, known.errors, 50, np.random.default_rng(0))
    assert int(method.split()[3]) > 10
    clean = problem.predictions(unit[None])[0][0]
    new = references - clean
    neighbours = np.mean(new[:, 1:] * new[:, :-1]) / np.mean(new**2)
    assert neighbours > 0.5
    assert np.sqrt(np.mean(new**2)) == pytest.approx(known.errors[0].size, rel=0.05)


def test_refits_at_a_bound_stay_inside(bench):
    target = bench.target("y", RingDown(duration=0.2), noise=NOISE, seed=1)
    problem = Problem(bench.performer, [target], "rms", {"k": (20.0, 150.0), "c": None}, bench.truth)
    start = problem.space.place(np.array([149.0, 0.06]))
    unit, residual = polish(problem, start, problem.residuals(start[None])[0])
    derivative = problem.derivative(unit)
    known = uncertainty(problem, unit, residual, derivative)
    again = bootstrap(problem, unit, derivative, known, 30, seed=1)
    assert again.failed == 0
    assert again.intervals[0][1] <= 150.0


def test_few_numbers_are_drawn_not_resampled(bench):
    static = bench.target("k", StaticStiffness(), data(quantities=["k_yy", "k_zz", "n_xx"]), noise=0.05, seed=2)
    problem, unit, derivative, known = optimum(bench, [static], ("k",), "relative")
    ((references,), _) = resampled(problem, unit, known.errors, 200, np.random.default_rng(0))
    assert references.shape == (200, 3, 1)
    assert references.std(axis=0)[:, 0] / [450.0, 450.0, 0.012] == pytest.approx(known.errors[0].size, rel=0.2)
