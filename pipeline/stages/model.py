"""Command ``model``: a fitted PRB as MJCF for any design, without a new run."""

from collections.abc import Sequence
from pathlib import Path

from lab.fields import changed, shown
from lab.specimens import Specimen
from pipeline.plan import Plan
from pipeline.stages.fit import mjcf_of
from pipeline.stages.perform import completed_result, fitted_prb
from pipeline.study import PrbPerformer, StudyError
from results.store import write_text


def model(plan: Plan, performer: str, specimen: str, changes: Sequence[str], output: Path) -> str:
    """Write the MJCF of ``performer`` for a specimen with changed fields; return what it holds, and every doubt.

    Parameters
    ----------
    specimen
        Name in the study; empty: its only one.
    changes
        As ``twist=75 deg``.

    Raises
    ------
    StudyError
        In one line, for a performer without parameters, an unknown specimen, or a change that does not fit it.
    """
    chosen = plan.study.performers.get(performer)
    if not isinstance(chosen, PrbPerformer):
        known = ", ".join(name for name, p in plan.study.performers.items() if isinstance(p, PrbPerformer))
        raise StudyError(f"no PRB performer {performer!r} in the study; there is {known or 'none'}")
    beam, about = _specimen(plan, specimen, changes)
    warnings: tuple[str, ...] = ()
    if chosen.fit:
        if not Path(plan.fit_output(chosen.fit)).is_file():
            raise StudyError(f"fit {chosen.fit} has not been made yet; run the study first")
        chosen, warnings = fitted_prb(plan, completed_result(plan, chosen.fit), chosen, beam)
    values = chosen.values(beam)
    experiments = [e for c in plan.study.campaigns.values() if (e := plan.study.experiments[c.experiment]).in_motion]
    experiment = experiments[0] if experiments else next(iter(plan.study.experiments.values()))
    write_text(output, mjcf_of(chosen, values, beam, experiment))
    numbers = ", ".join(f"{p.name} {p.show(values[p.name])}" for p in chosen.topology.declare(beam))
    lines = [f"{output}: {chosen.topology.name} for {about}: {numbers}", *(f"doubt: {doubt}" for doubt in warnings)]
    return "\n".join(lines)


def _specimen(plan: Plan, name: str, changes: Sequence[str]) -> tuple[Specimen, str]:
    known = plan.study.specimens
    if not name and len(known) > 1:
        raise StudyError(f"the study has several specimens; name one of {', '.join(known)} with --specimen")
    name = name or next(iter(known))
    if name not in known:
        raise StudyError(f"no specimen {name!r}; there is {', '.join(known)}")
    specimen, said = known[name], []
    for change in changes:
        path, equals, value = change.partition("=")
        if not equals:
            raise StudyError(f"{change!r} is no change; write it like 'twist=75 deg'")
        try:
            specimen = changed(specimen, path.strip(), value.strip())
        except ValueError as error:
            raise StudyError(f"{change!r}: {error}") from None
        said.append(f"{path.strip()} {shown(specimen, path.strip())}")
    return specimen, ", ".join([name, *said])
