"""The worked example and the page that explains it."""

import re
from pathlib import Path

import numpy as np
import pytest
import yaml

import prb
from lab.experiments import RingDown
from lab.specimens import TwistedBeam
from prb.declaration import checked, read_declaration
from prb.model import PrbModel
from prb.topologies import TOPOLOGIES

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "prb.md").read_text(encoding="utf-8")


def test_the_example_is_a_model_that_moves():
    model = PrbModel.model_validate({"topology": "two_hinge_model.yaml"}, context={"beside": ROOT / "examples"})
    record = prb.perform(TwistedBeam(tip_mass=0.01), RingDown(duration=0.05), model)
    assert record.completed
    assert len(model.mechanism(TwistedBeam()).hinges) == 6


def test_the_two_limbs_of_the_example_meet_the_tip():
    declared = read_declaration(ROOT / "examples" / "two_hinge_model.yaml")
    beam = TwistedBeam()
    for first in (0.005, 0.02):
        mechanism = declared.build(beam, declared.values(beam, {"first": first}))
        assert [link.length for link in mechanism.links] == pytest.approx([first, 0.05 - 2 * first, first])
        assert sum(link.mass for link in mechanism.links) == pytest.approx(beam.beam_mass)
        angles = [np.arctan2(h.axis[2], h.axis[1]) for h in mechanism.hinges if h.name.startswith("soft")]
        assert angles == pytest.approx([beam.section_angle(first), beam.section_angle(0.05 - first)])


def test_the_page_s_model_is_sound_and_its_program_runs():
    documents = [text for text in re.findall(r"```yaml\n(.*?)```", PAGE, re.DOTALL) if text.startswith("name:")]
    [model] = [checked(yaml.safe_load(text), "docs/prb.md") for text in documents]
    assert model.build(TwistedBeam(), model.values(TwistedBeam(), {})).hinges[0].stiffness == 0.34
    [program] = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    printed: list[object] = []
    exec(program, {"print": lambda *words: printed.extend(words)})
    assert printed == [(91, 3, 3), {}]


def test_the_page_lists_every_shipped_topology():
    for name, declared in TOPOLOGIES.items():
        [row] = [line for line in PAGE.splitlines() if line.startswith("|") and f"`{name}`" in line.split("|")[1]][:1]
        for parameter in declared.names:
            assert re.search(rf"\b{parameter}\b", row), (name, parameter)
