"""The table of benchmarks; nothing here is about speed."""

import csv

import pytest

from pipeline.bench import COLUMNS, bench, benchmarks, finished, met
from pipeline.cli import main
from pipeline.study import StudyError

QUICK = """
def rows():
    return [
        {"name": "sum", "value": 2.0, "unit": "s", "peer": "slow", "peer_value": 30.0, "ratio": 15.0, "goal": ">= 10"},
        {"name": "memory", "value": 3, "unit": "GB", "peer": "", "peer_value": None, "ratio": None, "goal": "< 2"},
        {"name": "alone", "value": 1.0, "unit": "s", "peer": "it: missing; get it", "goal": ">= 5"},
    ]
"""


@pytest.fixture
def folder(tmp_path):
    # A name of its own for every test: modules are imported once.
    place = tmp_path / f"measures_{tmp_path.name}"
    place.mkdir()
    (place / "quick.py").write_text(QUICK)
    (place / "_tools.py").write_text("")
    (place / "broken.py").write_text("def rows():\n    raise ValueError('no clock')\n")
    return place


def lines(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_rows_become_a_table(folder, tmp_path, capsys):
    assert benchmarks(folder) == ["broken", "quick"]
    assert bench(["quick"], tmp_path / "made" / "b.csv", folder)
    found = lines(tmp_path / "made" / "b.csv")
    assert tuple(found[0]) == COLUMNS
    assert [line["name"] for line in found] == ["quick: sum", "quick: memory", "quick: alone"]
    assert [line["met"] for line in found] == ["yes", "no", ""]
    assert [found[0][c] for c in ("value", "unit", "peer", "peer value", "ratio")] == ["2", "s", "slow", "30", "15"]
    assert found[1]["ratio"] == ""
    assert "quick" in capsys.readouterr().out


def test_a_broken_benchmark_leaves_the_others(folder, tmp_path, capsys):
    assert not bench([], tmp_path / "b.csv", folder)
    assert len(lines(tmp_path / "b.csv")) == 3
    assert "no clock" in capsys.readouterr().err


def test_one_benchmark_replaces_only_its_own_rows(folder, tmp_path):
    table = tmp_path / "b.csv"
    bench(["quick"], table, folder)
    (folder / "other.py").write_text("def rows():\n    return [{'name': 'x', 'value': 1.0}]\n")
    bench(["other"], table, folder)
    bench(["quick"], table, folder)
    assert sorted(line["name"].split(":")[0] for line in lines(table)) == ["other", "quick", "quick", "quick"]


def test_an_unknown_benchmark_is_named(folder, tmp_path):
    with pytest.raises(StudyError, match="no benchmark 'nothing'; there are broken, quick"):
        bench(["nothing"], tmp_path / "b.csv", folder)


def test_the_command_knows_the_projects_benchmarks(capsys):
    assert main(["bench", "--list"]) == 0
    assert {"fea_assembly", "fea_growth", "fea_newton_step", "prb_speed", "tube_pinch"} <= set(
        capsys.readouterr().out.split()
    )
    assert main(["bench", "nothing"]) == 2


@pytest.mark.parametrize(
    ("row", "answer"),
    [
        ({"value": 1.0, "ratio": 4.9, "goal": ">= 5"}, "no"),
        ({"value": 0.1, "ratio": None, "goal": "< 0.2"}, "yes"),
        ({"value": 9.0, "ratio": 4.0, "goal": "value < 10 s"}, "yes"),
        ({"value": 9.0, "ratio": 1.004, "goal": "0.99 to 1.01"}, "yes"),
        ({"value": 9.0, "ratio": 1.014, "goal": "0.99 to 1.01"}, "no"),
        ({"value": 9.0, "ratio": 1.014, "goal": ""}, ""),
        ({"value": 9.0, "peer": "it: missing", "ratio": None, "goal": "< 10"}, ""),
        ({"value": 9.0, "peer": "it: missing", "ratio": None, "goal": "value < 10"}, "yes"),
    ],
)
def test_goals(row, answer):
    assert met(row) == answer
    assert finished("b", {"name": "n", **row})["met"] == answer
