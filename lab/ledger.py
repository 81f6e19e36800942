"""How every published figure is judged: ``lab/data/ledger.yaml``, read and checked.

A judgement says where our value comes from and when it counts as reproduced; ``results.ledger`` carries it out.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import Field, TypeAdapter, ValidationError, model_validator

from lab.formulas import FORMULAS
from lab.materials import Frozen
from lab.published import DATA, figures
from lab.units import WRITTEN_BY_HAND, Quantity

LEDGER = DATA / "ledger.yaml"
#: What will bring the answers that are not there yet.
Coming = Literal["calibration", "contact and walking"]
#: Kind of a model: its origin, and whether it was fitted to anything.
Role = Literal["lab", "virtual-lab", "fea", "fea fitted", "prb", "prb fitted"]
#: Words by which the notes of the published figures mark what contradicts itself.
MARKS = ("CONTRADICTION", "MIX-UP", "TRAP", "SWAPPED")


class Select(Frozen):
    """Which numbers of a study are ours; lists are in order of preference, empty ones admit all."""

    quantity: str
    experiment: str = ""
    role: tuple[Role, ...] = ()
    against: tuple[Role, ...] = Field((), description="Role of the reference that the number is about.")
    use: tuple[Literal["in sample", "held out", "not fitted"], ...] = ()
    topology: str = Field("", description="Of a PRB model.")


class Tolerance(Frozen):
    """How far ours may be off to count as reproduced, by exactly one measure, and why that far."""

    share: float | None = Field(None, ge=0, description="Of the published value.")
    absolute: float | None = Field(None, ge=0, description="In the figure's unit.")
    table_scatter: Literal[True] | None = Field(None, description="Two deviations of table 5.1's own asymmetry.")
    spread: Literal[True] | None = Field(None, description="Within the range of our own samples.")
    standard_errors: float | None = Field(None, gt=0, description="Of our value, or of the fit that `of` selects.")
    of: Select | None = None
    why: str

    @model_validator(mode="after")
    def _is_one_measure(self) -> Self:
        measures = ("share", "absolute", "table_scatter", "spread", "standard_errors")
        given = [name for name in measures if getattr(self, name) is not None]
        if len(given) != 1:
            raise ValueError(f"a tolerance has exactly one of {', '.join(measures)}, not {', '.join(given) or 'none'}")
        if self.of and self.standard_errors is None:
            raise ValueError("'of' belongs to standard_errors")
        return self


class _Judgement(Frozen):
    #: Published figures, each by its id or several by a pattern with ``*``.
    ids: tuple[str, ...] = Field(min_length=1)
    why: str = ""
    tolerance: Tolerance | None = None
    #: What brings the answer when the study in hand has none; None: another study has it.
    by: Coming | None = None


class Cannot(_Judgement):
    """Nothing that a simulation does could answer it; ``why`` says why."""

    judge: Literal["cannot"] = "cannot"
    why: str = Field(min_length=1)
    #: Our value of the same name where there is one, for the reader only.
    select: Select | None = None


class NotYet(_Judgement):
    """``by`` will answer it, or use it as an input."""

    judge: Literal["not-yet"] = "not-yet"
    by: Coming


class Input(_Judgement):
    """An input of ours: ``where`` says where it stands, ``field`` is looked up in the study."""

    judge: Literal["input"] = "input"
    where: str = Field(min_length=1)
    #: ``KIND.FIELD`` of a specimen or an experiment, ``material:NAME.FIELD``, or ``size:NAME.FIELD`` of a tube.
    field: str = ""
    both_senses: bool = Field(False, description="The field is one sense of a published pair.")
    from_nought: bool = Field(False, description="The field is the upper end of a published range that starts at 0.")


class ClosedForm(_Judgement):
    """A formula over published figures: arithmetic on the text's own, or elementary theory."""

    judge: Literal["closed-form"] = "closed-form"
    formula: str
    tolerance: Tolerance
    basis: Literal["text", "theory"]
    #: What a figure that is published in words or as a formula says in numbers.
    expects: tuple[float, ...] | None = None

    @model_validator(mode="after")
    def _formula_exists(self) -> Self:
        if self.formula not in FORMULAS:
            raise ValueError(f"no formula {self.formula!r}; there is {', '.join(FORMULAS)}")
        return self


class InTable(_Judgement):
    """An entry or a whole matrix of table 5.1, by FEA in the static test; entry and row follow from the figure."""

    judge: Literal["table"] = "table"
    tolerance: Tolerance
    beside: dict[str, str] = Field(default_factory=dict, description="Formulas to show beside, by what to call them.")


class Measured(_Judgement):
    """A number of the study against the published one."""

    judge: Literal["study"] = "study"
    select: Select
    compare: Literal["equal", "at-most", "nonzero"] = "equal"
    tolerance: Tolerance


class Orbit(_Judgement):
    """The shape of the tip's path at the published frequencies of a shaken clamp."""

    judge: Literal["orbit"] = "orbit"
    shape: Literal["oval", "line"]
    #: Smallest (oval) or largest (line) ratio of the minor to the major axis.
    ratio: float = Field(gt=0, lt=1)
    role: tuple[Role, ...]
    twists: tuple[Annotated[float, Quantity("rad", "deg")], ...]


class Observed(_Judgement):
    """What the text observes in words of the tip's path, as a rule that a sweep follows or not."""

    judge: Literal["observed"] = "observed"
    observation: Literal[
        "across-the-axis", "grows-with-twist", "mirrored", "sense-by-chirality", "loaded-more-elliptic",
        "reverses-at-all-corners", "reversal-depends-on-corner",
    ]  # fmt: skip
    role: tuple[Role, ...]
    tolerance: Tolerance


class Tube(_Judgement):
    """What a pinched tube of a published size does, as a rule over a study's pinches, push tests and loads."""

    judge: Literal["tube"] = "tube"
    rule: Literal[
        "force-increase", "transitions", "push-open", "push-closed", "push-ratio", "directions", "recovers",
        "needs-help",
    ]  # fmt: skip
    sizes: tuple[Literal["fea-tube", "printed-tpu", "pet"], ...] = Field(description="In order of preference.")
    role: tuple[Role, ...]
    tolerance: Tolerance
    beside: dict[str, str] = Field(default_factory=dict, description="Formulas to show beside, by what to call them.")


class Fin(_Judgement):
    """What a tube with fins of table 4.1 does, as a rule over a study's pinches, fin pushes and strokes."""

    judge: Literal["fin"] = "fin"
    rule: Literal[
        "alpha-effect", "theta-effect", "run-time", "limit-opposite", "limit-equal", "thrust-max-without",
        "thrust-min-without", "thrust-mean-without", "thrust-max-with", "thrust-min-with", "thrust-mean-with",
        "tip-power-without", "tip-recovery-without", "tip-power-with", "tip-recovery-with", "swim-speed",
    ]  # fmt: skip
    sizes: tuple[Literal["table-4-1"], ...] = ("table-4-1",)
    role: tuple[Role, ...]
    tolerance: Tolerance
    beside: dict[str, str] = Field(default_factory=dict, description="Formulas to show beside, by what to call them.")


Judgement = Annotated[
    Cannot | NotYet | Input | ClosedForm | InTable | Measured | Orbit | Observed | Tube | Fin,
    Field(discriminator="judge"),
]


class Contradiction(Frozen):
    """Where the text disagrees with itself or with mechanics, and how we read it."""

    about: str
    ids: tuple[str, ...] = Field(min_length=1)
    #: What the text says, one line for each place, and what follows from each.
    says: tuple[str, ...] = Field(min_length=2)
    follows: tuple[str, ...]
    reading: str
    because: str

    @model_validator(mode="after")
    def _all_are_followed(self) -> Self:
        if len(self.follows) != len(self.says):
            raise ValueError(f"{len(self.says)} sayings, {len(self.follows)} consequences; needed: one for each")
        return self


@dataclass(frozen=True)
class Ledger:
    """Judgement of every published figure, by its id in the order of the figures, and the contradictions."""

    judgements: Mapping[str, Judgement]
    contradictions: tuple[Contradiction, ...]
    #: Command that brings a kind of answer which the study in hand lacks.
    commands: Mapping[str, str]

    def readings(self, id: str) -> list[Contradiction]:
        """Contradictions that concern a figure."""
        return [item for item in self.contradictions if id in item.ids]


@cache
def ledger() -> Ledger:
    """The ledger that ships with the project."""
    return read_ledger(LEDGER)


def read_ledger(path: Path) -> Ledger:
    """Read and check a ledger: every published figure has exactly one judgement.

    Raises
    ------
    ValueError
        One line per fault, each naming the entry or figure.
    """
    import yaml

    data = yaml.safe_load(path.read_text(encoding="utf-8"))
    if unknown := sorted(set(data) ^ {"tolerances", "commands", "entries", "contradictions"}):
        raise ValueError(f"{path.name}: key {unknown[0]!r} is unknown or missing")
    tolerances = {name: _read(Tolerance, item, f"tolerances.{name}") for name, item in data["tolerances"].items()}
    entries = [
        _read(Judgement, _with_tolerance(item, tolerances, f"entries.{n}"), f"entries.{n}")
        for n, item in enumerate(data["entries"])
    ]
    contradictions = [
        _read(Contradiction, item, f"contradictions.{n}") for n, item in enumerate(data["contradictions"])
    ]
    judgements: dict[str, list[int]] = {id: [] for id in figures()}
    faults = [*_placed(entries, judgements), *_unlisted(contradictions)]
    for id, places in judgements.items():
        if len(places) != 1:
            where = " and ".join(f"entries.{n}" for n in places) or "no entry"
            faults.append(f"figure {id!r} is judged by {where}; needed: exactly one")
    if faults:
        raise ValueError("\n".join(f"{path.name}: {fault}" for fault in faults))
    by_id = {id: entries[places[0]] for id, places in judgements.items()}
    return Ledger(by_id, tuple(contradictions), dict(data["commands"]))


def _with_tolerance(item: Any, tolerances: Mapping[str, Tolerance], where: str) -> Any:
    name = item.get("tolerance")
    if not isinstance(name, str):
        return item
    if name not in tolerances:
        raise ValueError(f"{where}: no tolerance {name!r}; there is {', '.join(tolerances)}")
    return {**item, "tolerance": tolerances[name]}


def _read(kind: Any, item: Any, where: str) -> Any:
    try:
        return TypeAdapter(kind).validate_python(item, context=WRITTEN_BY_HAND)
    except ValidationError as error:
        faults = (f"{'.'.join([where, *map(str, e['loc'])])}: {e['msg']}" for e in error.errors())
        raise ValueError("\n".join(faults)) from None


def _placed(entries: list[Any], judgements: dict[str, list[int]]) -> Iterator[str]:
    """Put the number of each entry beside the figures that it judges; faults are patterns without a figure."""
    for number, entry in enumerate(entries):
        for pattern in entry.ids:
            matched = [id for id in judgements if fnmatchcase(id, pattern)]
            if not matched:
                yield f"entries.{number}: no published figure {pattern!r}"
            for id in matched:
                judgements[id].append(number)


def _unlisted(contradictions: list[Contradiction]) -> Iterator[str]:
    """Contradictions of unknown figures, and figures marked as contradictory that none lists."""
    listed = {id for item in contradictions for id in item.ids}
    for id in sorted(listed - set(figures())):
        yield f"contradictions: no published figure {id!r}"
    for id, figure in figures().items():
        if id not in listed and any(mark in figure.get("consistency_note", "") for mark in MARKS):
            yield f"figure {id!r} contradicts something, by its note; no contradiction lists it"
