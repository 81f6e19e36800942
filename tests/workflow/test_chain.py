"""The whole chain on the tiny study, through Snakemake, as a user runs it."""

import csv
import json
import os
import re
import signal
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
import yaml

from results.collection import read_study
from results.store import read_record

ROOT = Path(__file__).resolve().parents[2]
TINY = yaml.safe_load((ROOT / "config" / "tiny.yaml").read_text(encoding="utf-8"))


class Bench:
    """A study of its own in a temporary place."""

    def __init__(self, folder: Path) -> None:
        self.runs, self.config, self.study = folder / "runs", folder / "tiny.yaml", yaml.safe_load(yaml.safe_dump(TINY))
        self.save()

    def save(self) -> None:
        self.config.write_text(yaml.safe_dump(self.study), encoding="utf-8")

    def start(self, *words: str) -> subprocess.Popen:
        environment = {**os.environ, "SCRAM_RUNS": str(self.runs), "PYTHONPATH": str(ROOT)}
        command = [sys.executable, "-m", "pipeline", "run", str(self.config), "--cores", "2", *words]
        return subprocess.Popen(
            command,
            cwd=ROOT,
            env=environment,
            text=True,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )

    def run(self, *words: str) -> tuple[int, str]:
        process = self.start(*words)
        said, _ = process.communicate(timeout=600)
        return process.returncode, said

    def planned(self) -> dict[str, int]:
        """Jobs per stage that a run would do."""
        code, said = self.run("--dry-run")
        assert code == 0, said
        counts: Counter[str] = Counter()
        for stage, count in re.findall(r"^ ?(\w+)(?: \S+)?\s+(\d+) *$", said, re.MULTILINE):  # prb CAMPAIGN.PERFORMER
            counts[stage] += int(count)
        del counts["total"]
        return dict(counts)

    @property
    def folder(self) -> Path:
        return self.runs / "tiny"


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    made = Bench(tmp_path_factory.mktemp("chain"))
    made.code, made.said = made.run()
    return made


def test_one_command_gives_the_table_and_says_where_all_is(bench):
    assert bench.code == 0, bench.said
    assert "k_yy [N/m]" in bench.said
    for name in (
        "report.html",
        "accuracy.csv",
        "accuracy.md",
        "ledger.csv",
        "study.h5",
        "pictures/index.json",
        "mjcf/five-hinge.xml",
    ):
        assert (bench.folder / name).stat().st_size > 0
        assert name.split("/")[0] in bench.said


def test_the_tidy_table(bench):
    with open(bench.folder / "accuracy.csv", encoding="utf-8", newline="") as handle:
        rows = list(csv.DictReader(handle))
    assert {"lab", "fea", "prb"} >= {row["origin"] for row in rows} >= {"fea", "prb"}
    assert len([r for r in rows if r["campaign"] == "table" and r["model"] == "fea"]) == 2 * 9
    seen = {(r["model"], r["sample"].split(":")[0]): r["use"] for r in rows if r["campaign"] == "table"}
    assert seen["fea", "phi 0 deg"] == "not fitted"
    assert seen["fea-calibrated", "phi 0 deg"] == "in sample"
    assert seen["fea-calibrated", "phi 90 deg"] == "held out"
    unsupported = [r for r in rows if r["campaign"] == "table" and r["model"] == "prb-published"]
    assert all(r["value"] == "" and "rank of the tip compliance" in r["note"] for r in unsupported)


def test_calibration_scales_the_whole_record(bench):
    """Displacement control at fixed Poisson ratio: K' of the calibrated FEA is E / E0 times the other."""
    modulus = json.loads((bench.folder / "fits/modulus.json").read_text())["parameters"][0]["value"]
    plain, calibrated = (
        read_record(bench.folder / f"fea/table.{name}.twist=90deg.vtkhdf") for name in ("fea", "fea-calibrated")
    )
    assert np.allclose(calibrated["wrench"], plain["wrench"] * modulus / 26e6, rtol=1e-5, atol=1e-6)


def test_study_file_opens_everywhere(bench):
    summary = read_study(bench.folder / "study.h5")
    assert set(summary.status.values) == {"completed", "unsupported"}
    assert summary.specimen_twist.attrs["units"] == "rad"
    assert np.isfinite(summary.k_yy.sel(sample="table.fea.twist=90deg"))
    with xr.open_dataset(bench.folder / "study.h5", engine="h5netcdf", group="campaigns/ring-down") as headline:
        assert headline.markers.dims == ("sample", "time", "marker", "axis")
    with xr.open_dataset(bench.folder / "study.h5", engine="h5netcdf", group="fits/five-hinge") as found:
        assert dict(zip(found.parameter.values, found.unit.values, strict=True)) == {"k": "N*m/rad", "b": "N*m*s/rad"}
        assert found.correlation.dims == ("parameter", "other_parameter")
        assert "<mujoco" in str(found.mjcf.values)


def test_the_fitted_model_is_carried_as_mjcf(bench):
    import mujoco

    model = mujoco.MjModel.from_xml_path(str(bench.folder / "mjcf/five-hinge.xml"))
    assert model.njnt == 5


def test_a_second_run_does_nothing(bench):
    assert bench.planned() == {}
    before = {path: path.stat().st_mtime_ns for path in bench.folder.rglob("*.vtkhdf")}
    code, said = bench.run()
    assert code == 0
    assert "Nothing to be done" in said
    assert before == {path: path.stat().st_mtime_ns for path in bench.folder.rglob("*.vtkhdf")}


def test_a_changed_twist_reruns_only_its_jobs(bench):
    bench.study["campaigns"]["table"]["sweep"] = {"specimen.twist": ["0 deg", "45 deg"]}
    bench.save()
    try:
        planned = bench.planned()
    finally:
        bench.study = yaml.safe_load(yaml.safe_dump(TINY))
        bench.save()
    ends = {"collect": 1, "compare": 1, "ledger": 1, "pictures": 1, "report": 1, "all": 1}
    assert planned == {"mesh": 1, "fea": 2, "prb": 1, **ends}


def test_an_edited_kernel_reruns_what_it_touches(bench, monkeypatch):
    from pipeline import plan

    before = plan.load_plan(bench.folder / "plan.json").jobs
    monkeypatch.setattr(plan, "source_hash", lambda *names: "edited" if "fea" in names else "same")
    after = plan.load_plan(bench.folder / "plan.json").jobs
    assert all(job.params["source"] == "edited" for job in after["fea"].values())
    assert all(job.params["source"] == "same" for stage in ("mesh", "prb", "fit") for job in after[stage].values())
    assert all(job.params["source"] not in ("edited", "same") for job in before["fea"].values())


def test_a_lost_record_runs_its_batch_again(bench):
    (bench.folder / "prb/table.prb-published.twist=0deg.vtkhdf").unlink()
    ends = {"collect": 1, "compare": 1, "ledger": 1, "pictures": 1, "report": 1, "all": 1}
    assert bench.planned() == {"prb": 1, **ends}
    kept = bench.folder / "prb/ring-down.prb-published.direction=0deg.vtkhdf"
    before = kept.stat().st_mtime_ns
    assert bench.run()[0] == 0
    assert bench.planned() == {}
    assert kept.stat().st_mtime_ns == before


def test_the_report_shows_tables_and_pictures(bench):
    text = (bench.folder / "report.html").read_text(encoding="utf-8")
    assert text.count("<img") == len(json.loads((bench.folder / "pictures/index.json").read_text())["files"])
    assert "ASSUMED" not in text
    assert "tracking error in % = norm of the difference" in text


def test_a_killed_run_is_completed_by_the_next(tmp_path):
    bench = Bench(tmp_path)
    process = bench.start()
    deadline = time.monotonic() + 120
    while not list(bench.folder.glob("fea/*.vtkhdf")) and time.monotonic() < deadline:
        time.sleep(0.2)
    os.killpg(process.pid, signal.SIGKILL)
    process.communicate()
    assert list(bench.folder.glob("fea/*.vtkhdf"))
    assert not (bench.folder / "report.html").exists()
    code, said = bench.run()
    assert code == 0, said
    assert (bench.folder / "report.html").exists()
    assert not list(bench.folder.rglob("*.tmp*"))


def test_a_failed_sample_is_a_hole_and_not_a_loss(tmp_path):
    bench = Bench(tmp_path)
    bench.study["experiments"]["ring-down"]["load_mass"] = "2000 t"
    del bench.study["fits"]["five-hinge"]
    bench.study["performers"].pop("prb-fitted")
    bench.study["campaigns"]["ring-down"]["performers"] = ["fea"]
    bench.study["campaigns"]["table"]["sweep"] = {"specimen.twist": ["0 deg"]}
    bench.save()
    code, said = bench.run()
    assert code == 1, said
    assert "failed    fea/ring-down.fea.direction=0deg.vtkhdf: diverged" in said
    summary = read_study(bench.folder / "study.h5")
    assert summary.status.sel(sample="ring-down.fea.direction=0deg") == "diverged"
    assert np.isnan(summary.frequency.sel(sample="ring-down.fea.direction=0deg")) if "frequency" in summary else True
    assert np.isfinite(summary.k_yy.sel(sample="table.fea.twist=0deg"))
    assert "diverged" in (bench.folder / "report.html").read_text(encoding="utf-8")
    assert bench.planned() == {}
    kept, failed = (
        bench.folder / f"fea/{name}.vtkhdf" for name in ("table.fea.twist=0deg", "ring-down.fea.direction=0deg")
    )
    before = [file.stat().st_mtime_ns for file in (kept, failed)]
    assert bench.run("--retry-failed")[0] == 1
    assert kept.stat().st_mtime_ns == before[0]
    assert failed.stat().st_mtime_ns > before[1]


def test_two_runs_at_once_are_refused(tmp_path):
    bench = Bench(tmp_path)
    first = bench.start()
    deadline = time.monotonic() + 60
    while not (bench.folder / ".lock").exists() and time.monotonic() < deadline:
        time.sleep(0.05)
    time.sleep(0.5)
    code, said = bench.run("--dry-run")
    os.killpg(first.pid, signal.SIGKILL)
    first.communicate()
    assert code == 2
    assert "another run of this study is still going on" in said
    assert len(said.strip().splitlines()) <= 2


def test_snakemake_refuses_a_wrong_study(tmp_path):
    wrong = tmp_path / "wrong.yaml"
    wrong.write_text(yaml.safe_dump({**TINY, "fitz": 1}), encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-m", "snakemake", "--configfile", str(wrong), "--dry-run"],
        cwd=ROOT,
        capture_output=True,
        text=True,
    )
    assert done.returncode != 0
    assert "fitz: unknown key" in done.stderr + done.stdout


def test_the_snakefile_is_clean():
    done = subprocess.run([sys.executable, "-m", "snakemake", "--lint"], cwd=ROOT, capture_output=True, text=True)
    titles = set(re.findall(r"^ {4}\* (.*):$", done.stderr + done.stdout, re.MULTILINE))
    # One locked environment for all rules stands in for the containers that the linter asks for.
    assert titles == {"Specify a conda environment or container for each rule."}
    formatted = subprocess.run(
        [sys.executable, "-m", "snakefmt", "--check", "Snakefile"], cwd=ROOT, capture_output=True, text=True
    )
    assert formatted.returncode == 0, formatted.stderr
