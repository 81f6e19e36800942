"""Which of several fitted models to take, and how far their answers differ.

A fit's own interval takes its model for true.  Models with other joints, each fitted to the same records, show how
much of a quantity is the model's choice: the spread over topologies, beside the interval of each.
"""

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from calibrate.fitting import score
from calibrate.objective import Objective, Problem
from calibrate.performers import Performer, performer_of
from calibrate.result import plain
from calibrate.search import polish
from calibrate.spread import Candidate, Spread, spreads_of
from calibrate.targets import Target
from lab.measures import TRACKING_ERROR_DEFINITION

__all__ = ["Candidate", "Ranked", "Selection", "Spread", "rank", "select"]

#: Models whose score is within this factor of the best one's count as candidates for the truth.
CREDIBLE = 2.0


@dataclass(frozen=True)
class Ranked:
    """A candidate with its scores.

    Parameters
    ----------
    in_sample, held_out, left_out
        Root mean square over records of the relative errors: those that the fit used, those that it did not,
        and, refitted without each used one in turn, that one.  NaN where there are none.
    in_sample_rms, held_out_rms
        The same in m (eq. 5.13), markers only.
    parameters
        How many were free.
    credible
        Whether the score by which it is ranked is within a factor of 2 of the best.
    """

    name: str
    parameters: int
    in_sample: float
    held_out: float
    left_out: float
    in_sample_rms: float
    held_out_rms: float
    credible: bool = True


@dataclass(frozen=True)
class Selection:
    """Candidates, the best one first, with the spread of their answers."""

    by: str
    ranked: tuple[Ranked, ...]
    spreads: tuple[Spread, ...]
    notes: tuple[str, ...]

    def to_json(self) -> dict[str, Any]:
        """Plain JSON data; null stands for NaN and infinity."""
        return plain({"kind": "selection", "chosen": self.ranked[0].name, **asdict(self)})


def select(
    candidates: Sequence[Candidate],
    used: Sequence[Target],
    held_out: Sequence[Target] = (),
    *,
    leave_one_out: bool = False,
    threads: int = 1,
) -> Selection:
    """Rank fits of the same records by what they have not seen.

    Parameters
    ----------
    used, held_out
        The records of the fits.
    leave_one_out
        Rank by refits that leave out one used record each; else by the held-out records.

    Raises
    ------
    ValueError
        When the fits are of different records, or there is nothing to rank them by.
    """
    _same_records(candidates, used, held_out)
    if leave_one_out and len(used) < 2:
        raise ValueError("leaving one record out needs at least two used records; there is one")
    if not leave_one_out and not held_out:
        raise ValueError("nothing is held out: name held-out records, or rank by leave_one_out")
    performers = [performer_of(candidate.model, threads) for candidate in candidates]
    ranked = []
    for candidate, performer in zip(candidates, performers, strict=True):
        left = left_out_error(candidate, performer, used) if leave_one_out else float("nan")
        ranked.append(_ranked(candidate, left))
    key = "left_out" if leave_one_out else "held_out"
    ranked = rank(ranked, key)
    credible = {r.name for r in ranked if r.credible}
    spreads = spreads_of(candidates, performers, used[0].specimen, held_out, credible)
    by = "leave-one-record-out" if leave_one_out else "held-out"
    return Selection(by, tuple(ranked), tuple(spreads), tuple(_notes(by, key, ranked, spreads)))


def rank(ranked: Sequence[Ranked], key: str) -> list[Ranked]:
    """Sorted by a score, those without one last, and marked credible."""
    in_order = sorted(ranked, key=lambda r: math.inf if math.isnan(getattr(r, key)) else getattr(r, key))
    best = getattr(in_order[0], key)
    return [replace(r, credible=bool(getattr(r, key) <= CREDIBLE * best)) for r in in_order]


def _notes(by: str, key: str, ranked: Sequence[Ranked], spreads: Sequence[Spread]) -> list[str]:
    best = ranked[0]
    notes = [f"Chosen by the {by} error: {best.name} ({getattr(best, key):.2%})."]
    if best.in_sample > 0.0 and getattr(best, key) > 2.0 * best.in_sample:
        ratio = getattr(best, key) / best.in_sample
        notes.append(f"Its {by} error is {ratio:.1f} times the one in sample: more records may change the choice.")
    notes += [sentence for spread in spreads if (sentence := spread.sentence())]
    notes.append(
        f"Spread: half the distance between the extreme values of the models whose {by} error is within "
        f"a factor of {CREDIBLE:g} of the best one's; intervals: 95 %, each taking its model for true."
    )
    return [*notes, TRACKING_ERROR_DEFINITION]


def _same_records(candidates: Sequence[Candidate], used: Sequence[Target], held_out: Sequence[Target]) -> None:
    if len(candidates) < 2:
        raise ValueError("a selection needs at least two fits")
    wanted = {(t.name, "in sample") for t in used} | {(t.name, "held out") for t in held_out}
    for candidate in candidates:
        there = {(t["name"], t["use"]) for t in candidate.result["targets"]}
        if there != wanted:
            name, use = sorted(there ^ wanted)[0]
            raise ValueError(f"fit {candidate.name} is of other records: {name} ({use}) is not in all of them")


def _ranked(candidate: Candidate, left_out: float) -> Ranked:
    targets, figures = candidate.result["targets"], []
    for key in ("error", "rms"):
        for use in ("in sample", "held out"):
            figures.append(_mean_square([t[key] for t in targets if t["use"] == use], holes=key == "rms"))
    return Ranked(
        candidate.name, len(candidate.result["parameters"]), figures[0], figures[1], left_out, figures[2], figures[3]
    )


def _mean_square(values: Sequence[float | None], holes: bool) -> float:
    """Root mean square; a hole makes it NaN unless ``holes`` are to be left out."""
    there = [float(value) for value in values if value is not None]
    if not there or (len(there) < len(values) and not holes):
        return float("nan")
    return float(np.sqrt(np.mean(np.square(there))))


def left_out_error(candidate: Candidate, performer: Performer, used: Sequence[Target]) -> float:
    """Root mean square of the errors on each used record after a refit to the others, begun at the fit's values."""
    errors: list[float | None] = []
    values = candidate.values()
    objective: Objective = candidate.spec.objective
    for number, left in enumerate(used):
        others = [t for i, t in enumerate(used) if i != number]
        problem = Problem(performer, others, objective, candidate.spec.free)
        given = np.array([values.get(c.name, c.nominal) for c in problem.space.coordinates])
        start = problem.space.place(given)
        first = problem.residuals(start[None])[0]
        if not np.isfinite(first).all():
            return float("nan")
        unit, _ = polish(problem, start, first)
        refitted = dict(zip(problem.free, problem.space.values(unit).tolist(), strict=False))
        error = score(performer, left, refitted).error
        errors.append(None if math.isnan(error) else error)
    return _mean_square(errors, holes=False)
