"""Choosing among fitted models, and the spread of what they say."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

import prb
from calibrate.fitting import fit, target
from calibrate.selection import Candidate, Ranked, Spread, rank, select
from calibrate.spec import DataSpec, Fit, Search
from lab.experiments import RingDown
from lab.specimens import TwistedBeam
from prb.model import PrbModel

BEAM = TwistedBeam(mass=0.00517)
DATA = DataSpec(campaign="c", reference="lab", used=["a"])
CHAIN = PrbModel(topology="gauss-chain", time_step=1e-3)
#: Small enough that three stations are told from four.
NOISE = 3e-5
TRUTH = {"E": 65e6, "GJ": 5e-3, "tau": 3e-3, "tau_t": 2e-3}


def made(name, direction, seed):
    ring = RingDown(direction=direction, duration=0.12, load_place=(0.0, 0.0, 0.008))
    record = prb.perform(BEAM, ring, CHAIN.model_copy(update={"parameters": TRUTH}))
    clean = record.channels["markers"]
    noisy = clean.values + NOISE * np.random.default_rng(seed).standard_normal(clean.values.shape)
    record = replace(record, channels={**record.channels, "markers": replace(clean, values=noisy)})
    return target(name, BEAM, ring, record, DATA)


@pytest.fixture(scope="module")
def used():
    return [made("y", 0.0, 1), made("z", np.pi / 2, 2)]


@pytest.fixture(scope="module")
def held_out():
    return [made("d", np.pi / 4, 3)]


@pytest.fixture(scope="module")
def candidates(used, held_out):
    found = []
    for name, model, free in (
        ("hinges", PrbModel(topology="five-hinge", time_step=1e-3), ("k", "b", "l2")),
        ("chain", CHAIN, tuple(TRUTH)),
        ("chain4", PrbModel(topology="gauss-chain", settings={"stations": 4}, time_step=1e-3), tuple(TRUTH)),
    ):
        search = Search(method="least-squares", starts=8, polished=1)
        spec = Fit(model=name, free=dict.fromkeys(free), data=[DATA], search=search, advice=False)
        result = fit(spec, model, used, held_out, threads=2)
        # As read from a file.
        found.append(Candidate(name, model, spec, json.loads(json.dumps(result.to_json()))))
    return found


@pytest.fixture(scope="module")
def selection(candidates, used, held_out):
    return select(candidates, used, held_out)


def test_the_model_that_made_the_records_wins(selection, candidates):
    assert selection.ranked[0].name == "chain"
    assert [r.held_out for r in selection.ranked] == sorted(r.held_out for r in selection.ranked)
    by_name = {r.name: r for r in selection.ranked}
    assert not by_name["hinges"].credible
    assert by_name["chain"].parameters == 4
    errors = [t["error"] for t in candidates[0].result["targets"] if t["use"] == "in sample"]
    assert by_name["hinges"].in_sample == pytest.approx(np.sqrt(np.mean(np.square(errors))))
    assert by_name["chain"].held_out_rms == pytest.approx(np.sqrt(3) * NOISE, rel=0.15)
    assert selection.notes[0].startswith("Chosen by the held-out error: chain (")


def test_quantities_of_all_models_come_with_interval_and_spread(selection):
    spreads = {s.name: s for s in selection.spreads}
    assert {"C_yy", "C_zz", "C_rxrx", "f_1", "zeta_1", "f_2", "zeta_2", "d: frequency"} <= set(spreads)
    frequency = spreads["f_1"]
    assert set(frequency.values) == set(frequency.half_widths) == {"hinges", "chain", "chain4"}
    assert all(0 < width < 0.1 * frequency.values[name] for name, width in frequency.half_widths.items())
    # The hinges are no candidate for the truth: they do not count.
    among = abs(frequency.values["chain"] - frequency.values["chain4"]) / 2
    assert frequency.spread == pytest.approx(among)
    extremes = np.ptp(list(frequency.values.values())) / 2
    assert frequency.spread_of_all == pytest.approx(extremes)
    assert extremes > 10 * among


def test_the_interval_of_a_known_function_is_exact(selection, candidates):
    # Torsion's compliance is L / GJ: its relative error is that of GJ.
    result = next(c.result for c in candidates if c.name == "chain")
    rigidity = next(p for p in result["parameters"] if p["name"] == "GJ")
    spread = next(s for s in selection.spreads if s.name == "C_rxrx")
    wanted = 1.96 * rigidity["standard_error"] / rigidity["value"] * 0.05 / rigidity["value"]
    # At twist, flat and edge hinges add nothing about x.
    assert spread.values["chain"] == pytest.approx(0.05 / rigidity["value"], rel=1e-6)
    assert spread.half_widths["chain"] == pytest.approx(wanted, rel=0.01)


def test_leaving_one_record_out_ranks_without_held_out_ones(candidates, used, held_out):
    found = select(candidates[:2], used, held_out, leave_one_out=True)
    assert found.by == "leave-one-record-out"
    assert found.ranked[0].name == "chain"
    assert found.ranked[0].left_out < found.ranked[1].left_out
    assert found.ranked[0].left_out >= 0.9 * found.ranked[0].in_sample


def test_a_selection_is_plain_data(selection):
    data = json.loads(json.dumps(selection.to_json(), allow_nan=False))
    assert data["chosen"] == "chain"
    assert data["ranked"][0]["left_out"] is None
    assert data["kind"] == "selection"


def test_wrong_selections_are_refused(candidates, used, held_out):
    with pytest.raises(ValueError, match="needs at least two fits"):
        select(candidates[:1], used, held_out)
    with pytest.raises(ValueError, match=r"fit hinges is of other records: z \(in sample\) is not in all of them"):
        select(candidates, used[:1], held_out)
    one = [replace(c, result={**c.result, "targets": c.result["targets"][::2]}) for c in candidates]
    with pytest.raises(ValueError, match="at least two used records"):
        select(one, used[:1], held_out, leave_one_out=True)
    two = [replace(c, result={**c.result, "targets": c.result["targets"][:2]}) for c in candidates]
    with pytest.raises(ValueError, match="nothing is held out"):
        select(two, used)


def test_models_without_a_score_come_last():
    scores = {"a": 0.3, "b": math.nan, "c": 0.1, "d": 0.19}
    ranked = rank([Ranked(n, 1, 0.1, s, math.nan, 0.0, 0.0) for n, s in scores.items()], "held_out")
    assert [r.name for r in ranked] == ["c", "d", "a", "b"]
    assert [r.credible for r in ranked] == [True, True, False, False]


def test_a_spread_speaks_where_intervals_are_too_narrow():
    wide = Spread("f_1", "Hz", "", {"a": 30.0, "b": 34.0}, {"a": 0.1, "b": 0.1}, 2.0, 2.0)
    assert wide.sentence() == (
        "f_1: the choice of the model moves it by +-2 Hz, 20 times more than the intervals of the fits admit."
    )
    assert Spread("f_1", "Hz", "", {}, {"a": 3.0, "b": 3.0}, 2.0, 2.0).sentence() == ""
    assert Spread("f_1", "Hz", "", {}, {"a": math.inf}, 2.0, 2.0).sentence() == ""
