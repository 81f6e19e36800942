"""What is said about parameters that records cannot tell, and which experiment would."""

import numpy as np
import pytest

from calibrate.advice import errors_of_information
from calibrate.fitting import fit_performer
from calibrate.spec import DataSpec, Fit, Search
from lab.experiments import RingDown

ALONG_Y = RingDown(duration=0.2)
DATA = DataSpec(campaign="c", reference="lab", used=["a"])


def fitted(bench, targets, free, data=DATA, **changes):
    bounds = free if isinstance(free, dict) else dict.fromkeys(free)
    search = Search(method="least-squares", starts=12)
    return fit_performer(Fit(model="m", free=bounds, data=[data], search=search, **changes), bench.performer, targets)


def test_an_axial_release_asks_for_one_off_the_axis(bench):
    targets = [bench.target("y", ALONG_Y, noise=1e-4, seed=1)]
    result = fitted(bench, targets, ("k", "c", "kt", "ct"))
    assert "kt does not show in these records at all: its value is a guess." in result.notes
    assert "ct is not identified by these records: they leave it free." in result.notes
    assert result.advice[0].experiment.startswith("An off-axis release")
    assert result.advice[0].sentence in result.notes
    assert "would bring the standard error of kt from no knowledge to " in result.advice[0].sentence
    assert "load_place" in result.advice[0].change
    # What is advised is true: carried out, it tells kt and ct with the error that was announced.
    off = ALONG_Y.model_copy(update=dict(result.advice[0].change))
    done = fitted(bench, [*targets, bench.target("off", off, noise=1e-4, seed=2)], ("k", "c", "kt", "ct"))
    assert all(p.identified for p in done.parameters)
    relative = {p.name: p.standard_error / p.value for p in done.parameters}
    # The kt that could not be known was a guess, so that the forecast is one of size.
    assert result.values()["kt"] == pytest.approx(0.02)
    assert 0.3 < relative["ct"] / result.advice[0].after["ct"] < 3.0
    assert not any("off-axis" in a.experiment for a in done.advice)


def test_stiffness_and_mass_need_a_tip_mass(held_bench):
    result = fitted(held_bench, [held_bench.target("y", ALONG_Y, noise=1e-4, seed=1)], ("k", "c", "m"))
    assert "These records cannot separate k, c from m: only a combination of them shows." in result.notes
    assert result.advice[0].experiment == "The same release with a tip mass of 10 g"
    assert result.advice[0].change == {"tip_mass": 0.01}
    assert result.condition == np.inf


def test_a_gain_and_a_load_are_entangled(bench):
    data = DataSpec(campaign="c", reference="lab", used=["a"], nuisances={"gain": None, "experiment.load_mass": None})
    result = fitted(bench, [bench.target("y", ALONG_Y, data, noise=1e-4, seed=1)], ("k", "c", "m"), data)
    said = [note for note in result.notes if "cannot separate" in note]
    assert said
    assert "y: gain" in said[0]


def test_bounds_that_are_reached_are_said(bench):
    result = fitted(bench, [bench.target("y", ALONG_Y)], {"k": (20.0, 140.0), "c": None, "m": None})
    assert result.notes[0].startswith("k ended at its upper bound (140 N/m): the true optimum may lie")


def test_open_and_lopsided_profiles_are_said(held_bench):
    targets = [held_bench.target("y", ALONG_Y, noise=1e-4, seed=1)]
    result = fitted(held_bench, targets, ("k", "c", "m"), profile=True)
    assert any(note.startswith("The profile of m is open towards its lower and upper bound") for note in result.notes)


def test_advice_can_be_left_out(bench):
    targets = [bench.target("y", ALONG_Y, noise=1e-4, seed=1)]
    assert fitted(bench, targets, ("k", "kt"), advice=False).advice == ()
    slow = type(bench)(type(bench.performer)(cheap=False), bench.truth)
    assert fitted(slow, targets, ("k", "kt")).advice == ()


def test_information_has_standard_errors():
    matrix = np.array([[4.0, 1.0], [1.0, 9.0]])
    assert errors_of_information(matrix) == pytest.approx(np.sqrt(np.diag(np.linalg.inv(matrix))))
    assert errors_of_information(np.diag([4.0, 0.0])) == pytest.approx([0.5, np.inf])
    assert np.all(np.isinf(errors_of_information(np.ones((2, 2)))))
