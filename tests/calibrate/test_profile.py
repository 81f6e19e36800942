"""Profile likelihood: like the standard error where the model is nearly linear, honest where it is not."""

import numpy as np
import pytest

from calibrate.objective import Problem
from calibrate.profile import THRESHOLD, profile
from calibrate.search import polish
from calibrate.uncertainty import uncertainty
from lab.experiments import RingDown


def profiled(bench, target, free, bounds=None, which=0):
    problem = Problem(bench.performer, [target], "rms", {**dict.fromkeys(free), **(bounds or {})}, bench.truth)
    start = problem.space.place(np.array([bench.truth[n] for n in problem.space.names]))
    unit, residual = polish(problem, start, problem.residuals(start[None])[0])
    derivative = problem.derivative(unit)
    known = uncertainty(problem, unit, residual, derivative)
    return problem, known, profile(problem, unit, residual, derivative, known, which)


def test_a_nearly_linear_model_agrees_with_its_standard_error(bench):
    target = bench.target("y", RingDown(duration=0.2), noise=1e-4, seed=1)
    _, known, found = profiled(bench, target, ("k", "c", "m"), which=1)
    assert found.interval == pytest.approx(known.intervals[1], rel=5e-3)
    assert found.open_sides == ()
    assert list(found.values) == sorted(found.values)
    assert min(found.rise) == 0.0
    assert found.rise[0] > THRESHOLD < found.rise[-1]


def test_a_valley_is_followed_to_the_bounds(held_bench):
    # Only ratios of k, c and m show: m alone is free, and k as far as the bounds of m let it.
    target = held_bench.target("y", RingDown(duration=0.2), noise=1e-4, seed=1)
    problem, _, mass = profiled(held_bench, target, ("k", "c", "m"), which=2)
    assert mass.open_sides == ("lower", "upper")
    assert mass.interval == (0.001, 0.02)
    assert max(mass.rise) < 0.1
    _, _, stiffness = profiled(held_bench, target, ("k", "c", "m"), which=0)
    ratio = held_bench.truth["k"] / held_bench.truth["m"]
    assert stiffness.interval[0] < 1.5 * 0.001 * ratio
    assert stiffness.interval[1] > 0.8 * 0.02 * ratio


def test_a_side_that_ends_at_its_bound_is_open(bench):
    target = bench.target("y", RingDown(duration=0.2), noise=1e-4, seed=1)
    _, _, free = profiled(bench, target, ("k", "c"))
    middle = (free.interval[0] + free.interval[1]) / 2
    bound = 0.5 * (middle + free.interval[1])
    _, _, found = profiled(bench, target, ("c",), {"k": (20.0, bound)}, which=1)
    assert found.open_sides == ("upper",)
    assert found.interval == pytest.approx((free.interval[0], bound), rel=1e-4)
