"""The lab as a performer: recordings of a user's own experiments become records."""

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, ValidationError, field_validator, model_validator

from lab.experiments import Experiment, RingDown, StaticStiffness
from lab.fields import number_at, quantity_of
from lab.materials import Frozen
from lab.readers import ForceTorqueOptions, ReaderOptions, Recording, read, sidecar_of
from lab.records import Channel, Record, channels
from lab.signals.gaps import refuse_gaps
from lab.signals.steps import Align, Release, Step
from lab.specimens import Specimen
from lab.units import Quantity, from_si, to_si

#: Samples must lie so close to those of the experiment, in shares of its interval.
_ON_TIME = 0.02
#: Largest angle between the recording's down and the experiment's own weight, rad.
_DOWN = np.radians(5.0)


class LabModel(Frozen):
    """Measurements as a performer: files, how they are read, and every step between the file and the record.

    Nothing is done to a recording but what ``steps`` lists, in that order.
    """

    kind: Literal["lab"] = "lab"
    #: ``virtual-lab`` for files that were computed: a computed figure must not pass for a measured one.
    origin: Literal["lab", "virtual-lab"] = "lab"
    reader: ReaderOptions
    files: dict[str, str] = Field(
        default_factory=dict, description="File of each sample; a campaign of one sample may call it anything."
    )
    specimen: str = Field("", description="Name that every file must state; empty: not compared.")
    markers: tuple[str, ...] = Field((), description="Names in the file, in the order of the experiment's markers.")
    #: How much the distances of the markers at rest may differ from those of the experiment's; None: not compared.
    marker_tolerance: Annotated[float, Quantity("m", "mm"), Field(gt=0)] | None = None
    steps: tuple[Step, ...] = ()

    @field_validator("reader", mode="before")
    @classmethod
    def _by_kind(cls, value: Any) -> Any:
        return {"kind": value} if isinstance(value, str) else value

    @model_validator(mode="after")
    def _names_markers_once(self) -> Self:
        if doubled := sorted({name for name in self.markers if self.markers.count(name) > 1}):
            raise ValueError(f"markers: {doubled[0]!r} stands twice")
        if isinstance(self.reader, ForceTorqueOptions) and self.markers:
            raise ValueError("markers: a force-torque file has none")
        return self

    @property
    def needed(self) -> list[str]:
        """Markers that the record or one of the steps needs."""
        names = list(self.markers)
        for step in self.steps:
            names += step.places if isinstance(step, Align) else step.markers if isinstance(step, Release) else ()
        return list(dict.fromkeys(names))


def inputs(model: LabModel, path: Path) -> list[Path]:
    """Every file that a record from ``path`` depends on: itself, its sidecar, and the robot's own file."""
    found = [path]
    if beside := sidecar_of(path):
        found.append(beside)
    if isinstance(model.reader, ForceTorqueOptions):
        from lab.readers.options import with_sidecar

        pose = with_sidecar(model.reader, path).pose
        found += [path.parent / pose.file] if pose and pose.file else []
    return found


def perform(specimen: Specimen, experiment: Experiment, model: LabModel, path: Path) -> Record:
    """Read a recording and bring it to the record that every other performer would hand back.

    Parameters
    ----------
    specimen, experiment
        What was done.
    model
        How the file is read and what is done with it.
    path
        The file.

    Raises
    ------
    ValueError
        One line on what does not fit, naming the file, and row and column where there are any.
    """
    if not isinstance(experiment, RingDown | StaticStiffness):
        raise ValueError(
            f"{path.name}: recordings of {experiment.kind} cannot be read; RingDown and StaticStiffness can"
        )
    if isinstance(experiment, RingDown):
        _check_markers(model, experiment, path)
    recording = read(path, model.reader, model.needed if model.markers else None)
    _check_specimen(recording, specimen, model)
    for step in model.steps:
        recording = step.apply(recording, experiment)
    if isinstance(experiment, RingDown):
        found = _ring_down(recording, experiment, model)
    else:
        found = _static_stiffness(recording, experiment)
    return Record(
        origin=model.origin, model=model.kind, specimen=specimen.model_dump(), experiment=experiment.model_dump(),
        channels=found, how=_how(recording, model, path),
    )  # fmt: skip


def _check_markers(model: LabModel, experiment: RingDown, path: Path) -> None:
    if len(model.markers) != len(experiment.markers):
        raise ValueError(
            f"{path.name}: {len(model.markers)} markers are named ({', '.join(model.markers) or 'none'}), but the "
            f"experiment has {len(experiment.markers)}; name one for each in 'markers'"
        )


def _check_specimen(recording: Recording, specimen: Specimen, model: LabModel) -> None:
    """Refuse a recording of another specimen, as far as the file says which it is."""
    name = recording.source
    if model.specimen and recording.specimen != model.specimen:
        said = f"of {recording.specimen!r}" if recording.specimen else "of a specimen that it does not name"
        raise ValueError(f"{name}: a recording {said}, not of {model.specimen!r} (key 'specimen' of its sidecar)")
    for field, text in recording.declared.items():
        try:
            ours, unit = number_at(specimen, field)
            theirs = to_si(text, unit)
        except ValueError as error:
            raise ValueError(f"{name}: declared {field}: {error}") from None
        if abs(theirs - ours) > 1e-6 * max(abs(ours), abs(theirs)):
            quantity = quantity_of(type(specimen), field)
            shown = (
                f"{from_si(ours, unit, quantity.shown_in):.6g} {quantity.shown_in}"
                if quantity
                else f"{ours:.6g} {unit}"
            )
            raise ValueError(f"{name}: a recording of another specimen: {field} {text}, the study's has {shown}")


def _ring_down(recording: Recording, experiment: RingDown, model: LabModel) -> dict[str, Channel]:
    """Channels of a free decay."""
    name = recording.source
    if not recording.markers:
        raise ValueError(f"{name}: a ring-down needs markers, and this file has none")
    if recording.release is None:
        raise ValueError(f"{name}: when the part was released is not known; add a step 'release'")
    if not recording.rest:
        raise ValueError(f"{name}: displacements are from rest; add a step 'rest', as {{do: rest, last: 0.5 s}}")
    refuse_gaps(recording, "the record")
    _check_sampling(recording, experiment)
    _check_down(recording, experiment)
    _check_places(recording, experiment, model)
    time = np.arange(experiment.samples) / experiment.rate
    markers = np.stack([recording.markers[marker] for marker in model.markers], axis=1)
    return channels(
        Channel("time", "s", time, ("time",), "time since the release"),
        Channel("markers", "m", markers, ("time", "marker", "axis"), "displacement of the markers from rest"),
    )


def _check_sampling(recording: Recording, experiment: RingDown) -> None:
    """Refuse samples that are not the experiment's."""
    name, rate = recording.source, recording.rate
    if abs(rate / experiment.rate - 1) > 1e-4:
        raise ValueError(
            f"{name}: sampled at {rate:.6g} Hz, the experiment at {experiment.rate:.6g} Hz; add a step {{do: resample, "
            "method: spline}, or give the experiment the record's rate"
        )
    time, count = recording.time, experiment.samples
    if time[-1] < experiment.duration - _ON_TIME / rate:
        raise ValueError(
            f"{name}: the record ends {time[-1]:.6g} s after the release, the experiment lasts "
            f"{experiment.duration:g} s; shorten its duration"
        )
    if len(time) != count or abs(time[0]) * rate > _ON_TIME:
        raise ValueError(
            f"{name}: {len(time)} samples from {time[0]:.6g} to {time[-1]:.6g} s, the experiment has {count} from 0 to "
            f"{experiment.duration:g} s; add a step {{do: crop, start: 0 s, end: {experiment.duration:g} s}}"
        )
    off = np.abs(time - np.arange(count) / experiment.rate) * rate
    if off.max() > _ON_TIME:
        at = int(off.argmax())
        raise ValueError(
            f"{recording.at(at)}: sampled {off[at]:.3g} intervals off the experiment's clock; add a step "
            "{do: resample}"
        )


def _check_places(recording: Recording, experiment: RingDown, model: LabModel) -> None:
    """Refuse markers that are not as far apart as the experiment's, whatever the axes."""
    if model.marker_tolerance is None:
        return
    seen, meant = np.array([recording.rest[name] for name in model.markers]), np.array(experiment.markers)
    apart, wanted = (np.linalg.norm(places[:, None] - places, axis=-1) for places in (seen, meant))
    one, other = np.unravel_index(int(np.abs(apart - wanted).argmax()), apart.shape)
    if abs(apart[one, other] - wanted[one, other]) > model.marker_tolerance:
        raise ValueError(
            f"{recording.source}: markers {model.markers[one]!r} and {model.markers[other]!r} are "
            f"{apart[one, other] * 1e3:.4g} mm apart at rest, the experiment's {wanted[one, other] * 1e3:.4g} mm: "
            "another marker set, or other places in the experiment's 'markers'"
        )


def _check_down(recording: Recording, experiment: RingDown) -> None:
    """Refuse a record whose down is not where the experiment's own weight points."""
    towards = getattr(experiment, "own_weight", None)
    if recording.up is None or towards is None:
        return
    down = np.array([0.0, np.cos(towards), np.sin(towards)])
    angle = float(np.arccos(np.clip(-recording.up @ down, -1, 1)))
    if angle > _DOWN:
        text = ", ".join(f"{value:.3g}" for value in -recording.up)
        raise ValueError(
            f"{recording.source}: after all steps down is ({text}), {np.degrees(angle):.3g} deg from the experiment's "
            f"own weight ({', '.join(f'{value:.3g}' for value in down)}); check the steps 'axes', 'turn' and 'align'"
        )


def _static_stiffness(recording: Recording, experiment: StaticStiffness) -> dict[str, Channel]:
    """Channels of a static test."""
    if recording.wrench is None or recording.pose is None:
        lacking = "forces and moments" if recording.wrench is None else "pose of the robot (key 'pose')"
        raise ValueError(f"{recording.source}: a static stiffness test needs the {lacking}")
    count = len(experiment.legs()) * experiment.increments
    if recording.leg is None or len(recording.leg) != count or (recording.leg < 0).any():
        raise ValueError(f"{recording.source}: the log is not yet in legs and increments; add a step {{do: legs}}")
    dims = ("increment", "dof")
    return channels(
        Channel("increment", "1", np.arange(count), ("increment",), "number of the increment"),
        Channel("leg", "1", recording.leg, ("increment",), "number of the leg"),
        Channel("motion", "m, rad", recording.pose, dims, "motion of the robot from rest"),
        Channel("wrench", "N, N*m", recording.wrench, dims, "force and moment on the tip, about its centre"),
    )


def _how(recording: Recording, model: LabModel, path: Path) -> dict[str, Any]:
    """Where the record comes from and what was done to it, as plain data."""
    facts: dict[str, Any] = {
        "files": {file.name: hashlib.sha256(file.read_bytes()).hexdigest() for file in inputs(model, path)},
        "steps": list(recording.history),
        "specimen_in_file": recording.specimen,
        "rest_places_m": {name: place.tolist() for name, place in recording.rest.items()},
    }
    if recording.up is not None:
        facts["up"] = recording.up.tolist()
    if recording.release is not None:
        facts["release_in_file_s"] = recording.release.time
        facts["release_uncertainty_s"] = recording.release.uncertainty
    return facts


def lab_model(document: Mapping[str, Any]) -> LabModel:
    """The model of a mapping as a study writes it, with units.

    Raises
    ------
    ValueError
        In one line.
    """
    from lab.units import WRITTEN_BY_HAND

    try:
        return LabModel.model_validate(document, context=WRITTEN_BY_HAND)
    except ValidationError as error:
        raise ValueError(
            "; ".join(
                f"{'.'.join(map(str, e['loc']))}: {e['msg'].removeprefix('Value error, ')}" for e in error.errors()
            )
        ) from None
