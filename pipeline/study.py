"""The study file: what is built, tested, computed, fitted and compared.  One YAML file, strictly checked."""

import hashlib
import json
import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal

import yaml
from pydantic import Field, ValidationError, field_validator, model_validator

from calibrate.performers import free_coordinates, performer_of
from calibrate.spec import Fit, HingeFit, ModulusFit, PaddlerFit, ParametricFit, ReadingsFit, SelectionFit
from fea.model import FeaModel
from lab.experiments import Experiment
from lab.materials import Frozen
from lab.published import PREFIX, locate
from lab.recordings import LabModel
from lab.specimens import FinnedTube, Specimen, TwistedBeam
from lab.units import WRITTEN_BY_HAND, to_si
from pipeline.suiting import misfit
from pipeline.sweep import Grid
from prb.model import BESIDE, PrbModel

NAME = re.compile(r"[A-Za-z][A-Za-z0-9-]*")
#: Sections whose entries are of several kinds.
_OF_A_KIND = ("specimens", "experiments", "performers", "fits")
#: Name of the one sample of a campaign without a sweep.
SINGLE = "single"


class StudyError(ValueError):
    """Wrong input, one line per fault."""


class FeaPerformer(FeaModel):
    """FEA, with the material figures that a fit found when ``fit`` names one."""

    fit: str | None = None


class PrbPerformer(PrbModel):
    """PRB model, with the parameters that a fit found when ``fit`` names one."""

    fit: str | None = None


class LabPerformer(LabModel):
    """The lab: recordings in files, read, brought into our axes and checked."""

    def file_of(self, slug: str) -> Path:
        """File of a sample; a single file serves a campaign without a sweep.

        Raises
        ------
        ValueError
            When no file is named for it.
        """
        if slug not in self.files and not (slug == SINGLE and len(self.files) == 1):
            raise ValueError(f"files: none for the sample {slug!r}; there is {', '.join(self.files) or 'none'}")
        return Path(self.files.get(slug) or next(iter(self.files.values())))


Performer = Annotated[FeaPerformer | PrbPerformer | LabPerformer, Field(discriminator="kind")]
AnyFit = Annotated[
    Fit | ModulusFit | ReadingsFit | SelectionFit | ParametricFit | HingeFit | PaddlerFit, Field(discriminator="kind")
]


class Campaign(Frozen):
    """One experiment on one specimen by several performers, over a sweep."""

    specimen: str
    experiment: str
    performers: list[str] = Field(min_length=1)
    #: Grids whose union is swept; keys are ``specimen.X``, ``experiment.X`` or ``performer.X``.
    sweep: list[Grid] = Field(default_factory=list)

    @field_validator("sweep", mode="before")
    @classmethod
    def _one_grid_or_several(cls, value: Any) -> Any:
        return [value] if isinstance(value, dict) else value


class Reading(Frozen):
    """How the rows of a stiffness table are read: ASSUMED, since the text does not say."""

    #: +1: published phi is right-handed about our +x; -1: left-handed.
    twist_sense: Literal[-1, 1] = 1
    #: Published phi of the beams whose clamp was turned, and by how much.
    turned_rows: list[str] = Field(default_factory=list)
    turned_by: str = "0 deg"

    def specimen_angles(self, phi_deg: float) -> tuple[float, float]:
        """Twist and root angle (deg) of the specimen behind the row ``phi_deg``."""
        turned = any(abs(to_si(row, "deg") - phi_deg) < 1e-9 for row in self.turned_rows)
        return self.twist_sense * phi_deg, to_si(self.turned_by, "deg") if turned else 0.0


class LabTable(Frozen):
    """A measured stiffness table and how it is read."""

    file: str
    reading: Reading = Reading()


class Comparison(Frozen):
    """A campaign's numbers against a reference: a lab table, or a performer of the same campaign."""

    campaign: str
    reference: str


class Study(Frozen):
    """A whole study; see ``config/quick.yaml`` for one that uses everything."""

    study: str
    title: str = ""
    specimens: dict[str, Specimen]
    experiments: dict[str, Experiment]
    performers: dict[str, Performer]
    campaigns: dict[str, Campaign]
    lab: dict[str, LabTable] = Field(default_factory=dict)
    fits: dict[str, AnyFit] = Field(default_factory=dict)
    comparisons: list[Comparison] = Field(default_factory=list)

    @model_validator(mode="after")
    def _references_exist(self) -> "Study":
        if faults := list(self._faults()):
            raise ValueError("\n".join(faults))
        return self

    def _faults(self) -> Iterator[str]:
        sections = ("specimens", "experiments", "performers", "campaigns", "lab", "fits")
        names = [("study", self.study), *((s, name) for s in sections for name in getattr(self, s))]
        for section, name in names:
            if not NAME.fullmatch(name):
                yield f"{section}: the name {name!r} must be letters, digits and hyphens, a letter first"
        for name, campaign in self.campaigns.items():
            yield from _missing(f"campaigns.{name}.specimen", [campaign.specimen], self.specimens)
            yield from _missing(f"campaigns.{name}.experiment", [campaign.experiment], self.experiments)
            yield from _missing(f"campaigns.{name}.performers", campaign.performers, self.performers)
            specimen, experiment = self.specimens.get(campaign.specimen), self.experiments.get(campaign.experiment)
            if specimen and experiment and (why := misfit(specimen, experiment)):
                yield f"campaigns.{name}.experiment: {why}"
            for axis in {axis for grid in campaign.sweep for axis in grid}:
                if axis.partition(".")[0] not in ("specimen", "experiment", "performer"):
                    yield f"campaigns.{name}.sweep: {axis!r} must start with specimen., experiment. or performer."
        for name, performer in self.performers.items():
            if not isinstance(performer, LabPerformer):
                yield from _missing(f"performers.{name}.fit", [performer.fit] if performer.fit else [], self.fits)
        for name, fit in self.fits.items():
            yield from self._fit_faults(name, fit)
        for number, comparison in enumerate(self.comparisons):
            yield from _missing(f"comparisons.{number}.campaign", [comparison.campaign], self.campaigns)
            yield from _missing(
                f"comparisons.{number}.reference", [comparison.reference], {**self.lab, **self.performers}
            )
            if comparison.reference in self.lab and comparison.campaign in self.campaigns:
                specimen = self.specimens.get(self.campaigns[comparison.campaign].specimen)
                if specimen is not None and not isinstance(specimen, TwistedBeam):
                    yield (
                        f"comparisons.{number}.reference: {comparison.reference!r} is a table of twisted beams, and "
                        f"{comparison.campaign!r} tests a {specimen.kind}"
                    )

    def _fit_faults(self, name: str, fit: Any) -> Iterator[str]:
        if isinstance(fit, SelectionFit):
            yield from _missing(f"fits.{name}.fits", fit.fits, self.fits)
            for other in fit.fits:
                if other in self.fits and not isinstance(self.fits[other], Fit):
                    yield f"fits.{name}.fits: {other!r} is of kind {self.fits[other].kind}; needed: fit"
            return
        yield from _missing(f"fits.{name}.model", [fit.model], self.performers)
        if isinstance(fit, ModulusFit | ReadingsFit):
            yield from _missing(f"fits.{name}.campaign", [fit.campaign], self.campaigns)
            yield from _missing(f"fits.{name}.reference", [fit.reference], self.lab)
            if isinstance(fit, ReadingsFit) and fit.compliant_campaign:
                yield from _missing(f"fits.{name}.compliant_campaign", [fit.compliant_campaign], self.campaigns)
            return
        for number, item in enumerate(fit.data):
            yield from _missing(f"fits.{name}.data.{number}.campaign", [item.campaign], self.campaigns)
            known = self.performers if isinstance(fit, HingeFit | PaddlerFit) else {**self.performers, **self.lab}
            yield from _missing(f"fits.{name}.data.{number}.reference", [item.reference], known)
        model = self.performers.get(fit.model)
        if isinstance(model, LabPerformer):
            yield f"fits.{name}.model: {fit.model!r} is the lab, which has nothing to fit"
        elif isinstance(fit, HingeFit | PaddlerFit):
            if isinstance(model, FeaPerformer):
                yield f"fits.{name}.model: {fit.model!r} is FEA; a {fit.kind} is fitted for a PRB model"
            elif isinstance(fit, PaddlerFit) and model is not None:
                yield from self._paddler_faults(name, fit, model)
        elif model is not None:
            yield from self._free_faults(name, fit, model)

    def _paddler_faults(self, name: str, fit: PaddlerFit, model: Any) -> Iterator[str]:
        if not fit.specimen:
            return
        yield from _missing(f"fits.{name}.specimen", [fit.specimen], self.specimens)
        device = self.specimens.get(fit.specimen)
        if device is not None and not isinstance(device, FinnedTube):
            yield f"fits.{name}.specimen: {fit.specimen!r} is a {device.kind}; the thrust is that of a FinnedTube"
        elif device is not None and fit.free:
            try:
                free_coordinates(performer_of(model), [device], fit.free)
            except ValueError as error:
                yield f"fits.{name}.free: {error}"

    def _free_faults(self, name: str, fit: Any, model: Any) -> Iterator[str]:
        campaigns = [self.campaigns[item.campaign] for item in fit.data if item.campaign in self.campaigns]
        specimens = [self.specimens[c.specimen] for c in campaigns if c.specimen in self.specimens]
        try:
            free_coordinates(performer_of(model), specimens, fit.free)
        except ValueError as error:
            yield f"fits.{name}.free: {error}"
        if "thickness" in fit.free and isinstance(model, FeaModel) and model.element != "shell":
            yield f"fits.{name}.free: a fitted thickness needs element shell, whose mesh does not depend on it"

    def digest(self) -> str:
        """SHA-256 of the resolved study."""
        return digest(self.model_dump(mode="json"))


def _missing(where: str, names: list[str], known: dict[str, Any]) -> Iterator[str]:
    for name in names:
        if name not in known:
            yield f"{where}: no {name!r}; there is {', '.join(known) or 'none'}"


def digest(data: Any) -> str:
    """SHA-256 of plain data in canonical JSON."""
    return hashlib.sha256(json.dumps(data, sort_keys=True, separators=(",", ":")).encode()).hexdigest()


def load_study(path: Path) -> Study:
    """Read and check a study file, in which every quantity needs its unit.

    Raises
    ------
    StudyError
        One line per fault, each naming the field, the value and what is allowed.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise StudyError(f"{path}: cannot be read ({error.strerror})") from None
    try:
        data = yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise StudyError(f"{path}: not valid YAML: {' '.join(str(error).split())}") from None
    return check_study(data, path.parent, path.name)


def check_study(data: Any, beside: Path, name: str = "study") -> Study:
    """The study in ``data`` as written by hand; lab files are looked for beside it."""
    if not isinstance(data, dict):
        raise StudyError(f"{name}: a study is a mapping of sections, not {type(data).__name__}")
    try:
        study = Study.model_validate(data, context={**WRITTEN_BY_HAND, BESIDE: beside})
    except ValidationError as error:
        raise StudyError("\n".join(f"{name}: {line}" for line in _lines(error))) from None
    try:
        # Absolute, since the resolved study is read from another folder.
        tables = {key: t.model_copy(update={"file": _located(t.file, beside, key)}) for key, t in study.lab.items()}
        performers = {key: _with_files(p, beside, key) for key, p in study.performers.items()}
    except ValueError as error:
        raise StudyError(f"{name}: {error}") from None
    return study.model_copy(update={"lab": tables, "performers": performers})


def _located(file: str, beside: Path, key: str) -> str:
    try:
        path = locate(file, beside)
    except ValueError as error:
        raise ValueError(f"lab.{key}.file: {error}") from None
    return file if file.startswith(PREFIX) else str(path.resolve())


def _with_files(performer: Any, beside: Path, key: str) -> Any:
    """A lab performer with absolute files; ``$NAME`` in them stands for an environment variable."""
    if not isinstance(performer, LabPerformer):
        return performer
    files = {}
    for sample, file in performer.files.items():
        path = beside / os.path.expandvars(file)
        if not path.is_file():
            raise ValueError(f"performers.{key}.files.{sample}: no file {path}")
        files[sample] = str(path.resolve())
    return performer.model_copy(update={"files": files})


def _lines(error: ValidationError) -> Iterator[str]:
    for fault in error.errors():
        place = list(map(str, fault["loc"]))
        if place[:1] and place[0] in _OF_A_KIND:
            del place[2:3]  # the kind, which is not a place in the file
        where = ".".join(place)
        message = fault["msg"].removeprefix("Value error, ").replace("Input should be", "must be")
        if fault["type"] == "extra_forbidden":
            message = "unknown key"
        for line in message.splitlines():
            value = fault["input"]
            shown = f" (is {value!r})" if isinstance(value, int | float | str) and repr(value) not in line else ""
            yield f"{where}: {line}{shown}" if where else line
