"""What a study may write about a fit."""

import subprocess
import sys

import pytest
from pydantic import ValidationError

from calibrate.spec import DataSpec, Fit, ModulusFit, ParametricFit, ReadingsFit, SelectionFit
from lab.units import WRITTEN_BY_HAND

DATA = {"campaign": "ring-down", "reference": "fea", "used": ["single"]}
FIT = {"model": "prb", "free": {"k": None}, "data": [DATA]}


def test_null_bounds_and_bounds_with_units():
    free = {"k": None, "l2": ["10 mm", "40 mm"]}
    spec = Fit.model_validate({**FIT, "free": free}, context=WRITTEN_BY_HAND)
    assert spec.free == {"k": None, "l2": ("10 mm", "40 mm")}
    assert Fit.model_validate_json(spec.model_dump_json()) == spec


def test_a_bare_bound_is_refused_where_a_person_writes():
    with pytest.raises(ValidationError, match="bound 0.01 of l2 has no unit"):
        Fit.model_validate({**FIT, "free": {"l2": [0.01, 0.04]}}, context=WRITTEN_BY_HAND)
    with pytest.raises(ValidationError, match="bound 1 of release_time has no unit"):
        DataSpec.model_validate({**DATA, "nuisances": {"release_time": [1, 2]}}, context=WRITTEN_BY_HAND)


def test_a_gain_has_no_unit():
    data = {**DATA, "nuisances": {"gain": [0.9, 1.1]}, "window": ["0 s", "100 ms"], "noise": "0.1 mm"}
    read = DataSpec.model_validate(data, context=WRITTEN_BY_HAND)
    assert read.nuisances == {"gain": (0.9, 1.1)}
    assert read.window == (0.0, 0.1)
    assert read.noise == pytest.approx(1e-4)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"held_out": ["single"]}, "single cannot be both used and held out"),
        (
            {"nuisances": {"delay": None}},
            "no nuisance 'delay'; there is release_time, offset, gain and experiment.PATH",
        ),
        ({"window": (0.2, 0.1)}, "window from 0.2 s to 0.1 s is empty"),
        ({"shared": ["gain"]}, "shared: 'gain' must be one of the nuisances"),
        ({"weight": 0}, "greater than 0"),
    ],
)
def test_wrong_data_is_refused(change, message):
    with pytest.raises(ValidationError, match=message):
        DataSpec.model_validate({**DATA, **change})


def test_a_record_is_used_or_held_out_over_all_data():
    other = {**DATA, "used": [], "held_out": ["single"]}
    with pytest.raises(ValidationError, match="single cannot be both used and held out"):
        Fit.model_validate({**FIT, "data": [DATA, other]})
    assert Fit.model_validate({**FIT, "data": [DATA, {**other, "campaign": "shakes"}]})


def test_something_must_be_used():
    with pytest.raises(ValidationError, match="no record is used"):
        Fit.model_validate({**FIT, "data": [{**DATA, "used": [], "held_out": ["single"]}]})


@pytest.mark.parametrize("kind", [ModulusFit, ReadingsFit])
def test_entries_must_be_of_k_prime(kind):
    with pytest.raises(ValidationError, match="no entry 'k_xx' in K'; there is k_yy, k_yz"):
        kind(model="fea", campaign="table", reference="t", used=["0 deg"], entries=["k_xx"])


def test_selections_and_parametric_fits():
    with pytest.raises(ValidationError, match="a named more than once"):
        SelectionFit(fits=["a", "a"])
    assert ParametricFit.model_validate({**FIT, "kind": "parametric", "symmetry": {"k": "even"}}).design == ["twist"]
    with pytest.raises(ValidationError, match="symmetry of b, which is not free"):
        ParametricFit.model_validate({**FIT, "kind": "parametric", "symmetry": {"b": "even"}})
    with pytest.raises(ValidationError, match="symmetry needs one design variable"):
        ParametricFit.model_validate(
            {**FIT, "kind": "parametric", "symmetry": {"k": "even"}, "design": ["twist", "thickness"]}
        )


def test_reading_a_study_stays_light():
    code = "import sys, calibrate.spec; assert not {'mujoco', 'scipy', 'skfem', 'pint'} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)
