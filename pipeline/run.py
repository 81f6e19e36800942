"""The main job: a study through Snakemake, then its tables and where everything lies."""

import fcntl
import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from pipeline.plan import Plan, load_plan
from pipeline.provenance import ROOT
from pipeline.study import StudyError
from results.store import StoreError, read_status


def run_study(path: Path, cores: int | None, profile: str | None, dry_run: bool, retry_failed: bool) -> int:
    """Run the study at ``path`` and print what came out; 0 done, 1 a sample failed, 2 wrong input."""
    path = path.resolve() if path.is_file() else ROOT / path
    plan = load_plan(path)
    size = plan.size()
    os.chdir(ROOT)
    print(f"Study {plan.study.study} ({_shortened(path)}): {size}")
    with _only_run_of(plan.folder) as inherited:
        for left_over in plan.folder.rglob(".*.tmp.*"):  # of a killed job; nobody else is writing now
            left_over.unlink()
        if retry_failed and not dry_run:
            forget_failed(plan)
        command = [sys.executable, "-m", "snakemake", "--snakefile", "Snakefile", "--configfile", str(path), "--nolock"]
        command += ["--cores", str(cores) if cores else "all", *(["--workflow-profile", profile] if profile else [])]
        if dry_run:
            return _list_jobs(command)
        print(f"  {' '.join(['snakemake', *command[3:]])}\n", flush=True)
        start = time.perf_counter()
        done = subprocess.run(command, pass_fds=[inherited])
        print(f"\nworkflow: {time.perf_counter() - start:.0f} s")
    if done.returncode:
        print(f"some jobs did not finish; their words are in {plan.folder}/logs/; run again to go on", file=sys.stderr)
        return 1
    return show_results(plan)


def _shortened(path: Path) -> Path:
    return path.relative_to(ROOT) if path.is_relative_to(ROOT) else path


@contextmanager
def _only_run_of(folder: Path) -> Iterator[int]:
    """Hold the study's lock; the kernel frees it with the last of our processes, so it never goes stale."""
    folder.mkdir(parents=True, exist_ok=True)
    with open(folder / ".lock", "w") as handle:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise StudyError(f"{folder}: another run of this study is still going on; wait for it or end it") from None
        yield handle.fileno()


def forget_failed(plan: Plan) -> None:
    """Delete the records of samples that failed or diverged: their jobs, of PRB samples whole batches, run again."""
    for sample in plan.samples.values():
        file = Path(plan.output(sample))
        if file.is_file() and _status(file) in ("diverged", "failed"):
            file.unlink()


def _status(file: Path) -> str:
    try:
        return read_status(file)
    except StoreError:
        return "not a record"


def _list_jobs(command: list[str]) -> int:
    """Jobs per stage that a run would do, and why, from Snakemake's own dry run."""
    done = subprocess.run([*command, "--dry-run", "--quiet", "rules"], capture_output=True, text=True)
    print(done.stdout + done.stderr)
    return done.returncode


def show_results(plan: Plan) -> int:
    """Print the accuracy tables and where everything lies; 1 when a sample failed."""
    from results.tables import from_json, to_console

    folder = plan.folder
    try:
        tables = from_json((folder / "tables.json").read_text(encoding="utf-8"))
    except OSError:
        raise StudyError(f"{folder}: no tables yet; run the study first") from None
    to_console(tables)
    pictures = json.loads((folder / "pictures" / "index.json").read_text(encoding="utf-8"))
    print(f"\nreport    {folder}/report.html")
    print(f"table     {folder}/accuracy.csv, {folder}/accuracy.md")
    print(f"ledger    {folder}/ledger.csv, {folder}/ledger.md (published figures beside ours)")
    print(f"HDF5      {folder}/study.h5; one file per sample in {folder}/fea/ and {folder}/prb/")
    print(f"models    {folder}/mjcf/")
    print(f"pictures  {folder}/pictures/ ({len(pictures['files'])} files)")
    if pictures["left_out"]:
        print(f"          3D scenes left out: {pictures['left_out']}")
    holes = json.loads((folder / "holes.json").read_text(encoding="utf-8"))
    for hole in holes:
        print(f"failed    {hole['sample']}: {hole['status']}, {hole['reason']}", file=sys.stderr)
    return 1 if holes else 0
