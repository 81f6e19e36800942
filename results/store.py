"""One HDF5 file per record: fields for ParaView, curves for xarray, scalars and provenance for everyone.

Layout (suffix ``.vtkhdf``): ``/VTKHDF`` mesh, fields and states as VTK reads them; ``/curves`` the
channels with dimension scales, ``units`` and ``long_name``; ``/scalars``; ``/provenance``.  Only
gzip and shuffle filters: VTK's reader fails silently on others.
"""

import hashlib
import json
import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from h5py import h5a, h5d, h5ds, h5i, h5s
from numpy.typing import NDArray

from lab.records import Channel, Fields, Record, Scalar

FORMAT, FORMAT_VERSION = "scram-record", 1
_PACKED: dict[str, Any] = {"compression": "gzip", "compression_opts": 4, "shuffle": True}


class StoreError(ValueError):
    """A file is not what it should be."""


@contextmanager
def atomic_path(path: Path) -> Iterator[Path]:
    """A temporary path beside ``path`` that takes its place when the block ends well, and vanishes otherwise."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.stem}.{os.getpid()}.tmp{path.suffix}")
    try:
        yield temporary
        with open(temporary, "rb+") as handle:
            os.fsync(handle.fileno())
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Write a text file atomically."""
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def write_record(path: Path, record: Record, provenance: Mapping[str, Any]) -> None:
    """Write a record atomically.

    Raises
    ------
    OSError
        When the disk refuses; an older file then stays as it was.
    """
    with atomic_path(path) as temporary, h5py.File(temporary, "w", track_order=True) as file:
        if record.fields is not None:
            _write_vtk(file.create_group("VTKHDF", track_order=True), record.fields)
        write_channels(file.create_group("curves", track_order=True), record.channels)
        scalars = file.create_group("scalars", track_order=True)
        for name, scalar in record.scalars.items():
            scalars[name] = scalar.value
            scalars[name].attrs.update(units=scalar.unit, long_name=scalar.long_name)
        about = {"specimen": record.specimen, "experiment": record.experiment, "how": record.how}
        group = file.create_group("provenance")
        group.attrs.update(format=FORMAT, format_version=FORMAT_VERSION)
        group.attrs.update(origin=record.origin, model=record.model, status=record.status, reason=record.reason)
        for key, value in {**about, **provenance}.items():
            if isinstance(value, str | bool | int | float):
                group.attrs[key] = value
            else:  # a dataset, since attributes end at 64 KiB
                group[key] = json.dumps(value, sort_keys=True)


def write_channels(group: h5py.Group, channels: Mapping[str, Channel]) -> None:
    """Channels as datasets with dimension scales, so that xarray finds named dimensions."""
    for channel in channels.values():
        dataset = group.create_dataset(channel.name, data=channel.values, **(_PACKED if channel.values.ndim else {}))
        dataset.attrs.update(units=channel.unit, long_name=channel.long_name or channel.name)
    for channel in channels.values():
        for axis, dim in enumerate(channel.dims):
            if dim not in group:
                group[dim] = np.arange(channel.values.shape[axis])
                group[dim].attrs.update(units="1", long_name=f"index of {dim}")
            if not group[dim].is_scale:
                group[dim].make_scale(dim)
            if dim != channel.name:
                group[channel.name].dims[axis].attach_scale(group[dim])


def _write_vtk(group: h5py.Group, fields: Fields) -> None:
    """Unstructured grid, static mesh, one state per step (VTKHDF 2.2)."""
    n_points, n_cells, n_states = len(fields.points), len(fields.cells), len(fields.values)
    group.attrs["Version"] = np.array([2, 2], dtype="i8")
    group.attrs.create("Type", b"UnstructuredGrid", dtype=h5py.string_dtype("ascii", 16))
    group["NumberOfPoints"] = np.array([n_points], "i8")
    group["NumberOfCells"] = np.array([n_cells], "i8")
    used = fields.cells >= 0
    group["NumberOfConnectivityIds"] = np.array([used.sum()], "i8")
    group.create_dataset("Points", data=fields.points, **_PACKED)
    group.create_dataset("Connectivity", data=fields.cells[used].astype("i8"), **_PACKED)
    group["Offsets"] = np.concatenate([[0], np.cumsum(used.sum(axis=1))]).astype("i8")
    group["Types"] = np.full(n_cells, fields.cell_type, "u1")
    group.create_group("FieldData")
    steps = group.create_group("Steps")
    steps.attrs["NSteps"] = np.int64(n_states)
    steps["Values"] = np.asarray(fields.values, float)
    zeros = np.zeros(n_states, "i8")
    steps["PartOffsets"], steps["NumberOfParts"], steps["PointOffsets"] = zeros, zeros + 1, zeros
    steps["CellOffsets"], steps["ConnectivityIdOffsets"] = zeros[:, None], zeros[:, None]
    for kind, data, count in (("Point", fields.point_data, n_points), ("Cell", fields.cell_data, n_cells)):
        target, offsets = group.create_group(f"{kind}Data"), steps.create_group(f"{kind}DataOffsets")
        for name, channel in data.items():
            stacked = channel.values.reshape(n_states * count, *channel.values.shape[2:]).astype("f4")
            chunks = (count, *stacked.shape[1:])
            target.create_dataset(name, data=stacked, chunks=chunks, **_PACKED).attrs["units"] = channel.unit
            offsets[name] = np.arange(n_states, dtype="i8") * count


def read_record(path: Path, with_fields: bool = True) -> Record:
    """Read a record back.

    Raises
    ------
    StoreError
        When the file is no record, or of a format version that this reader does not know.
    """
    try:
        with h5py.File(path, "r") as file:
            about = _checked_attributes(path, file)
            texts = _datasets(file["provenance"], ("specimen", "experiment", "how"))
            plain = {name: json.loads(_values(dataset).item()) for name, dataset in texts}
            index = {name: _read_channel(name, dataset) for name, dataset in _datasets(file["curves"])}
            scalars = {
                name: Scalar(float(_values(dataset)), _text(dataset, "units"), _text(dataset, "long_name"))
                for name, dataset in _datasets(file["scalars"])
            }
            fields = _read_vtk(file["VTKHDF"]) if with_fields and "VTKHDF" in file else None
    except OSError as error:
        raise StoreError(f"{path}: not a readable HDF5 file ({error})") from None
    return Record(**plain, **about, channels=index, scalars=scalars, fields=fields)


def read_status(path: Path) -> str:
    """Status of the record at ``path``, without reading the rest.

    Raises
    ------
    StoreError
        As ``read_record``.
    """
    try:
        with h5py.File(path, "r") as file:
            return _checked_attributes(path, file)["status"]
    except OSError as error:
        raise StoreError(f"{path}: not a readable HDF5 file ({error})") from None


def _checked_attributes(path: Path, file: h5py.File) -> dict[str, Any]:
    """Words of the provenance, after a look at the format."""
    about = file.get("provenance", file)
    if about.attrs.get("format") != FORMAT:
        raise StoreError(f"{path}: not a {FORMAT} file")
    if about.attrs.get("format_version") != FORMAT_VERSION:
        version = about.attrs.get("format_version")
        raise StoreError(f"{path}: format version {version}; this program reads {FORMAT_VERSION}")
    return {key: _text(about.id, key) for key in ("origin", "model", "status", "reason")}


# Readers of a study open some thousand small datasets, and h5py's low level needs half the time of its objects.
def _datasets(group: h5py.Group, names: Iterable[str] = ()) -> Iterator[tuple[str, h5d.DatasetID]]:
    """Named datasets of a group, or all of them."""
    for name in names or group:
        yield name, h5d.open(group.id, name.encode())


def _values(dataset: h5d.DatasetID) -> NDArray[Any]:
    values = np.empty(dataset.shape, dataset.dtype)
    dataset.read(h5s.ALL, h5s.ALL, values)
    return values


def _text(owner: Any, name: str) -> str:
    value = np.empty((), h5py.string_dtype())
    h5a.open(owner, name.encode()).read(value)
    return bytes(value[()]).decode()


def _read_channel(name: str, dataset: h5d.DatasetID) -> Channel:
    dims = (name,) if h5ds.is_scale(dataset) else tuple(_dim(dataset, axis) for axis in range(dataset.rank))
    return Channel(name, _text(dataset, "units"), _values(dataset), dims, _text(dataset, "long_name"))


def _dim(dataset: h5d.DatasetID, axis: int) -> str:
    """Name of the dimension scale of an axis."""
    return str(h5ds.iterate(dataset, axis, lambda scale: h5i.get_name(scale).decode().rpartition("/")[2]))


def _read_vtk(group: h5py.Group) -> Fields:
    values = group["Steps/Values"][()]
    sizes, types = np.diff(group["Offsets"][()]), group["Types"][()].astype(np.int64)
    cells = np.full((len(sizes), sizes.max()), -1)
    cells[np.arange(sizes.max()) < sizes[:, None]] = group["Connectivity"][()]
    point_data, cell_data = (
        {
            name: Channel(
                name, str(d.attrs["units"]), data.reshape(len(values), -1, *data.shape[1:]), dims[: data.ndim + 1]
            )
            for name, d in group[f"{kind}Data"].items()
            for data, dims in [(d[()], ("state", kind.lower(), "axis"))]
        }
        for kind in ("Point", "Cell")
    )
    cell_type = int(types[0]) if (types == types[0]).all() else types
    return Fields(group["Points"][()], cells, cell_type, values, point_data, cell_data)


def file_digest(path: Path) -> str:
    """SHA-256 of a file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()
