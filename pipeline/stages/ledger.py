"""Stage ``ledger``: every published figure beside the value of the study in hand."""

import math
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from calibrate.spec import Fit, ModulusFit
from lab.experiments import Experiment
from lab.fields import number_at
from lab.ledger import ledger as shipped_ledger
from lab.materials import Frozen
from lab.published import figures
from lab.specimens import Specimen
from lab.specimens.finned_tube import Chambers, LoadFin
from lab.specimens.load_frame import LoadFrame
from pipeline.plan import Plan
from pipeline.stages.compare import groups_of
from pipeline.stages.gather import entries, fit_results
from results.accuracy import IN_SAMPLE, Entry, Row, seconds_per_10_s
from results.fins import published_device
from results.ledger import Finding, evaluate
from results.ledger.fins import fin_facts
from results.ledger.tables import summary, to_csv, to_json, to_markdown, view
from results.ledger.tubes import tube_facts
from results.paddling import saw_thrust
from results.store import write_text
from results.tubes import published_size

#: Published sizes that make a beam the dissertation's; twist and clamp may differ.
_SIZES = {"length": "t5.2-l", "width": "t5.2-w", "thickness": "t5.2-t"}


def ledger(plan: Plan) -> str:
    """Write ``ledger.csv``, ``ledger.json`` and ``ledger.md``; return a line about them."""
    judged = shipped_ledger()
    rows = evaluate(judged, findings(plan), _made_by(plan.study.study))
    write_text(plan.folder / "ledger.csv", to_csv(rows))
    write_text(plan.folder / "ledger.json", to_json(rows, judged.contradictions))
    shown = view(rows, judged.contradictions)
    write_text(plan.folder / "ledger.md", to_markdown(shown))
    return f"{len(rows)} published figures: {summary(shown)}"


def findings(plan: Plan) -> list[Finding]:
    """Numbers of the study about devices of published size, and its inputs."""
    found = [entry for entry in entries(plan) if _answers(plan, entry)]
    places = {(entry.campaign, entry.performer, entry.slug): entry for entry in found}
    rows = [row for _, group in groups_of(plan, found) for row in group]
    return [
        *_inputs(plan),
        *(finding for row in rows for finding in _of_row(plan, places, row)),
        *(finding for entry in found for finding in _of_entry(plan, entry)),
        *(finding for name, result in fit_results(plan).items() for finding in _of_fit(plan, name, result)),
    ]


def is_published(specimen: Specimen) -> bool:
    """Whether a specimen is the beam of table 5.2, whatever its twist: others say nothing about published figures."""
    return specimen.kind == "TwistedBeam" and all(
        math.isclose(getattr(specimen, field), figures()[id]["value"]) for field, id in _SIZES.items()
    )


def _answers(plan: Plan, entry: Entry) -> bool:
    """Whether a record is of a device of the text: of a tube, as it was swept."""
    specimen = entry.record.specimen
    known = published_size(specimen) or published_device(specimen)
    return is_published(plan.study.specimens[entry.specimen]) or bool(known)


def _made_by(study: str) -> str:
    file = Path("config") / f"{study}.yaml"
    return f"./scram run {file}" if file.is_file() else f"./scram run (the study {study})"


def _role(plan: Plan, name: str) -> str:
    """What a performer or a lab table is, see ``lab.ledger.Role``."""
    if name in plan.study.lab:
        return "lab"
    performer = plan.study.performers[name]
    origin: str = getattr(performer, "origin", performer.kind)
    return f"{origin} fitted" if getattr(performer, "fit", None) and origin in ("fea", "prb") else origin


def _facts(entry: Entry) -> dict[str, Any]:
    """What the record says of its model, specimen and experiment that a judgement may ask for."""
    specimen, experiment, how = entry.record.specimen, entry.record.experiment, entry.record.how
    frame = specimen.get("load_frame") or {}
    facts = {
        "topology": how.get("topology"),
        "twist": specimen.get("twist"),
        "tip_mass": specimen.get("tip_mass"),
        "frequency": experiment.get("frequency"),
        "corner": frame.get("corner"),
        "load": frame.get("load"),
    }
    known = {name: value for name, value in facts.items() if value is not None}
    return {**tube_facts(entry), **fin_facts(entry), **known}


def _of_row(plan: Plan, places: Mapping[tuple[str, str, str], Entry], row: Row) -> Iterator[Finding]:
    """A line of the accuracy table; the dissertation's own are what is compared with, not findings."""
    label, _, slug = row.sample.rpartition(": ")
    entry = places.get((row.campaign, row.model, slug))
    if entry is None or row.quantity == "seconds_per_10_s":
        return
    facts = _facts(entry)
    if phi := re.fullmatch(r"phi (\S+) deg", label):
        facts["phi"] = float(phi[1])
    yield Finding(
        row.quantity, row.unit, row.value, row.model, _role(plan, row.model), row.campaign, row.experiment, slug,
        _role(plan, row.reference), row.reference_value, row.use, facts=facts,
        note=f"computed as {slug}" if label else "",
    )  # fmt: skip


def _of_entry(plan: Plan, entry: Entry) -> Iterator[Finding]:
    """Reduced numbers of a record and its cost, about no reference."""
    about = (entry.performer, _role(plan, entry.performer), entry.campaign, entry.experiment.kind, entry.slug)
    for name, scalar in entry.scalars().items():
        use = IN_SAMPLE if saw_thrust(entry, name) else ""
        yield Finding(name, scalar.unit, scalar.value, *about, use=use, facts=_facts(entry))
    if entry.experiment.in_motion:
        yield Finding("seconds_per_10_s", "s", seconds_per_10_s(entry.record), *about, facts=_facts(entry))


def _of_fit(plan: Plan, name: str, result: Mapping[str, Any]) -> Iterator[Finding]:
    """Fitted parameters; about whatever the fit followed."""
    fit = plan.study.fits[name]
    if result["status"] != "completed" or not isinstance(fit, Fit | ModulusFit):
        return
    data = fit.data[0] if isinstance(fit, Fit) else fit
    campaign = plan.study.campaigns[data.campaign]
    if not is_published(plan.study.specimens[campaign.specimen]):
        return
    topology = getattr(plan.study.performers[fit.model], "topology", None)
    facts = {"topology": getattr(topology, "name", topology)} if topology else {}
    for parameter in result["parameters"]:
        yield Finding(
            f"fit.{parameter['name']}", parameter["unit"], parameter["value"], fit.model, _role(plan, fit.model),
            data.campaign, plan.study.experiments[campaign.experiment].kind, against=_role(plan, data.reference),
            error=math.nan if parameter["standard_error"] is None else parameter["standard_error"],
            facts=facts, note=f"fit {name}",
        )  # fmt: skip


def _inputs(plan: Plan) -> Iterator[Finding]:
    """Numbers of the study's specimens, those of the published size first, and experiments."""
    specimens = sorted(plan.study.specimens.items(), key=lambda item: not is_published(item[1]))
    for name, model in [*specimens, *plan.study.experiments.items()]:
        yield from _numbers(name, model)


def _numbers(name: str, model: Specimen | Experiment) -> Iterator[Finding]:
    for field in type(model).model_fields:
        value = getattr(model, field)
        if isinstance(value, LoadFrame):
            yield Finding("LoadFrame.load", "kg", value.load, name)
        elif isinstance(value, Chambers | LoadFin):
            for part in type(value).model_fields:
                number, unit = number_at(value, part)
                yield Finding(f"{type(value).__name__}.{part}", unit, number, name)
        elif isinstance(value, tuple):
            yield Finding(f"{model.kind}.{field}.count", "1", float(len(value)), name)
        elif isinstance(value, int | float) and not isinstance(value, bool) and isinstance(model, Frozen):
            number, unit = number_at(model, field)
            yield Finding(f"{model.kind}.{field}", unit, number, name)
