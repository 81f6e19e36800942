"""What a study may write about a fit."""

import pytest
from pydantic import ValidationError

from calibrate.spec import ModulusFit, ReadingsFit, TrackingFit
from lab.units import WRITTEN_BY_HAND

TRACKING = {"model": "prb", "campaign": "ring-down", "reference": "fea", "used": ["single"]}


def test_null_bounds_and_bounds_with_units():
    free = {"k": None, "l2": ["10 mm", "40 mm"]}
    spec = TrackingFit.model_validate({**TRACKING, "free": free}, context=WRITTEN_BY_HAND)
    assert spec.free == {"k": None, "l2": ("10 mm", "40 mm")}
    assert TrackingFit.model_validate_json(spec.model_dump_json()) == spec


def test_a_bare_bound_is_refused_where_a_person_writes():
    with pytest.raises(ValidationError, match="bound 0.01 of l2 has no unit"):
        TrackingFit.model_validate({**TRACKING, "free": {"l2": [0.01, 0.04]}}, context=WRITTEN_BY_HAND)


def test_a_record_is_used_or_held_out():
    with pytest.raises(ValidationError, match="single cannot be both used and held out"):
        TrackingFit(**TRACKING, free={"k": None}, held_out=["single"])


@pytest.mark.parametrize("kind", [ModulusFit, ReadingsFit])
def test_entries_must_be_of_k_prime(kind):
    with pytest.raises(ValidationError, match="no entry 'k_xx' in K'; there is k_yy, k_yz"):
        kind(model="fea", campaign="table", reference="t", used=["0 deg"], entries=["k_xx"])
