"""Covariance: textbook cases, coverage, correlated residuals, what is not seen."""

import numpy as np
import pytest

from calibrate.objective import Problem
from calibrate.search import polish
from calibrate.spec import DataSpec
from calibrate.uncertainty import time_stretch, uncertainty
from lab.experiments import RingDown, StaticStiffness

ALONG_Y = RingDown(duration=0.25)
NOISE = 1e-4


def fitted(bench, targets, free=("k", "c", "m"), objective="rms"):
    """Optimum next to the truth and its uncertainty."""
    problem = Problem(bench.performer, targets, objective, dict.fromkeys(free), bench.truth)
    start = problem.space.place(
        np.array([bench.truth.get(n, 1.0 if "gain" in n else 0.0) for n in problem.space.names])
    )
    unit, residual = polish(problem, start, problem.residuals(start[None])[0])
    return problem, unit, uncertainty(problem, unit, residual, problem.derivative(unit))


def data(**more) -> DataSpec:
    return DataSpec(campaign="c", reference="lab", used=["a"], **more)


def coverage(bench, make, draws=100, free=("k", "c", "m")):
    """Share of 95 % intervals that hold the truth, (parameters,), over fresh noise."""
    hits = []
    for seed in range(draws):
        problem, _, known = fitted(bench, make(seed), free)
        truth = np.array([bench.truth[name] for name in problem.space.names[: len(free)]])
        low, high = known.intervals[: len(free)].T
        hits.append((low <= truth) & (truth <= high))
    return np.mean(hits, axis=0)


def test_nominal_intervals_cover_the_truth_with_white_noise(bench):
    shares = coverage(bench, lambda seed: [bench.target("y", ALONG_Y, noise=NOISE, seed=seed)])
    assert np.all((shares >= 0.90) & (shares <= 0.99)), shares


def test_known_noise_and_sensor_nuisances_keep_the_coverage(bench):
    spec = data(noise="0.1 mm", nuisances={"offset": None, "release_time": None})
    shares = coverage(bench, lambda seed: [bench.target("y", ALONG_Y, spec, noise=NOISE, seed=seed, late=0.001)], 60)
    assert np.all((shares >= 0.88) & (shares <= 1.0)), shares


def test_standard_errors_are_those_of_textbooks(bench):
    problem, unit, known = fitted(bench, [bench.target("y", ALONG_Y, data(noise="0.1 mm"), noise=NOISE, seed=3)])
    assert known.errors[0].is_noise
    derivative = problem.derivative(unit) / problem.blocks[0].factor / problem.space.slope(unit)
    exact = NOISE * np.sqrt(np.diag(np.linalg.inv(derivative.T @ derivative)))
    assert known.standard_errors == pytest.approx(exact, rel=1e-6)
    # Without the knowledge the residual says the same.
    estimated = fitted(bench, [bench.target("y", ALONG_Y, noise=NOISE, seed=3)])[2]
    assert estimated.errors[0].size == pytest.approx(NOISE, rel=0.1)
    assert estimated.standard_errors == pytest.approx(exact, rel=0.3)


def test_records_of_different_noise_each_count_for_what_they_are(bench):
    clean = bench.target("y", ALONG_Y, noise=NOISE, seed=1)
    noisy = bench.target("z", RingDown(duration=0.25, direction=1.5), noise=10 * NOISE, seed=2)
    known = fitted(bench, [clean, noisy])[2]
    assert known.errors[1].size == pytest.approx(10 * known.errors[0].size, rel=0.1)


def test_correlated_residuals_widen_the_intervals_and_are_named(bench):
    rng = np.random.default_rng(0)
    white = bench.target("y", ALONG_Y, data(noise="0.1 mm"), noise=NOISE, seed=1)
    slow = np.zeros((91, 3, 3))
    for k in range(1, 91):
        slow[k] = 0.9 * slow[k - 1] + 3 * NOISE * rng.standard_normal((3, 3))
    white.record["markers"][:] += slow
    known = fitted(bench, [white])[2]
    assert known.errors[0].stretch > 4.0
    sentence = known.errors[0].sentence()
    assert sentence.startswith("The residual of y is ")
    assert "times the known noise and is correlated in time (as good as " in sentence
    plain = fitted(bench, [bench.target("y", ALONG_Y, data(noise="0.1 mm"), noise=NOISE, seed=1)])[2]
    assert np.all(known.standard_errors > 5 * plain.standard_errors)


def test_white_noise_is_rarely_called_correlated():
    rng = np.random.default_rng(5)
    stretches = [time_stretch(rng.standard_normal((91, 9))) for _ in range(200)]
    assert np.mean(np.array(stretches) > 1.0) < 0.05


def test_an_oscillating_residual_counts_as_few_samples():
    # The sum of its autocorrelations vanishes: only the spectrum at its frequency shows it.
    wave = np.sin(0.5 * np.arange(200))[:, None] + 0.05 * np.random.default_rng(1).standard_normal((200, 1))
    assert time_stretch(wave) > 15.0


def test_what_is_not_seen_is_infinite_and_pointed_at(bench, held_bench):
    known = fitted(bench, [bench.target("y", ALONG_Y, noise=NOISE)], ("k", "c", "m", "kt"))[2]
    assert np.isinf(known.standard_errors).tolist() == [False, False, False, True]
    assert known.blind == pytest.approx(np.array([[0.0, 0.0, 0.0, 1.0]]))
    assert known.condition == np.inf
    # Let go from a given place, only ratios of k, c and m show.
    known = fitted(held_bench, [held_bench.target("y", ALONG_Y, noise=NOISE)])[2]
    assert np.all(np.isinf(known.standard_errors))
    assert np.abs(known.blind) == pytest.approx(np.full((1, 3), 1 / np.sqrt(3)), rel=1e-2)


def test_a_nuisance_takes_its_share(bench):
    plain = fitted(bench, [bench.target("y", ALONG_Y, noise=NOISE)], ("k", "c"))[2]
    with_gain = fitted(bench, [bench.target("y", ALONG_Y, data(nuisances={"gain": None}), noise=NOISE)], ("k", "c"))[2]
    assert with_gain.condition > plain.condition
    assert with_gain.standard_errors[0] > plain.standard_errors[0]


def test_too_few_samples_have_no_standard_error(bench):
    one = bench.target("k", StaticStiffness(), data(quantities=["k_yy", "n_xx"]))
    known = fitted(bench, [one], ("k", "kt"), "relative")[2]
    assert np.all(np.isnan(known.standard_errors))
