import re

import pytest
import yaml

from pipeline.plan import Plan
from pipeline.stages.report import assumptions
from pipeline.study import check_study
from results.report import Picture, render
from results.tables import Table


@pytest.fixture
def page(tmp_path):
    for name in ("a", "b", "c"):
        (tmp_path / f"{name}.png").write_bytes(name.encode())
    pictures = [
        Picture(tmp_path / "a.png", "axes <of> the orbit", "offset"),
        Picture(tmp_path / "b.png", "every frequency", "offset", folded=True),
        Picture(tmp_path / "c.png", "objective", "fits"),
    ]
    tables = [
        Table("In short", ("model", "error"), (("chain", "3 %"),), ("a note",)),
        Table("every orbit", ("frequency", "error"), (("1 Hz", "5 %"), ("2 Hz", "6 %")), ("its note",), detail=True),
    ]
    holes = [{"sample": f"s{i}", "status": "diverged", "reason": "not steady"} for i in range(40)]
    holes.append({"sample": "alone", "status": "failed", "reason": "no mesh"})
    return render("t", tables, pictures, "", ["nothing"], holes, {"commit": "x"})


def folded(page):
    return re.findall(r"<details>(.*?)</details>", page, re.DOTALL)


def test_tables_for_who_asks_are_folded_with_their_notes(page):
    (table,) = [part for part in folded(page) if "every orbit" in part]
    assert "(2 rows)" in table
    assert "6 %" in table
    assert "its note" in table
    assert not [part for part in folded(page) if "3 %" in part]
    assert "<h2>In short</h2>" in page


def test_pictures_stand_under_their_campaign_and_many_of_a_kind_are_folded(page):
    assert re.findall(r'<h3 id="pictures-([\w-]+)">', page) == ["offset", "fits"]
    assert page.index("axes &lt;of&gt; the orbit") < page.index('id="pictures-fits"') < page.index("objective")
    (picture,) = [part for part in folded(page) if "<img" in part]
    assert "<summary>every frequency</summary>" in picture
    assert page.count("<img") == 3


def test_holes_of_one_reason_are_one_line(page):
    assert "41 samples gave no result" in page
    assert page.count("not steady") == 1
    assert "<summary>40 samples: diverged, not steady</summary>" in page
    assert "<li>s39</li>" in page
    assert "<li>alone: failed, no mesh</li>" in page


STUDY = """
study: assumed
specimens:
  bare: {kind: TwistedBeam}
  framed: {kind: TwistedBeam, load_frame: {width: 50 mm, mass: 12 g}}
experiments:
  weightless: {kind: BaseShake, seen_from: clamp}
  heavy: {kind: BaseShake, own_weight: 180 deg}
  modes: {kind: NaturalModes}
performers: {chain: {kind: prb, topology: gauss-chain}}
campaigns: {}
"""


def test_assumptions_are_those_of_the_study(tmp_path):
    lines = dict(line.split(": ", 1) for line in assumptions(Plan(check_study(yaml.safe_load(STUDY), tmp_path))))
    assert "load frame" not in lines["bare"]
    assert "50 x 40 mm and its mass of 12 g are assumed" in lines["framed"]
    assert "gravity is left out, the path is seen from the clamp" in lines["weightless"]
    assert "gravity acts on the beam" in lines["heavy"]
    assert "K'" not in lines["modes"]
