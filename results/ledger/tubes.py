"""What the text says of tubes, held against pinches, push tests and loads of tubes of published size."""

from collections.abc import Iterator, Sequence
from typing import Any

from lab.experiments import Pinch, PinchedBending, ShapeRecovery
from lab.ledger import Fin, Tube
from results.accuracy import Entry
from results.ledger.fin_rules import FIN_RULES
from results.ledger.findings import Finding
from results.ledger.tube_rules import RULES, Answer, Case
from results.slugs import words
from results.tubes import published_size

#: Words of a slug that a rule asks for itself; any other makes a sample one of a sensitivity.
_ASKED = frozenset({"pinch_angle", "law", "pinched", "load", "order", "recover"})


def tube_facts(entry: Entry) -> dict[str, Any]:
    """What the rules ask of a record of a tube; empty for any other."""
    experiment = entry.experiment
    if not isinstance(experiment, Pinch | PinchedBending | ShapeRecovery):
        return {}
    facts = {
        "size": published_size(entry.record.specimen),
        "pinch_angle": experiment.pinch_angle,
        "law": experiment.law if experiment.pair_forces is None else "own",
        "swept": len(words(entry.slug).keys() - _ASKED),
    }
    for name in ("pinched", "load", "push", "direction"):
        facts[f"tube_{name}"] = getattr(experiment, name, None)
    return facts


def answers(judgement: Tube | Fin, findings: Sequence[Finding]) -> list[Answer]:
    """Answers of all models, those of preferred sizes and roles first."""
    rule, found = {**RULES, **FIN_RULES}[judgement.rule], []
    for size in judgement.sizes:
        for role in judgement.role:
            cases = list(_cases(findings, size, role))
            for model in dict.fromkeys(case.source.model for case in cases):
                if answer := rule([case for case in cases if case.source.model == model]):
                    found.append(answer)
    return found


def _cases(findings: Sequence[Finding], size: str, role: str) -> Iterator[Case]:
    """Records of tubes of a size by models of a role, those with the fewest swept fields first."""
    groups: dict[tuple[str, str, str], list[Finding]] = {}
    for f in findings:
        if f.facts.get("size") == size and f.role == role and not f.against:
            groups.setdefault((f.campaign, f.model, f.sample), []).append(f)
    for items in sorted(groups.values(), key=lambda items: items[0].facts["swept"]):
        yield Case({f.quantity: f.value for f in items}, items[0].facts, items[0])
