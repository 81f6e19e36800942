"""What the rules of the ledger ask of a record of a tube with fins."""

import math
from typing import Any

from lab.experiments import FinPush, PaddleThrust, ShapePropagation
from results.accuracy import Entry
from results.fins import flattened_by, is_prototype, published_device
from results.paddling import PLATE, law_of_water
from results.slugs import words

#: Words of a slug that a rule asks for itself; any other makes a sample one of a sensitivity.
_ASKED = frozenset({"fin_arc", "attachment_angle", "travel", "sense", "body", "frequency"})


def fin_facts(entry: Entry) -> dict[str, Any]:
    """Facts of a record of a tube with fins; empty for any other."""
    experiment, record = entry.experiment, entry.record
    if not isinstance(experiment, ShapePropagation | FinPush | PaddleThrust):
        return {}
    facts = {
        "size": published_device(record.specimen),
        "prototype": is_prototype(record.specimen),
        "swept": len(words(entry.slug).keys() - _ASKED) + (law_of_water(entry) != PLATE),
        "fin_arc": record.specimen["fin_arc"],
        "attachment_angle": record.specimen["attachment_angle"],
        "load_fin": record.specimen.get("load_fin") is not None,
        "wall_time": float(record.how.get("wall_time_s", math.nan)),
        "fin_pressure": experiment.pressure,
    }
    if isinstance(experiment, PaddleThrust):
        return facts | {"body": experiment.body, "frequency": experiment.frequency}
    reached = flattened_by(record)
    travel = experiment.travel if math.isnan(reached) else reached
    facts |= {"drive": experiment.drive, "fin_travel": travel, "increments": experiment.increments}
    return facts | ({"sense": experiment.sense} if isinstance(experiment, FinPush) else {})
