"""Both searches find known numbers, repeat themselves, and say when they did not agree."""

import numpy as np
import pytest

from calibrate.objective import Problem
from calibrate.search import find, latin_hypercube, polish
from calibrate.spec import Search
from lab.experiments import RingDown

METHODS = ("differential-evolution", "least-squares")


@pytest.fixture(scope="module")
def targets(bench):
    return [bench.target("y", RingDown(duration=0.15), noise=1e-4, seed=1)]


def problem_of(bench, targets):
    return Problem(bench.performer, targets, "rms", {"k": None, "c": None}, {"m": bench.truth["m"]})


@pytest.mark.parametrize("method", METHODS)
def test_known_numbers_come_back(bench, targets, method):
    problem = problem_of(bench, targets)
    found = find(problem, Search(method=method))
    assert problem.space.values(found.unit) == pytest.approx([bench.truth["k"], bench.truth["c"]], rel=0.01)
    assert found.objective == pytest.approx(np.sqrt(3) * 1e-4, rel=0.1)
    assert list(found.history) == sorted(found.history, reverse=True)
    assert found.agreed


@pytest.mark.parametrize("method", METHODS)
def test_the_same_seed_gives_the_same_numbers(bench, targets, method):
    one, two, other = (
        find(problem_of(bench, targets), Search(method=method, seed=seed, generations=10, starts=5))
        for seed in (1, 1, 2)
    )
    assert np.array_equal(one.unit, two.unit)
    assert one.history == two.history
    assert other.history != one.history
    assert other.unit == pytest.approx(one.unit, rel=1e-5)


def test_starts_are_one_batch(bench, targets):
    problem = problem_of(bench, targets)
    bench.performer.asked.clear()
    find(problem, Search(method="least-squares", starts=20))
    assert bench.performer.asked[0] == 21


def test_an_unfinished_search_is_marked(bench, targets):
    found = find(problem_of(bench, targets), Search(generations=1, population=5))
    assert not found.agreed


def test_a_latin_hypercube_has_one_point_in_each_slice():
    points = latin_hypercube(12, 3, np.random.default_rng(3))
    assert np.array_equal(np.sort(np.floor(points * 12), axis=0), np.tile(np.arange(12)[:, None], 3))


def test_a_polish_never_makes_it_worse_and_holds_what_it_must(bench, targets):
    problem = problem_of(bench, targets)
    start = np.array([0.43, 0.6])
    first = problem.residuals(start[None])[0]
    unit, residual = polish(problem, start, first, [1])
    assert unit[0] == start[0]
    assert np.linalg.norm(residual) < np.linalg.norm(first)
    assert residual == pytest.approx(problem.residuals(unit[None])[0])


def test_a_region_that_cannot_be_simulated_is_gone_round(bench, targets):
    performer = type(bench.performer)(broken_above=180.0)
    problem = Problem(performer, targets, "rms", {"k": None, "c": None}, {"m": bench.truth["m"]})
    for method in METHODS:
        assert problem.space.values(find(problem, Search(method=method)).unit)[0] == pytest.approx(150.0, rel=0.01)


@pytest.mark.parametrize("method", METHODS)
def test_nothing_that_runs_is_said(bench, targets, method):
    problem = Problem(type(bench.performer)(broken_above=0.0), targets, "rms", {"k": None})
    with pytest.raises(ValueError, match="no candidate of the search could be simulated; narrow the bounds"):
        find(problem, Search(method=method, generations=2, starts=3))
