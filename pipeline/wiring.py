"""What the Snakefile needs: the study it was given, resolved and written down once for all jobs."""

import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pipeline.plan import Plan
from pipeline.study import StudyError, check_study
from results.store import write_text


def resolve(config: dict[str, Any], config_files: Sequence[Any]) -> tuple[Plan, Path]:
    """The plan of a Snakemake config, and the file with all its samples that jobs read.

    Exits with code 2 and one line per fault when the study is wrong, before any job is planned.
    """
    # Jobs run in the environment that runs Snakemake, activated or not.
    os.environ["PATH"] = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])
    beside = Path(config_files[0]).parent if config_files else Path()
    try:
        study = check_study(config, beside, Path(config_files[0]).name if config_files else "config")
        plan = Plan(study)
        _ = plan.batches
    except StudyError as error:
        print(error, file=sys.stderr)
        raise SystemExit(2) from None
    path, text = plan.folder / "plan.json", plan.to_json()
    # Only when it differs: a job may be reading it while Snakemake parses the Snakefile again.
    if not path.is_file() or path.read_text(encoding="utf-8") != text:
        write_text(path, text)
    return plan, path
