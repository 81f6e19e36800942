import copy

import pytest
import yaml

from lab import experiments, specimens
from lab.fields import number_at
from lab.ledger import LEDGER, MARKS, Input, ledger, read_ledger
from lab.materials import material
from lab.published import figures
from lab.specimens.finned_tube import Chambers, LoadFin
from lab.specimens.load_frame import LoadFrame


@pytest.fixture(scope="module")
def written():
    return yaml.safe_load(LEDGER.read_text(encoding="utf-8"))


@pytest.fixture
def document(written):
    return copy.deepcopy(written)


def refusal(tmp_path, document):
    path = tmp_path / "ledger.yaml"
    path.write_text(yaml.safe_dump(document), encoding="utf-8")
    with pytest.raises(ValueError, match=r"\S") as caught:
        read_ledger(path)
    return str(caught.value)


def place(document, id):
    return next(n for n, entry in enumerate(document["entries"]) if id in entry["ids"])


def test_every_published_figure_has_its_judgement_in_the_order_of_the_figures():
    assert list(ledger().judgements) == list(figures())
    assert len(ledger().judgements) == 220


def test_what_the_figures_mark_as_contradictory_has_our_reading():
    marked = [id for id, f in figures().items() if any(mark in f.get("consistency_note", "") for mark in MARKS)]
    assert len(marked) > 10
    assert all(ledger().readings(id) for id in marked)


def test_inputs_name_fields_that_exist():
    for judgement in ledger().judgements.values():
        if isinstance(judgement, Input) and judgement.field:
            kind, _, field = judgement.field.partition(".")
            if kind.startswith("material:"):
                assert number_at(material(kind.removeprefix("material:")), field)
            elif kind.startswith("size:"):
                tube = specimens.PinchedTube.model_validate({"size": kind.removeprefix("size:")})
                assert number_at(tube, {"diameter": "radius"}.get(field, field))
            else:
                parts = {part.__name__: part for part in (LoadFrame, Chambers, LoadFin)}
                model = parts.get(kind) or getattr(specimens, kind, None) or getattr(experiments, kind)
                assert field.removesuffix(".count") in model.model_fields


def test_a_figure_without_judgement_is_named(tmp_path, document):
    del document["entries"][place(document, "c5-mass")]
    assert "figure 'c5-mass' is judged by no entry; needed: exactly one" in refusal(tmp_path, document)


def test_a_figure_judged_twice_is_named(tmp_path, document):
    document["entries"][0]["ids"].append("t4.1-[L]")
    second = place(document, "t4.1-L")
    assert f"figure 't4.1-L' is judged by entries.0 and entries.{second}" in refusal(tmp_path, document)


def test_an_unknown_figure_is_named(tmp_path, document):
    document["entries"][3]["ids"].append("c9-nothing")
    assert "entries.3: no published figure 'c9-nothing'" in refusal(tmp_path, document)


def test_a_contradiction_that_is_not_listed_is_named(tmp_path, document):
    document["contradictions"] = [c for c in document["contradictions"] if "c5-mass" not in c["ids"]]
    assert "figure 'c5-mass' contradicts something" in refusal(tmp_path, document)


@pytest.mark.parametrize(
    ("id", "change", "words"),
    [
        ("c5-mass", {"formula": "weighing"}, "no formula 'weighing'; there is pinch_spacing, "),
        ("c5-mass", {"tolerance": "generous"}, "no tolerance 'generous'; there is rounding-of-text, table-scatter"),
        ("c5-mass", {"tolerance": {"share": 0.1, "absolute": 1, "why": "x"}}, "not share, absolute"),
        ("c5-mass", {"tolerance": {"share": 0.1}}, "tolerance.why: Field required"),
        ("c5-mass", {"judge": "guess"}, "'cannot', 'not-yet', 'input'"),
        ("c5-cpu", {"why": ""}, "why: String should have at least 1 character"),
        ("c5-h", {"by": "someone"}, "'contact and walking'"),
        ("c5-fea-oval", {"twists": [90]}, "90 has no unit; write it like '90 deg'"),
    ],
)
def test_faults_in_an_entry_are_named(tmp_path, document, id, change, words):
    number = place(document, id)
    document["entries"][number] |= change
    said = refusal(tmp_path, document)
    assert f"entries.{number}" in said
    assert words in said


def test_every_saying_needs_its_consequence(tmp_path, document):
    document["contradictions"][0]["follows"].pop()
    assert "contradictions.0: Value error, 2 sayings, 1 consequences" in refusal(tmp_path, document)


def test_unknown_sections_are_refused(tmp_path, document):
    assert "'remarks' is unknown or missing" in refusal(tmp_path, {**document, "remarks": []})
