"""From a study to jobs: a sample writes its own file, in a job of its own or, where it is quick, in one of many."""

import json
import math
import os
from collections.abc import Hashable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Literal, get_args

from pydantic import TypeAdapter

from calibrate.spec import Fit, HingeFit, ModulusFit, PaddlerFit, ParametricFit, ReadingsFit, SelectionFit
from lab.experiments import Experiment
from lab.fields import changed, shown
from lab.materials import Frozen
from lab.published import PREFIX, StiffnessTable, locate, read_stiffness_table
from lab.recordings import inputs as lab_inputs
from lab.specimens import Specimen, TwistedBeam
from lab.units import to_si
from pipeline.batches import Batch, in_batches
from pipeline.provenance import source_hash
from pipeline.study import SINGLE, FeaPerformer, LabPerformer, Performer, Study, StudyError, digest, load_study
from pipeline.suiting import check_sample
from pipeline.sweep import Value, points
from results.accuracy import Seen
from results.paddling import PUBLISHED, THRUST

Stage = Literal["mesh", "lab", "fea", "prb", "fit"]
#: Where outputs go, from the project's root; SCRAM_RUNS names another place, as a cluster's scratch disk.
RUNS = Path(os.environ.get("SCRAM_RUNS", "runs"))
#: The bench: what every performer of an experiment uses of ``lab``.  The ledger's words, say, are not in it.
_BENCH = (
    "lab.data.materials", "lab.experiments", "lab.fields", "lab.hinge", "lab.materials", "lab.measures", "lab.pinching",
    "lab.records", "lab.requests", "lab.specimens", "lab.units",
)  # fmt: skip
_SENSED = ("calibrate.sensors", "pipeline.stages.sensed")
#: What each stage's answer depends on: packages or modules, by import name.
SOURCES: Mapping[str, tuple[str, ...]] = {
    "mesh": (*_BENCH, "meshes", "pipeline.stages.mesh"),
    "lab": (*_BENCH, "lab.readers", "lab.signals", "lab.recordings", "results.store", "pipeline.stages.perform"),
    "fea": (*_BENCH, "meshes", "fea", *_SENSED, "results.store", "pipeline.stages.perform"),
    "prb": (*_BENCH, "prb", *_SENSED, "results.store", "pipeline.stages.perform"),
    "fit": (
        *_BENCH, "lab.published", "prb", "calibrate", "results.store", "pipeline.stages.fit",
        "pipeline.stages.fit_hinge", "pipeline.stages.fit_paddler", "pipeline.stages.fit_parametric",
        "pipeline.stages.fit_readings", "pipeline.stages.fit_selection",
    ),
}  # fmt: skip
#: What the tables, figures and the report depend on.
READERS = ("lab", "results", "pipeline.stages")
ALL_SOURCES = tuple(dict.fromkeys(name for names in SOURCES.values() for name in names))


@dataclass(frozen=True)
class Sample:
    """One specimen in one experiment by one performer.

    Parameters
    ----------
    campaign, performer
        Names in the study.
    slug
        The swept values as text, shared by all performers of a sample; ``single`` without a sweep.
    specimen, experiment, model
        Resolved inputs.
    """

    campaign: str
    performer: str
    slug: str
    specimen_name: str
    specimen: Specimen
    experiment: Experiment
    model: Performer

    @property
    def id(self) -> str:
        """Name of the sample's job and file."""
        return f"{self.campaign}.{self.performer}.{self.slug}"

    @property
    def stage(self) -> Stage:
        """Stage that performs it."""
        return self.model.kind


#: What samples share, and the names that tell them apart.
_PARTS: Mapping[str, Any] = {"specimen": Specimen, "experiment": Experiment, "model": Performer}
_NAMES = ("campaign", "performer", "slug", "specimen_name")


@dataclass(frozen=True)
class Datum:
    """One record that a fit follows.

    Parameters
    ----------
    item
        Its item in the fit's ``data``.
    used
        Whether the fit sees it; else it is held out.
    label
        Name in the fit's result.
    sample
        Where the record stands; for a row of a lab table, the fitted model's sample that stands for it.
    row
        Published twist of a lab table's row, deg; None for a record of a performer.
    """

    item: int
    used: bool
    label: str
    sample: Sample
    row: float | None


@dataclass(frozen=True)
class Job:
    """One call of a stage.

    Parameters
    ----------
    inputs, output
        Paths from the project's root.
    params
        Everything else that the answer depends on, as plain data.
    """

    stage: Stage
    id: str
    inputs: tuple[str, ...]
    output: str
    params: Mapping[str, Any]


class Plan:
    """All jobs of a study."""

    def __init__(self, study: Study, samples: dict[str, Sample] | None = None) -> None:
        self.study = study
        self.folder = RUNS / study.study
        self._tables: dict[str, StiffnessTable] = {}
        self._swept: dict[Hashable, tuple[Any, dict[str, str]]] = {}
        self._dumps: dict[int, dict[str, Any]] = {}
        if samples is not None:
            self.samples = samples  # takes the place of the cached property

    def to_json(self) -> str:
        """The resolved study with all its samples, SI: what jobs read instead of working it out again."""
        # Samples share specimens, experiments and models, and checking those again is what reading costs.
        places: dict[int, int] = {}
        parts: dict[str, list[Any]] = {part: [] for part in _PARTS}
        samples = []
        for sample in self.samples.values():
            words: dict[str, Any] = {key: getattr(sample, key) for key in _NAMES}
            for part, known in parts.items():
                model = getattr(sample, part)
                if id(model) not in places:
                    places[id(model)] = len(known)
                    known.append(self._dumped(model))
                words[part] = places[id(model)]
            samples.append(words)
        study = self.study.model_dump(mode="json", by_alias=True)
        return json.dumps({"study": study, "parts": parts, "samples": samples}, indent=1)

    @classmethod
    def from_json(cls, text: str) -> "Plan":
        """The plan that ``to_json`` wrote."""
        data = json.loads(text)
        parts = {
            part: [TypeAdapter(kind).validate_python(item) for item in data["parts"][part]]
            for part, kind in _PARTS.items()
        }
        samples = [
            Sample(**{key: words[key] for key in _NAMES}, **{part: found[words[part]] for part, found in parts.items()})
            for words in data["samples"]
        ]
        return cls(Study.model_validate(data["study"]), {sample.id: sample for sample in samples})

    @cached_property
    def samples(self) -> dict[str, Sample]:
        """Samples by id, in the order of the study."""
        found: dict[str, Sample] = {}
        for name, campaign in self.study.campaigns.items():
            for performer in campaign.performers:
                for point in points(campaign.sweep):
                    sample = self._sample(name, performer, point)
                    if sample.id in found:
                        raise StudyError(f"campaigns.{name}.sweep: {sample.slug} stands in it twice")
                    found[sample.id] = sample
        return found

    def _sample(self, campaign: str, performer: str, point: Mapping[str, Value]) -> Sample:
        spec = self.study.campaigns[campaign]
        bench: dict[str, Any] = {
            "specimen": self.study.specimens[spec.specimen],
            "experiment": self.study.experiments[spec.experiment],
            "performer": self.study.performers[performer],
        }
        words: dict[str, str] = {}
        for part, model in bench.items():
            changes = tuple((axis, value) for axis, value in point.items() if axis.partition(".")[0] == part)
            bench[part], said = self._changed(campaign, model, changes)
            words |= said
        text = "_".join(words[axis] for axis in point)
        slug = text.replace("/", "per").replace("^", "").replace("*", "").replace(" ", "") or SINGLE
        try:
            check_sample(bench["specimen"], bench["experiment"], bench["performer"])
        except ValueError as error:
            raise StudyError(f"campaigns.{campaign}: {slug}: {error}") from None
        return Sample(
            campaign, performer, slug, spec.specimen, bench["specimen"], bench["experiment"], bench["performer"]
        )

    def _changed(self, campaign: str, model: Any, changes: tuple[tuple[str, Value], ...]) -> tuple[Any, dict[str, str]]:
        """``model`` with swept values in it, one object for all samples that share them, and each value as text."""
        key = (campaign, id(model), changes)
        if key not in self._swept:
            words = {}
            for axis, value in changes:
                path = axis.partition(".")[2]
                try:
                    model = changed(model, path, value)
                except ValueError as error:
                    raise StudyError(f"campaigns.{campaign}.sweep.{axis}: {error}") from None
                words[axis] = f"{path.rpartition('.')[2]}={shown(model, path)}"
            self._swept[key] = model, words
        return self._swept[key]

    def of_campaign(self, campaign: str, performer: str | None = None) -> list[Sample]:
        """Samples of a campaign, of one performer when it is named."""
        return [s for s in self.samples.values() if s.campaign == campaign and performer in (None, s.performer)]

    @cached_property
    def jobs(self) -> dict[Stage, dict[str, Job]]:
        """Jobs by stage and id; every lab table has been read then, so that a faulty one stops the run first."""
        for name in self.study.lab:
            self.lab_table(name)
        return {stage: self.jobs_of(stage) for stage in get_args(Stage)}

    def jobs_of(self, stage: Stage) -> dict[str, Job]:
        """Jobs of one stage by id: a job needs no other stage's, and those of fits take time to plan."""
        if stage == "fit":
            jobs = [self._fit_job(name) for name in self.study.fits]
        elif stage == "mesh":
            jobs = [self.mesh_job(s) for s in self.samples.values() if isinstance(s.model, FeaPerformer)]
        else:
            jobs = [self._sample_job(s) for s in self.samples.values() if s.stage == stage]
        return {job.id: job for job in jobs}

    @cached_property
    def batches(self) -> dict[str, Batch]:
        """The PRB samples in batches by id: ``CAMPAIGN.PERFORMER``, and ``CAMPAIGN.PERFORMER+2`` and so on.

        A batch is of samples with the same fits behind them and after them.  A longer sweep runs batches again, and
        would else run fits again with them that see nothing of what is new.
        """
        after: dict[str, list[str]] = {}
        for name in self.study.fits:
            for sample in self.fit_samples(name):
                after.setdefault(sample.id, []).append(name)
        jobs = [(self.samples[id], job) for id, job in self.jobs["prb"].items()]
        return in_batches((f"{s.campaign}.{s.performer}", (j.inputs, tuple(after.get(s.id, ()))), j) for s, j in jobs)

    def mesh_job(self, sample: Sample) -> Job:
        """The mesh of an FEA sample; samples with the same geometry share it."""
        if not isinstance(sample.model, FeaPerformer):
            raise TypeError(f"{sample.id} needs no mesh")
        specimen, options = sample.model.applied_to(sample.specimen), sample.model.mesh_for(sample.experiment)
        element = sample.model.element
        counts = [options.along, options.across, *([options.through] if element == "solid" else [])]
        params: dict[str, Any] = {
            "specimen": {"kind": specimen.kind, **specimen.geometry()},
            "element": element,
            "mesh": options.model_dump(exclude=set() if element == "solid" else {"through"}),
        }
        if (part := sample.model.part_for(sample.experiment)) != "whole":
            params["part"] = part
        id = f"{sample.specimen_name}_{element}_{'x'.join(map(str, counts))}_{digest(params)[:8]}"
        return Job("mesh", id, (), str(self.folder / "meshes" / f"{id}.msh"), self._sourced("mesh", params))

    def _sample_job(self, sample: Sample) -> Job:
        inputs = [self.mesh_job(sample).output] if isinstance(sample.model, FeaPerformer) else []
        if isinstance(sample.model, LabPerformer):
            inputs += [str(path) for path in lab_inputs(sample.model, self.lab_file(sample))]
        elif sample.model.fit:
            inputs.append(self.fit_output(sample.model.fit))
        params = {
            "specimen": self._dumped(sample.specimen),
            "experiment": self._dumped(sample.experiment),
            "performer": self._dumped(sample.model),
        }
        return Job(sample.stage, sample.id, tuple(inputs), self.output(sample), self._sourced(sample.stage, params))

    def _dumped(self, model: Frozen) -> dict[str, Any]:
        """A part of samples as plain data, made once: many samples share it, and the study keeps it alive."""
        if id(model) not in self._dumps:
            self._dumps[id(model)] = model.model_dump(mode="json")
        return self._dumps[id(model)]

    def _fit_job(self, name: str) -> Job:
        fit = self.study.fits[name]
        records = [self.output(s) for s in self.fit_samples(name)]
        params: dict[str, Any] = {"fit": fit.model_dump(mode="json")}
        if isinstance(fit, SelectionFit):
            records += [self.fit_output(other) for other in fit.fits]
            models = [self.following(other).model for other in fit.fits]
            params["performers"] = [self.study.performers[model].model_dump(mode="json") for model in models]
        elif isinstance(fit, Fit | ParametricFit | HingeFit | PaddlerFit):
            if isinstance(fit, PaddlerFit) and fit.specimen:
                params["specimen"] = self.study.specimens[fit.specimen].model_dump(mode="json")
            params["performer"] = self.study.performers[fit.model].model_dump(mode="json")
            tables = [item.reference for item in fit.data if item.reference in self.study.lab]
            params["lab"] = [self.study.lab[table].model_dump(mode="json") for table in tables]
            records += self.own_lab_files(*tables) if tables else []
        else:
            params["lab"] = self.study.lab[fit.reference].model_dump(mode="json")
            records += self.own_lab_files(fit.reference)
        own = isinstance(fit, Fit) and isinstance(self.study.performers[fit.model], FeaPerformer)
        sourced = self._sourced("fit", params, *(SOURCES["fea"] if own else ()))
        return Job("fit", name, tuple(dict.fromkeys(records)), self.fit_output(name), sourced)

    def fit_samples(self, name: str) -> list[Sample]:
        """Samples whose records a fit reads."""
        fit = self.study.fits[name]
        if isinstance(fit, SelectionFit):
            return list({s.id: s for other in fit.fits for s in self.fit_samples(other)}.values())
        if isinstance(fit, ModulusFit):
            return self._behind_rows(name, fit)
        if isinstance(fit, ReadingsFit):
            campaigns = [fit.campaign, *([fit.compliant_campaign] if fit.compliant_campaign else [])]
            return [sample for campaign in campaigns for sample in self.of_campaign(campaign, fit.model)]
        return [datum.sample for datum in self.data(name) if datum.row is None]

    def following(self, name: str) -> Fit | ParametricFit | HingeFit | PaddlerFit:
        """A fit that follows records; TypeError for one of another kind."""
        fit = self.study.fits[name]
        if not isinstance(fit, Fit | ParametricFit | HingeFit | PaddlerFit):
            raise TypeError(f"fit {name} of kind {fit.kind} follows no records")
        return fit

    def data(self, name: str) -> list[Datum]:
        """Records that a fit follows, in the order of its data: the used ones, then the held out ones, of each item."""
        found = []
        for number, item in enumerate(self.following(name).data):
            table = item.reference in self.study.lab
            known = self._rows(name, number) if table else self._samples(name, number)
            for key, words in (("used", item.used), ("held_out", item.held_out)):
                for word in words:
                    if word not in known:
                        there = ", ".join(known) or "none"
                        raise StudyError(f"fits.{name}.data.{number}.{key}: no sample {word!r}; there is {there}")
                    row = to_si(word, "deg") if table else None
                    found.append(
                        Datum(number, key == "used", f"{item.campaign}.{item.reference}.{word}", known[word], row)
                    )
        return found

    def _samples(self, name: str, number: int) -> dict[str, Sample]:
        item = self.following(name).data[number]
        return {s.slug: s for s in self.of_campaign(item.campaign, item.reference)}

    def _rows(self, name: str, number: int) -> dict[str, Sample]:
        """Rows of a lab table, as text, with the sample of the fitted model that stands for each."""
        fit = self.following(name)
        item = fit.data[number]
        places = self.rows_of_table(item.reference, item.campaign, fit.model)
        return {f"{phi:g} deg": sample for phi, sample in places.items()}

    def seen(self, name: str) -> frozenset[Seen]:
        """What a fit was given: samples of performers or rows of lab tables, also through fits behind those."""
        fit = self.study.fits[name]
        if isinstance(fit, SelectionFit):
            return frozenset(found for other in fit.fits for found in self.seen(other))
        if isinstance(fit, ModulusFit | ReadingsFit):
            return frozenset((s.campaign, fit.reference, s.slug) for s in self.fit_samples(name))
        found: set[Seen] = set()
        if isinstance(fit, PaddlerFit) and fit.free:
            found.add((PUBLISHED, fit.follows, THRUST))
        for datum in self.data(name):
            item = fit.data[datum.item]
            if datum.used:
                found.add((item.campaign, item.reference, datum.sample.slug))
            behind = self.study.performers.get(item.reference)
            if behind is not None and not isinstance(behind, LabPerformer) and behind.fit:
                found |= self.seen(behind.fit)
        return frozenset(found)

    def _behind_rows(self, name: str, fit: ModulusFit) -> list[Sample]:
        """The sample behind each lab row that a modulus fit uses."""
        places = self.rows_of_table(fit.reference, fit.campaign, fit.model)
        for text in fit.used:
            if to_si(text, "deg") not in places:
                rows = ", ".join(f"{phi:g} deg" for phi in places)
                raise StudyError(
                    f"fits.{name}.used: no row {text!r} with a sample of {fit.campaign} behind it; there is {rows}"
                )
        return [places[to_si(text, "deg")] for text in fit.used]

    def rows_of_table(self, table: str, campaign: str, performer: str) -> dict[float, Sample]:
        """The sample behind each row (published phi, deg) of a lab table, as the study reads it."""
        found: dict[float, Sample] = {}
        for phi in self.lab_table(table).rows:
            angles = [math.radians(angle) for angle in self.study.lab[table].reading.specimen_angles(phi)]
            for sample in self.of_campaign(campaign, performer):
                if not isinstance(sample.specimen, TwistedBeam):
                    continue
                beam = (sample.specimen.twist, sample.specimen.root_angle)
                if all(math.isclose(a, b, abs_tol=1e-9) for a, b in zip(beam, angles, strict=True)):
                    found.setdefault(phi, sample)
        return found

    def lab_table(self, name: str) -> StiffnessTable:
        """A lab table of the study, read from its file once."""
        if name not in self._tables:
            file = self.study.lab[name].file
            try:
                path = locate(file, Path()) if file.startswith(PREFIX) else Path(file)
                self._tables[name] = read_stiffness_table(path)
            except (OSError, ValueError) as error:
                raise StudyError(f"lab.{name}.file: {error}") from None
        return self._tables[name]

    def own_lab_files(self, *names: str) -> list[str]:
        """Files of the named lab tables (of all without names) that do not ship with the project."""
        files = [self.study.lab[name].file for name in names or self.study.lab]
        return [file for file in files if not file.startswith(PREFIX)]

    def lab_file(self, sample: Sample) -> Path:
        """File that a sample of the lab is read from."""
        if not isinstance(sample.model, LabPerformer):
            raise TypeError(f"{sample.id} is not read from a file")
        try:
            return sample.model.file_of(sample.slug)
        except ValueError as error:
            raise StudyError(f"performers.{sample.performer}.{error}") from None

    def output(self, sample: Sample) -> str:
        """Record file of a sample."""
        return str(self.folder / sample.stage / f"{sample.id}.vtkhdf")

    def fit_output(self, name: str) -> str:
        """Result file of a fit."""
        return str(self.folder / "fits" / f"{name}.json")

    def outputs(self, *stages: Stage) -> list[str]:
        """All files of stages."""
        return [job.output for stage in stages for job in self.jobs[stage].values()]

    def size(self) -> str:
        """Number of jobs of each stage, in words."""
        words = [f"{len(jobs)} {stage}" for stage, jobs in self.jobs.items() if jobs and stage != "prb"]
        if self.batches:
            words.append(f"{len(self.jobs['prb'])} prb in {len(self.batches)} jobs")
        return ", ".join(words)

    @cached_property
    def whole(self) -> dict[str, Any]:
        """Params of the jobs that read all records: the study, and the code of all of them, since they share most."""
        return {"study": self.study.model_dump(mode="json"), "source": source_hash(*READERS)}

    def _sourced(self, stage: Stage, params: Mapping[str, Any], *more: str) -> dict[str, Any]:
        return {**params, "source": source_hash(*SOURCES[stage], *more)}


def load_plan(path: Path) -> Plan:
    """Plan of a study file written by hand (YAML), or of a resolved one (JSON).

    Raises
    ------
    StudyError
        One line per fault.
    """
    if path.suffix != ".json":
        return Plan(load_study(path))
    try:
        return Plan.from_json(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise StudyError(f"{path}: cannot be read ({error.strerror})") from None
