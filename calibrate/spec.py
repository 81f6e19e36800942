"""What a study may choose about a fit."""

from typing import Any, Literal

from pydantic import Field, ValidationInfo, field_validator

from lab.experiments import KPRIME_ENTRIES
from lab.materials import Frozen

#: Entries of K' that a Young's modulus can be fitted to: the others vanish by symmetry in every model.
FORCE_ENTRIES: tuple[str, ...] = ("k_yy", "k_yz", "k_zy", "k_zz", "n_xx")


class TrackingFit(Frozen):
    """Fit a PRB performer's parameters to marker tracks, by eq. 5.13 over all used records jointly."""

    kind: Literal["tracking"] = "tracking"
    model: str = Field(description="PRB performer whose parameters are fitted.")
    #: Free parameters, each with its bounds as text with units; null takes the topology's.
    free: dict[str, tuple[float | str, float | str] | None] = Field(min_length=1)
    campaign: str
    reference: str = Field(description="Performer of the campaign whose records are tracked.")
    used: list[str] = Field(min_length=1, description="Samples that the fit sees.")
    held_out: list[str] = Field(default_factory=list, description="Samples that it does not see.")
    method: Literal["differential-evolution"] = "differential-evolution"
    population: int = Field(15, ge=5, le=200, description="Candidates per generation and free parameter.")
    generations: int = Field(60, ge=1, le=10_000)
    seed: int = Field(1, ge=0)
    tolerance: float = Field(0.01, gt=0, description="Spread of the objectives at which the search ends.")

    @field_validator("free", mode="before")
    @classmethod
    def _bounds_have_units(cls, value: Any, info: ValidationInfo) -> Any:
        if (info.context or {}).get("units_required") and isinstance(value, dict):
            for name, bounds in value.items():
                for bound in bounds if isinstance(bounds, list | tuple) else ():
                    if not isinstance(bound, str):
                        raise ValueError(f"bound {bound!r} of {name} has no unit; write it like '{bound} ms'")
        return value

    @field_validator("held_out")
    @classmethod
    def _was_not_seen(cls, value: list[str], info: ValidationInfo) -> list[str]:
        if seen := sorted(set(value) & set(info.data.get("used", ()))):
            raise ValueError(f"{', '.join(seen)} cannot be both used and held out")
        return value


def _known(entries: list[str]) -> list[str]:
    known = [name for name, _ in KPRIME_ENTRIES]
    for entry in entries:
        if entry not in known:
            raise ValueError(f"no entry {entry!r} in K'; there is {', '.join(known)}")
    return entries


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
