"""Parameters over designs: curves, warnings, JSON, and predictions of designs that were left out."""

import json

import numpy as np
import pytest

from calibrate.parametric import Curve, ParametricModel, learn
from calibrate.parametric_fit import learn_from
from calibrate.spec import DataSpec, ParametricFit, Search
from lab.experiments import RingDown
from lab.specimens import TwistedBeam

TWISTS = tuple(np.deg2rad([0.0, 20.0, 40.0, 60.0, 80.0, 100.0]))


def beams(twists=TWISTS, **more):
    return [TwistedBeam(twist=float(twist), **more) for twist in twists]


def curve(function, twists=TWISTS, name="k", symmetry=None, known=None, lower=1e-9, errors=None):
    values = tuple(float(function(t)) for t in twists)
    size = errors or tuple(0.01 * abs(v) for v in values)
    return Curve(name, "N/m", values, size, known or (True,) * len(values), lower, 1e9, symmetry)


def model_of(*curves, twists=TWISTS):
    return learn("t", ("twist",), beams(twists), curves)


def test_smooth_functions_are_followed_between_the_designs():
    model = model_of(curve(lambda t: 100 * np.exp(0.4 * np.sin(t))), curve(lambda t: 2.0, name="b"))
    for twist in np.deg2rad([10.0, 33.0, 70.0]):
        found = model.predict(TwistedBeam(twist=float(twist)))
        assert found.values["k"] == pytest.approx(100 * np.exp(0.4 * np.sin(twist)), rel=5e-3)
        assert found.values["b"] == pytest.approx(2.0)
        assert found.warnings == ()


def test_the_designs_themselves_are_met():
    model = model_of(curve(lambda t: 100 + 30 * t**2))
    for beam, value in zip(beams(), model.curves[0].values, strict=True):
        assert model.predict(beam).values["k"] == pytest.approx(value, rel=1e-9)


def test_powers_of_the_design_go_on_as_straight_lines_and_say_so():
    model = model_of(curve(lambda t: 100.0 * np.exp(t)))
    found = model.predict(TwistedBeam(twist=np.deg2rad(140.0)))
    assert found.values["k"] == pytest.approx(100.0 * np.exp(np.deg2rad(140.0)), rel=1e-6)
    assert found.warnings == (
        "twist 140 deg is outside of the designs, 0 deg to 100 deg",
        "the next fitted design is 2.0 times the usual spacing away",
    )


def test_symmetry_serves_the_other_sign():
    even, odd = (
        curve(lambda t: 100 + 30 * t**2, symmetry="even"),
        curve(lambda t: 3 * t, name="c", symmetry="odd", lower=-9.0),
    )
    model = model_of(even, odd)
    found = model.predict(TwistedBeam(twist=-TWISTS[2]))
    assert found.values["k"] == pytest.approx(100 + 30 * TWISTS[2] ** 2, rel=1e-6)
    assert found.values["c"] == pytest.approx(-3 * TWISTS[2], rel=1e-6)
    assert found.warnings == ()
    lopsided = model_of(curve(lambda t: 100 + 30 * t**2))
    assert "outside of the designs" in lopsided.predict(TwistedBeam(twist=-TWISTS[2])).warnings[0]


def test_noisy_values_are_smoothed_and_smooth_ones_are_not():
    rng = np.random.default_rng(3)
    twists = np.linspace(0, 2, 15)
    noisy = model_of(curve(lambda t: 100 * np.exp(0.3 * t + 0.05 * rng.standard_normal()), twists), twists=twists)
    exact = model_of(curve(lambda t: 100 * np.exp(np.sin(2 * t)), twists), twists=twists)
    assert noisy.curves[0].smoothing > 0.0
    assert exact.curves[0].smoothing == 0.0
    between = twists[:-1] + np.diff(twists) / 2
    misses = [noisy.predict(TwistedBeam(twist=float(t))).values["k"] / (100 * np.exp(0.3 * t)) - 1 for t in between]
    assert np.sqrt(np.mean(np.square(misses))) < 0.04


def test_values_that_no_record_told_do_not_count():
    wrong = curve(lambda t: 100.0 if t > 0 else 5000.0, known=(False, *(True,) * 5))
    assert model_of(wrong).predict(TwistedBeam(twist=0.1)).values["k"] == pytest.approx(100.0)


def test_bounds_are_kept():
    low = Curve("k", "N/m", tuple(100 * np.exp(3 * t) for t in TWISTS), (1.0,) * 6, (True,) * 6, 1.0, 15000.0)
    assert model_of(low).predict(TwistedBeam(twist=3.0)).values["k"] == 15000.0


def test_two_design_variables():
    designs = [TwistedBeam(twist=t, thickness=h) for t in (0.0, 0.5, 1.0, 1.5) for h in (0.002, 0.003, 0.004)]

    def truth(beam):
        return 50 * (beam.thickness / 0.003) ** 3 * np.exp(0.3 * beam.twist**2)

    values = tuple(truth(beam) for beam in designs)
    model = learn("t", ("twist", "thickness"), designs, [Curve("k", "N/m", values, values, (True,) * 12, 1e-3, 1e6)])
    new = TwistedBeam(twist=0.8, thickness=0.0025)
    found = model.predict(new)
    assert found.values["k"] == pytest.approx(truth(new), rel=0.05)
    assert found.warnings == ()
    thick = model.predict(TwistedBeam(twist=0.8, thickness=0.005))
    assert thick.warnings[0] == "thickness 5 mm is outside of the designs, 2 mm to 4 mm"


def test_a_corner_that_no_design_reaches_is_said():
    designs = [
        TwistedBeam(twist=t, thickness=h)
        for t, h in ((0, 0.002), (1.0, 0.002), (0, 0.004), (0.3, 0.0025), (0.5, 0.002))
    ]
    values = (1.0, 2.0, 3.0, 1.5, 1.7)
    model = learn("t", ("twist", "thickness"), designs, [Curve("k", "N/m", values, values, (True,) * 5, 1e-3, 1e6)])
    warnings = model.predict(TwistedBeam(twist=0.9, thickness=0.0038)).warnings
    assert warnings[0] == "the design lies between the ranges of the fitted ones, but not among them"


def test_another_specimen_is_said():
    model = model_of(curve(lambda t: 100.0))
    assert model.predict(TwistedBeam(twist=0.5, width=0.025)).warnings == ("width is 0.025, but was 0.02 in the fits",)


def test_json_there_and_back():
    model = model_of(
        curve(lambda t: 100 * np.exp(t), errors=(np.inf, *(1.0,) * 5), symmetry="even"),
        curve(lambda t: 2.0 + t, name="b"),
    )
    again = ParametricModel.from_json(json.loads(json.dumps(model.to_json(), allow_nan=False)))
    for twist in (0.3, 2.5):
        assert again.predict(TwistedBeam(twist=twist)) == model.predict(TwistedBeam(twist=twist))


@pytest.mark.parametrize(
    ("specimens", "message"),
    [
        (beams(TWISTS[:2]), "2 designs are too few over twist: at least 3 are needed"),
        (beams((0.5, 0.5, 0.5)), "twist is 28.6479 deg in all designs: it must vary"),
        (beams((0.0, 0.5, 0.5)), "two designs are the same"),
        ([*beams((0.0, 0.5)), TwistedBeam(twist=1.0, width=0.03)], r"specimens differ in width \(0.02 and 0.03\)"),
    ],
)
def test_wrong_designs_are_refused(specimens, message):
    values = (1.0,) * len(specimens)
    with pytest.raises(ValueError, match=message):
        learn("t", ("twist",), specimens, [Curve("k", "N/m", values, values, (True,) * len(values), 0.1, 10.0)])


# --- from records ---


def stiffness(twist):
    return 150.0 * (1.0 + 0.2 * twist**2)


@pytest.fixture(scope="module")
def learned(bench):
    data = DataSpec(campaign="c", reference="lab", used=["a"])
    spec = ParametricFit(
        model="m", free={"k": None, "c": None, "kt": None}, data=[data], search=Search(method="least-squares", starts=8)
    )
    off, ring = RingDown(duration=0.15, load_place=(0.0, 0.0, 0.01)), RingDown(duration=0.15)

    def target(beam, seed, experiment=off):
        truth = {"k": stiffness(beam.twist), "m": 0.004, "ct": 5e-6}
        return bench.target(f"{beam.twist:.2f}", experiment, specimen=beam, noise=1e-4, seed=seed, **truth)

    # One design has no release off the axis, and so no torsion.
    used = [target(beam, seed, ring if seed == 2 else off) for seed, beam in enumerate(beams())]
    held = [target(beam, 10 + seed) for seed, beam in enumerate(beams(np.deg2rad([30.0, 130.0])))]
    return learn_from(spec, bench.performer, "oscillator", used, held)


def test_designs_between_are_predicted_like_their_own_fit(learned):
    inner = [score for score in learned.left_out if score.inside]
    assert len(inner) == len(TWISTS) - 2
    assert all(abs(score.parameters["k"]) < 0.02 for score in inner)
    assert all(score.error < 2.5 * score.own_error for score in inner)
    assert [score.inside for score in learned.left_out] == [False, True, True, True, True, False]


def test_held_out_designs_are_scored_and_warned_about(learned):
    near, far = learned.targets
    assert near.use == far.use == "held out"
    assert near.error < 0.05
    assert near.note == ""
    assert "twist 130 deg is outside of the designs, 0 deg to 100 deg" in far.note


def test_a_design_without_the_release_does_not_count_for_torsion(learned):
    torsion = next(c for c in learned.model.curves if c.name == "kt")
    assert torsion.known == (True, True, False, True, True, True)
    assert any(note.startswith("kt is not identified at 1 of 6 designs (twist = 0.6981, SI)") for note in learned.notes)
    assert "kt" not in learned.left_out[2].parameters


def test_the_result_is_plain_data(learned):
    data = json.loads(json.dumps(learned.to_json(), allow_nan=False))
    again = ParametricModel.from_json(data["model"])
    assert again.predict(TwistedBeam(twist=0.4)).values["k"] == pytest.approx(stiffness(0.4), rel=0.02)
    assert data["kind"] == "parametric"
    assert len(data["fits"]) == len(data["left_out"]) == 6
