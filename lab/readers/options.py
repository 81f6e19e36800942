"""What a user tells about a kind of file: in the study, in a sidecar beside each file, or partly in both."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Literal, TypeVar

from pydantic import Field, ValidationError

from lab.materials import Frozen
from lab.units import WRITTEN_BY_HAND, Quantity, to_si

Up = Literal["x", "y", "z", "-x", "-y", "-z"]
#: Our axis to the file's: ``{x: -z, y: x, z: -y}``.
Axes = dict[Literal["x", "y", "z"], Up]
Rate = Annotated[float, Quantity("Hz", "Hz"), Field(gt=0)]


class FileOptions(Frozen):
    """What every kind of file may be told."""

    specimen: str = Field("", description="Name of the specimen in the recording.")
    #: Fields of the specimen as it was measured (``twist: 90 deg``), compared with the study's.
    declared: dict[str, str] = {}


class MotiveOptions(FileOptions):
    """OptiTrack Motive's CSV export, which says all else itself."""

    kind: Literal["motive"] = "motive"
    columns: Literal["marker", "rigid-body-marker", "rigid-body"] = Field(
        "marker", description="Seen markers, markers as a solved rigid body places them, or pivots of rigid bodies."
    )
    #: Motive's axes unless the export was told otherwise.
    up: Up = "y"


class C3dOptions(FileOptions):
    """C3D, whose header says all else."""

    kind: Literal["c3d"] = "c3d"
    #: None: as the file's parameter POINT:Y_SCREEN has it, if there is one.
    up: Up | None = None


class TableOptions(FileOptions):
    """A table of numbers, which says little itself."""

    delimiter: str = Field(",", min_length=1, max_length=1)
    time: str | None = Field(None, description="Title of the time column.")
    time_unit: str = "s"
    rate: Rate | None = None
    #: Cells with such a text hold no value; anything else that is no number is refused.
    missing: tuple[str, ...] = ()
    #: Column to the value at which its sensor saturates (``Fz: 145 N``), in both directions.
    limits: dict[str, str] = {}


class MarkerTableOptions(TableOptions):
    """Marker coordinates as columns of a CSV."""

    kind: Literal["markers"] = "markers"
    columns: str | None = Field(None, description="Pattern of the titles, as {marker}_{axis}_m.")
    unit: str | None = Field(None, description="Unit of the coordinates, as mm.")
    up: Up | None = None


class PoseOptions(Frozen):
    """Columns of a robot's pose, in the same table or in one of its own with its own clock."""

    position: tuple[str, str, str]
    unit: str
    rotation: tuple[str, ...] = Field(min_length=3, max_length=4)
    #: vector: axis times angle; quaternion: x, y, z, w; euler: about the fixed x, then y, then z.
    rotation_kind: Literal["vector", "quaternion", "euler"] = "vector"
    rotation_unit: str = "rad"
    file: str | None = Field(None, description="Another CSV beside this one.")
    time: str | None = None
    time_unit: str = "s"
    #: Clock of the other file minus that of this one.
    clock_offset: Annotated[float, Quantity("s", "s")] = 0.0


class ForceTorqueOptions(TableOptions):
    """Forces and moments, and where the robot was, as columns of a CSV."""

    kind: Literal["force-torque"] = "force-torque"
    force: tuple[str, str, str] | None = Field(None, description="Titles of the force's columns along x, y, z.")
    force_unit: str | None = None
    moment: tuple[str, str, str] | None = None
    moment_unit: str | None = None
    #: How the sensor's axes lie in those of the pose.
    axes: Axes | None = None
    pose: PoseOptions | None = None
    leg: str | None = Field(None, description="Title of a column with the number of the leg, -1 between legs.")
    flat_samples: int = Field(
        5, ge=0, description="Equal extreme samples in a row that count as saturation; 0: not looked for."
    )


ReaderOptions = Annotated[
    MotiveOptions | C3dOptions | MarkerTableOptions | ForceTorqueOptions, Field(discriminator="kind")
]
Options = TypeVar("Options", bound=FileOptions)


def sidecar_of(path: Path) -> Path | None:
    """The YAML file beside a recording (``take.csv.yaml`` beside ``take.csv``), if there is one."""
    beside = path.with_name(path.name + ".yaml")
    return beside if beside.is_file() else None


def with_sidecar(options: Options, path: Path) -> Options:
    """Options of the study together with those of the file's sidecar.

    Raises
    ------
    ValueError
        In one line, for a sidecar that cannot be read, or that contradicts the study.
    """
    beside = sidecar_of(path)
    if beside is None:
        return options
    given = _read(type(options), beside)
    fields = type(options).model_fields
    # By value, since a resolved study names every field.
    chosen = {name: getattr(options, name) for name in fields if getattr(options, name) != fields[name].default}
    told = {name: getattr(given, name) for name in given.model_fields_set}
    for name in sorted(chosen.keys() & told.keys()):
        if told[name] != chosen[name]:
            raise ValueError(f"{beside.name}: {name} is {told[name]!r}, but the study says {chosen[name]!r}")
    return type(options).model_validate(chosen | told)


def _read(kind: type[Options], beside: Path) -> Options:
    import yaml

    try:
        document = yaml.safe_load(beside.read_text(encoding="utf-8"))
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise ValueError(f"{beside.name}: not readable as YAML: {' '.join(str(error).split())}") from None
    if not isinstance(document, Mapping):
        raise ValueError(f"{beside.name}: a sidecar holds 'key: value' lines")
    try:
        return kind.model_validate(document, context=WRITTEN_BY_HAND)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"]))
        raise ValueError(f"{beside.name}: {where}: {first['msg'].removeprefix('Value error, ')}") from None


def factor(name: str, unit: str, target: str) -> float:
    """What a number in ``unit`` is multiplied by to be in the SI unit ``target``.

    Raises
    ------
    ValueError
        Naming the file, for an unknown unit or one of another dimension.
    """
    try:
        return to_si(f"1 {unit}", target)
    except ValueError:
        raise ValueError(f"{name}: unknown unit {unit!r}; expected one like {target}") from None
