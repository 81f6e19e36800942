"""Pseudo-rigid-body models that have to be found again, from one kind of record or several."""

from dataclasses import replace

import numpy as np
import pytest

import prb
from calibrate.fitting import fit, target
from calibrate.spec import DataSpec, Fit, Search
from lab.experiments import BaseShake, NaturalModes, RingDown, StaticStiffness
from lab.specimens import TwistedBeam
from prb.model import PrbModel

NOISE = 1e-4
DATA = DataSpec(campaign="c", reference="lab", used=["a"])
LOCAL = Search(method="least-squares", starts=12)


def spec(free, data=DATA, **changes) -> Fit:
    bounds = free if isinstance(free, dict) else dict.fromkeys(free)
    return Fit(model="m", free=bounds, data=[data], **{"search": LOCAL, "advice": False, **changes})


BEAM = TwistedBeam(mass=0.00517)
FIVE = PrbModel(topology="five-hinge", time_step=1e-3)
CHAIN = PrbModel(topology="gauss-chain")
HINGES = {"k": 0.45, "b": 0.0022, "l2": 0.019}
MATERIAL = {"E": 65e6, "GJ": 5e-3, "tau": 3e-3, "tau_t": 2e-3}


def made(name, experiment, model, truth, seed=None, data=DATA, specimen=BEAM):
    record = prb.perform(specimen, experiment, model.model_copy(update={"parameters": truth}))
    assert record.completed
    if seed is not None:
        clean = record.channels["markers"]
        noise = NOISE * np.random.default_rng(seed).standard_normal(clean.values.shape)
        record = replace(record, channels={**record.channels, "markers": replace(clean, values=clean.values + noise)})
    return target(name, specimen, experiment, record, data)


def ring(direction=0.0, **changes) -> RingDown:
    return RingDown(direction=direction, duration=0.15, **changes)


@pytest.fixture(scope="module")
def hinged():
    return [made("y", ring(), FIVE, HINGES, 1), made("z", ring(np.pi / 2), FIVE, HINGES, 2)]


@pytest.fixture(scope="module")
def result(hinged):
    return fit(spec(HINGES.keys()), FIVE, hinged, threads=2)


def test_k_b_and_l2_come_back(result):
    for parameter in result.parameters:
        assert 0 < parameter.standard_error < 0.02 * parameter.value
        assert abs(parameter.value - HINGES[parameter.name]) < 4 * parameter.standard_error
    assert result.values()["k"] == pytest.approx(HINGES["k"], rel=5e-3)
    assert result.objective == pytest.approx(np.sqrt(3) * NOISE, rel=0.1)
    assert 1 < result.condition < 100


def test_threads_and_method_do_not_change_the_answer(hinged, result):
    again = fit(spec(HINGES.keys()), FIVE, hinged, threads=1)
    assert again.values() == result.values()
    assert again.history == result.history
    evolved = fit(spec(HINGES.keys(), search=Search(population=6, generations=12)), FIVE, hinged, threads=2)
    assert evolved.values() == pytest.approx(result.values(), rel=1e-4)


def test_a_second_direction_is_advised_for_the_place_of_the_hinges():
    # One marker at the tip and a release along y say little about l2; the tool finds what would.
    alone = made("y", ring(markers=((0.0, 0.0, 0.0),)), FIVE, HINGES, 1)
    result = fit(spec(HINGES.keys(), advice=True), FIVE, [alone], threads=2)
    errors = {p.name: p.standard_error / p.value for p in result.parameters}
    assert max(errors, key=errors.get) == "l2"
    assert result.advice[0].worst == "l2"
    words = [advice.experiment for advice in result.advice]
    assert any("along z" in text or "diagonal" in text for text in words)


def test_static_stiffness_and_ring_down_are_fitted_jointly():
    off_axis = ring(load_place=(0.0, 0.0, 0.01))
    used = [
        made("ring", off_axis, CHAIN, MATERIAL, 1),
        made("static", StaticStiffness(increments=2), CHAIN, MATERIAL),
    ]
    held = [made("z", ring(np.pi / 2), CHAIN, MATERIAL, 2)]
    search = Search(method="least-squares", starts=4, polished=1)
    result = fit(spec(MATERIAL.keys(), objective="relative", search=search), CHAIN, used, held, threads=2)
    for parameter in result.parameters:
        assert abs(parameter.value - MATERIAL[parameter.name]) < 4 * parameter.standard_error
        assert parameter.identified
    assert result.values()["E"] == pytest.approx(MATERIAL["E"], rel=0.01)
    assert result.targets[1].error < 0.01
    assert result.targets[2].rms == pytest.approx(np.sqrt(3) * NOISE, rel=0.15)


def test_torsion_needs_a_release_off_the_axis_and_the_tool_says_so():
    # In its flat plane, an untwisted beam is bent and never turned.
    flat = TwistedBeam(twist=0.0, mass=0.00517)
    used = [made("z", ring(np.pi / 2), CHAIN, MATERIAL, 1, specimen=flat)]
    result = fit(spec(MATERIAL.keys(), advice=True), CHAIN, used, threads=2)
    known = {p.name for p in result.parameters if p.identified}
    assert known == {"E", "tau"}
    assert result.advice[0].experiment.startswith("An off-axis release")
    assert result.advice[0].worst in ("GJ", "tau_t")
    assert result.advice[0].sentence in result.notes


def test_two_specimens_share_their_material():
    twisted, flat = BEAM, TwistedBeam(twist=0.5, mass=0.00517)
    used = [
        made("a", ring(), CHAIN, MATERIAL, 1, specimen=twisted),
        made("b", ring(), CHAIN, MATERIAL, 2, specimen=flat),
    ]
    given = CHAIN.model_copy(update={"parameters": {"GJ": MATERIAL["GJ"], "tau_t": MATERIAL["tau_t"]}})
    result = fit(spec(("E", "tau")), given, used, threads=2)
    assert result.values() == pytest.approx({"E": MATERIAL["E"], "tau": MATERIAL["tau"]}, rel=0.01)


def test_natural_modes_tell_the_stiffness():
    modes = made("modes", NaturalModes(count=4), CHAIN, MATERIAL)
    given = CHAIN.model_copy(update={"parameters": {**MATERIAL, "E": 40e6}})
    free = {"E": (30e6, 120e6), "GJ": (1e-3, 2e-2)}
    result = fit(spec(free, objective="relative"), given, [modes], threads=2)
    assert result.values() == pytest.approx({name: MATERIAL[name] for name in free}, rel=1e-6)
    assert list(result.targets[0].entries) == ["f_1", "f_2", "f_3", "f_4"]
    six = made("modes", NaturalModes(), CHAIN, MATERIAL)
    with pytest.raises(ValueError, match=r"record modes: the model has no f_6 to follow; it has f_1, .*, f_5$"):
        fit(spec(("k",), objective="relative"), FIVE, [six])


def test_a_shake_is_predicted_and_fitted():
    shake = BaseShake(frequency=20.0, max_periods=60, samples_per_period=32)
    held = [made("shake", shake, CHAIN, MATERIAL)]
    result = fit(spec(("E", "tau")), CHAIN, [made("y", ring(), CHAIN, MATERIAL)], held, threads=2)
    assert result.targets[1].use == "held out"
    assert 0 < result.targets[1].error < 0.2
    # And the other way round: a shake tells the stiffness too.
    given = CHAIN.model_copy(update={"parameters": {**MATERIAL, "E": 40e6}})
    result = fit(spec({"E": (30e6, 120e6)}), given, held, threads=2)
    assert result.values()["E"] == pytest.approx(MATERIAL["E"], rel=0.01)
    short = replace(held[0].record, channels={
        **held[0].record.channels,
        "markers": replace(held[0].record.channels["markers"], values=held[0].record["markers"][:10]),
        "time": replace(held[0].record.channels["time"], values=held[0].record["time"][:10]),
    })  # fmt: skip
    with pytest.raises(ValueError, match="markers has 10 samples; a period of the experiment has 33"):
        target("shake", BEAM, shake, short, DATA)
