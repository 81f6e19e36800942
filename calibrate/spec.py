"""What a study may choose about a fit."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import Field, ValidationInfo, field_validator, model_validator

from lab.experiments import KPRIME_ENTRIES
from lab.materials import Frozen
from lab.units import Quantity

#: Entries of K' that a Young's modulus can be fitted to: the others vanish by symmetry in every model.
FORCE_ENTRIES: tuple[str, ...] = ("k_yy", "k_yz", "k_zy", "k_zz", "n_xx")
#: Sensor nuisances; ``experiment.PATH`` names any number of the experiment beside them.
SENSOR_NUISANCES: tuple[str, ...] = ("release_time", "offset", "gain")
EXPERIMENT_PREFIX = "experiment."

Bounds = tuple[float | str, float | str]
Second = Annotated[float, Quantity("s", "s")]


def _with_units(value: Any, info: ValidationInfo) -> Any:
    """Bounds as they are, unless a person wrote one of them without its unit."""
    if (info.context or {}).get("units_required") and isinstance(value, dict):
        for name, bounds in value.items():
            for bound in bounds if isinstance(bounds, list | tuple) and name != "gain" else ():
                if not isinstance(bound, str):
                    raise ValueError(f"bound {bound!r} of {name} has no unit; write it like '{bound} ms'")
    return value


class DataSpec(Frozen):
    """Records of one campaign by one performer, and what their sensors may have done to them."""

    campaign: str
    reference: str = Field(description="Performer of the campaign whose records are followed.")
    used: list[str] = Field(default_factory=list, description="Samples that the fit sees.")
    held_out: list[str] = Field(default_factory=list, description="Samples that it does not see.")
    #: Channels or reduced numbers that count; empty: markers of a motion, the forces' entries of K' of a static test,
    #: the frequencies of natural modes.
    quantities: list[str] = Field(default_factory=list)
    weight: float = Field(1.0, gt=0, description="Weight of each of these records beside those of other data.")
    #: Part of the record that counts, on its own clock.
    window: tuple[Second, Second] | None = None
    #: Sensor numbers that are fitted for each record, with bounds; null takes usual ones.  release_time: the
    #: record's clock minus ours; offset: constant per marker and axis; gain; experiment.PATH: a number of the test.
    nuisances: dict[str, Bounds | None] = Field(default_factory=dict)
    shared: list[str] = Field(default_factory=list, description="Nuisances that all these records have in common.")
    #: Standard deviation of the sensor's noise on each coordinate, where it is known.
    noise: Annotated[float, Quantity("m", "mm"), Field(gt=0)] | None = None

    _bounds_have_units = field_validator("nuisances", mode="before")(_with_units)

    @field_validator("held_out")
    @classmethod
    def _was_not_seen(cls, value: list[str], info: ValidationInfo) -> list[str]:
        if seen := sorted(set(value) & set(info.data.get("used", ()))):
            raise ValueError(f"{', '.join(seen)} cannot be both used and held out")
        return value

    @field_validator("window")
    @classmethod
    def _has_a_length(cls, value: tuple[float, float] | None) -> tuple[float, float] | None:
        if value and not value[0] < value[1]:
            raise ValueError(f"window from {value[0]:g} s to {value[1]:g} s is empty; needed: from < to")
        return value

    @field_validator("nuisances")
    @classmethod
    def _nuisances_exist(cls, value: Mapping[str, Any]) -> Mapping[str, Any]:
        for name in value:
            if name not in SENSOR_NUISANCES and not name.startswith(EXPERIMENT_PREFIX):
                known = f"{', '.join(SENSOR_NUISANCES)} and {EXPERIMENT_PREFIX}PATH"
                raise ValueError(f"no nuisance {name!r}; there is {known}")
        return value

    @model_validator(mode="after")
    def _shared_ones_are_searched(self) -> Self:
        for name in self.shared:
            if name not in self.nuisances or name == "offset":
                raise ValueError(f"shared: {name!r} must be one of the nuisances, other than offset")
        return self


class Search(Frozen):
    """How the optimum is looked for."""

    method: Literal["differential-evolution", "least-squares"] = "differential-evolution"
    population: int = Field(15, ge=5, le=200, description="Candidates per generation and free parameter.")
    generations: int = Field(60, ge=1, le=10_000)
    starts: int = Field(24, ge=1, le=10_000, description="Latin hypercube starts of least-squares.")
    polished: int = Field(3, ge=1, le=100, description="Best starts from which least-squares goes on.")
    seed: int = Field(1, ge=0)
    tolerance: float = Field(0.01, gt=0, description="Spread of the objectives at which differential evolution ends.")


class _Fitting(Frozen):
    """What fits of free parameters have in common."""

    model: str = Field(description="Performer whose parameters are fitted.")
    #: Free parameters, each with its bounds as text with units; null takes the model's own.
    free: dict[str, Bounds | None] = Field(min_length=1)
    data: list[DataSpec] = Field(min_length=1)
    objective: Literal["rms", "relative"] = Field(
        "rms", description="rms: eq. 5.13 in metres, markers only; relative: every quantity over its own size."
    )
    search: Search = Search()

    _bounds_have_units = field_validator("free", mode="before")(_with_units)

    @model_validator(mode="after")
    def _records_are_told_apart(self) -> Self:
        used, held = (
            {(item.campaign, item.reference, slug) for item in self.data for slug in getattr(item, key)}
            for key in ("used", "held_out")
        )
        if not used:
            raise ValueError("data: no record is used; name at least one under used")
        if seen := sorted(used & held):
            raise ValueError(f"{', '.join(slug for *_, slug in seen)} cannot be both used and held out")
        return self


class Fit(_Fitting):
    """Fit a performer's parameters to records, jointly."""

    kind: Literal["fit"] = "fit"
    bootstrap: int = Field(0, ge=0, le=10_000, description="Refits to resampled records; 0: none.")
    profile: bool = Field(False, description="Profile likelihood of every parameter.")
    advice: bool = Field(True, description="Look for experiments that would tell more (fast performers only).")


def _known(entries: list[str]) -> list[str]:
    known = [name for name, _ in KPRIME_ENTRIES]
    for entry in entries:
        if entry not in known:
            raise ValueError(f"no entry {entry!r} in K'; there is {', '.join(known)}")
    return entries


class SelectionFit(Frozen):
    """Compare finished fits of the same records: which topology predicts best, and how far their answers differ."""

    kind: Literal["selection"] = "selection"
    fits: list[str] = Field(min_length=2, description="Fits of kind fit, of the same data.")
    leave_one_out: bool = Field(
        False, description="Rank by refits that leave out one used record each; else by the held-out records."
    )

    @field_validator("fits")
    @classmethod
    def _named_once(cls, value: list[str]) -> list[str]:
        if twice := sorted({name for name in value if value.count(name) > 1}):
            raise ValueError(f"{', '.join(twice)} named more than once")
        return value


class ParametricFit(_Fitting):
    """Learn a PRB's parameters as smooth functions of the design, from a fit at each design of a sweep."""

    kind: Literal["parametric"] = "parametric"
    #: Numeric fields of the specimen that span the designs, as twist.
    design: list[str] = Field(default_factory=lambda: ["twist"], min_length=1)
    #: Parameters that are even or odd functions of the (single) design variable, as GJ of the twist.
    symmetry: dict[str, Literal["even", "odd"]] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _symmetry_fits(self) -> Self:
        if self.symmetry and len(self.design) > 1:
            raise ValueError(f"symmetry needs one design variable, not {', '.join(self.design)}")
        if unknown := sorted(set(self.symmetry) - set(self.free)):
            raise ValueError(f"symmetry of {', '.join(unknown)}, which is not free")
        return self


def _whole_records(data: list[DataSpec], kind: str) -> None:
    """Refuse what chooses or corrects parts of a record."""
    for number, item in enumerate(data):
        for name in ("quantities", "window", "nuisances"):
            if getattr(item, name):
                raise ValueError(f"data.{number}.{name}: a {kind} fit has no use for it")


class HingeFit(Frozen):
    """Learn the hinge of a pinched tube over pinch angle and travel from records of ``Pinch`` and ``PinchedBending``.

    Pinches give stiffness, axis and forces along the travel; bendings of the same pinch angles, and of the open tube,
    say how the springs harden.
    """

    kind: Literal["hinge"] = "hinge"
    model: str = Field(description="PRB performer with a topology for a PinchedTube.")
    data: list[DataSpec] = Field(min_length=1)

    @model_validator(mode="after")
    def _a_record_is_used(self) -> Self:
        if not any(item.used for item in self.data):
            raise ValueError("data: no record is used; name at least one under used")
        _whole_records(self.data, "hinge")
        return self


class PaddlerFit(Frozen):
    """Learn a paddling device: its fin from finite elements, its other numbers from the published thrust.

    Records of ``ShapePropagation`` and ``FinPush`` give the fin's turn and its spring; nothing is searched for them.
    ``free`` numbers are searched for the published peaks and means of thrust with and without load fin.  They are far
    more than those few can tell, so the fit goes on to look for other sets that are as good, and says what all share.
    """

    kind: Literal["paddler"] = "paddler"
    model: str = Field(description="PRB performer with the topology paddler.")
    specimen: str = Field("", description="The FinnedTube whose thrust is followed; its load fin is put on and off.")
    data: list[DataSpec] = Field(default_factory=list)
    free: dict[str, Bounds | None] = Field(default_factory=dict)
    follows: Literal["lab", "model"] = Field("lab", description="Thrust of the experiment, or of the published model.")
    buckles: bool = Field(
        False, description="Ask also for what the text says: the load fin makes the fin buckle in recovery, else not."
    )
    mean_weight: float = Field(1.0, gt=0, le=100, description="How many times a mean's misfit counts beside a peak's.")
    sets: int = Field(24, ge=0, le=10_000, description="Further searches, from as many places, for sets as good.")
    tolerance: float = Field(0.05, gt=0, description="Rms misfit over the largest thrust up to which a set is as good.")
    search: Search = Search(population=6, generations=30)

    _bounds_have_units = field_validator("free", mode="before")(_with_units)

    @model_validator(mode="after")
    def _has_something_to_do(self) -> Self:
        if not self.free and not any(item.used for item in self.data):
            raise ValueError("nothing to fit: name records under data.N.used, or free numbers")
        if self.free and not self.specimen:
            raise ValueError("specimen: name the FinnedTube whose thrust the free numbers are searched for")
        _whole_records(self.data, "paddler")
        return self


class ModulusFit(Frozen):
    """Fit the FEA's Young's modulus to rows of a measured stiffness table."""

    kind: Literal["modulus"] = "modulus"
    model: str = Field(description="FEA performer with the uncalibrated material and a rigid rig.")
    campaign: str
    reference: str = Field(description="Lab table.")
    used: list[str] = Field(min_length=1, description="Rows that the fit sees, by their published twist.")
    entries: list[str] = Field(default_factory=lambda: list(FORCE_ENTRIES), min_length=1)

    _entries_exist = field_validator("entries")(_known)


class ReadingsFit(Frozen):
    """Rank the ways of reading a stiffness table that does not say how its beams were clamped."""

    kind: Literal["readings"] = "readings"
    model: str = Field(description="FEA performer with the uncalibrated material.")
    campaign: str = Field(description="Static tests with a rigid rig.")
    compliant_campaign: str | None = Field(None, description="The same with rigs that give way.")
    reference: str = Field(description="Lab table.")
    used: list[str] = Field(default_factory=list, description="Rows by their published twist; empty: all.")
    entries: list[str] = Field(default_factory=lambda: list(FORCE_ENTRIES), min_length=1)

    _entries_exist = field_validator("entries")(_known)
