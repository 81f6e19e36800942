"""Command line: one command per stage, and ``run`` for the whole chain."""

import argparse
import sys
import traceback
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.study import Study, StudyError, load_study

if TYPE_CHECKING:
    from pipeline.plan import Plan

OK, SAMPLE_FAILED, WRONG_INPUT = 0, 1, 2
#: Jobs that a message names.
MOST_NAMED = 10


def main(words: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code (0 done, 1 a sample failed, 2 wrong input or machine)."""
    options = _parser().parse_args(words)
    try:
        return options.run(options)
    except StudyError as error:
        print(error, file=sys.stderr)
        return WRONG_INPUT
    except Exception as error:
        if options.debug:
            traceback.print_exc()
        print(f"{type(error).__name__}: {error}  (--debug shows where)", file=sys.stderr)
        return SAMPLE_FAILED


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m pipeline", description=__doc__)
    parser.add_argument("--debug", action="store_true", help="show tracebacks")
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")

    def add(name: str, run: Callable[[argparse.Namespace], int], text: str, example: str) -> argparse.ArgumentParser:
        command = commands.add_parser(
            name, help=text, description=text, epilog=f"example: python -m pipeline {name} {example}"
        )
        command.set_defaults(run=run)
        return command

    run = add("run", _run, "run a whole study through Snakemake", "config/quick.yaml --cores 2")
    run.add_argument("study", type=Path, nargs="?", default=Path("config/quick.yaml"))
    run.add_argument("--dry-run", action="store_true", help="list the jobs per stage and stop")
    run.add_argument("--cores", type=int, default=None, help="processor cores (default: all)")
    run.add_argument("--profile", default=None, help="Snakemake workflow profile (default: profiles/default)")
    run.add_argument("--retry-failed", action="store_true", help="run samples again that failed or diverged")

    for name, target, example in (
        ("mesh", "mesh", "beam_16x4x2_0ba9cf54 -o beam.msh"),
        ("lab", "sample", "release.lab.single -o sample.vtkhdf"),
        ("fea", "sample", "table.fea-datasheet.twist=90deg -o sample.vtkhdf"),
        ("prb", "sample or batch", "ring-down.prb-published.direction=0deg -o sample.vtkhdf"),
        ("fit", "fit", "modulus -o modulus.json"),
    ):
        stage = add(name, _stage, f"stage {name}: make one {target}", f"config/quick.yaml {example}")
        stage.set_defaults(stage=name)
        stage.add_argument("study", type=Path)
        stage.add_argument("id", help=f"id of the {target}, as `plan` lists them")
        stage.add_argument("-o", "--output", type=Path, help="file to write (default: its place in runs/)")
        if name == "fit":
            stage.add_argument("--threads", type=int, default=1, help="threads for batched roll-outs")

    for name, text in (
        ("check", "check a study file and print it with all defaults, SI"),
        ("plan", "list every job of a study"),
        ("collect", "stage collect: gather all records and fits in study.h5"),
        ("compare", "stage compare: write the accuracy tables"),
        ("ledger", "stage ledger: every published figure beside ours, with a verdict"),
        ("pictures", "stage pictures: draw figures, and scenes where rendering works"),
        ("report", "stage report: write the HTML report"),
        ("show", "print the accuracy table of a finished study"),
    ):
        add(name, _COMMANDS[name], text, "config/quick.yaml").add_argument("study", type=Path)
    carry = add("model", _model, "write a fitted PRB as MJCF for any design", "my.yaml chain --set 'twist=75 deg'")
    carry.add_argument("study", type=Path)
    carry.add_argument("performer", help="PRB performer of the study")
    carry.add_argument("--specimen", default="", help="specimen of the study (default: its only one)")
    carry.add_argument("--set", action="append", default=[], metavar="FIELD=VALUE", help="change of the specimen")
    carry.add_argument("--pinch", default="", metavar="ANGLE", help="of a tube's hinge: pinch angle, as '30 deg'")
    carry.add_argument("--share", type=float, default=1.0, help="of it: 0 open to 1 closed (default: closed)")
    carry.add_argument("-o", "--output", type=Path, default=Path("model.xml"), help="file to write")
    draw = add("cad", _cad, "write a specimen as STEP or STL", "config/pinched_tube.yaml printed -o tube.step")
    draw.add_argument("study", type=Path)
    draw.add_argument("specimen", nargs="?", default="", help="specimen of the study (default: its only one)")
    draw.add_argument("--set", action="append", default=[], metavar="FIELD=VALUE", help="change of the specimen")
    draw.add_argument(
        "--part", default="whole", help="of a tube with fins: whole (default), bare of chambers, or actuator alone"
    )
    draw.add_argument("-o", "--output", type=Path, default=Path("specimen.step"), help="file to write: .step or .stl")
    measure = add("bench", _bench, "run benchmarks and write runs/bench/benchmarks.csv", "tube_pinch")
    measure.add_argument("names", nargs="*", metavar="NAME", help="benchmarks (default: all)")
    measure.add_argument("--list", action="store_true", help="only list their names")
    schema = add("schema", _schema, "print the JSON schema of study files", "> config/study.schema.json")
    schema.set_defaults(study=None)
    return parser


def _run(options: argparse.Namespace) -> int:
    from pipeline.run import run_study

    return run_study(options.study, options.cores, options.profile, options.dry_run, options.retry_failed)


def _plan_of(options: argparse.Namespace) -> "Plan":
    from pipeline.plan import load_plan

    return load_plan(options.study)


def _stage(options: argparse.Namespace) -> int:
    plan = _plan_of(options)
    if options.stage == "prb" and options.id in plan.batches:
        return _batch(options, plan)
    jobs = plan.jobs_of(options.stage)
    if options.id not in jobs:
        known = [*(plan.batches if options.stage == "prb" else ()), *jobs]
        more = f" and {len(known) - MOST_NAMED} more, see plan" if len(known) > MOST_NAMED else ""
        there = ", ".join(known[:MOST_NAMED]) or "none"
        raise StudyError(f"{options.study}: no {options.stage} job {options.id!r}; there is {there}{more}")
    if options.stage == "fea":
        _make_mesh(plan, options.id)
    output = options.output or Path(jobs[options.id].output)
    print(_stage_function(options)(plan, options.id, output))
    return OK


def _make_mesh(plan: "Plan", sample: str) -> None:
    """The mesh of a sample that is done by hand, where it is not there yet; Snakemake has made it before."""
    job = plan.mesh_job(plan.samples[sample])
    if not Path(job.output).exists():
        from pipeline.stages.mesh import mesh

        print(mesh(plan, job.id, Path(job.output)))


def _batch(options: argparse.Namespace, plan: "Plan") -> int:
    from pipeline.stages.perform import perform

    if options.output:
        raise StudyError(f"-o names one record file, and {options.id} is a batch; name one of its samples")
    for job in plan.batches[options.id].jobs:
        print(perform(plan, job.id, Path(job.output)), flush=True)
    return OK


def _stage_function(options: argparse.Namespace) -> Callable[["Plan", str, Path], str]:
    if options.stage == "mesh":
        from pipeline.stages.mesh import mesh

        return mesh
    if options.stage == "fit":
        from pipeline.stages.fit import fit

        return partial(fit, threads=options.threads)
    from pipeline.stages.perform import perform

    return perform


def _model(options: argparse.Namespace) -> int:
    from pipeline.stages.model import model

    plan, pinch = _plan_of(options), (options.pinch, options.share)
    print(model(plan, options.performer, options.specimen, options.set, options.output, *pinch))
    return OK


def _cad(options: argparse.Namespace) -> int:
    from pipeline.stages.cad import cad

    print(cad(load_study(options.study), options.specimen, options.set, options.output, options.part))
    return OK


def _check(options: argparse.Namespace) -> int:
    plan = _plan_of(options)
    print(plan.study.model_dump_json(indent=2))
    print(f"{options.study}: correct; {plan.size()}", file=sys.stderr)
    return OK


def _list(options: argparse.Namespace) -> int:
    plan = _plan_of(options)
    for stage, jobs in plan.jobs.items():
        if stage != "prb":
            for id in jobs:
                print(f"{stage:5s} {id}")
            continue
        for batch in plan.batches.values():
            count = len(batch.jobs)
            print(f"prb   {batch.id}: {count} sample{'s' if count > 1 else ''}")
            for job in batch.jobs:
                print(f"        {job.id}")
    return OK


def _late(name: str) -> Callable[[argparse.Namespace], int]:
    def run(options: argparse.Namespace) -> int:
        from importlib import import_module

        print(getattr(import_module(f"pipeline.stages.{name}"), name)(_plan_of(options)))
        return OK

    return run


def _show(options: argparse.Namespace) -> int:
    from pipeline.run import show_results

    return show_results(_plan_of(options))


def _bench(options: argparse.Namespace) -> int:
    from pipeline.bench import bench, benchmarks

    if options.list:
        print("\n".join(benchmarks()))
        return OK
    return OK if bench(options.names) else SAMPLE_FAILED


def _schema(options: argparse.Namespace) -> int:
    import json

    print(json.dumps(Study.model_json_schema(by_alias=True), indent=1))
    return OK


_COMMANDS = {
    "check": _check,
    "plan": _list,
    "collect": _late("collect"),
    "compare": _late("compare"),
    "ledger": _late("ledger"),
    "pictures": _late("pictures"),
    "report": _late("report"),
    "show": _show,
}
