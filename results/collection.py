"""``study.h5``: the headline numbers of all samples in one netCDF-conforming HDF5 file."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import xarray as xr

from lab.records import Channel
from results.accuracy import Entry
from results.store import StoreError, atomic_path, file_digest

FORMAT, FORMAT_VERSION = "scram-study", 1
#: Channels copied per campaign; the rest stays in the sample files.
HEADLINES = ("motion", "wrench", "markers", "frequency", "travel", "force", "load", "pushed", "p", "push", "thrust")
#: Channels that number the samples of a record.
_INDICES = ("time", "increment", "mode")


def write_study(
    path: Path,
    entries: Sequence[Entry],
    sweeps: Mapping[str, Any],
    fits: Mapping[str, Any],
    provenance: Mapping[str, Any],
) -> None:
    """Write ``study.h5`` atomically.

    Parameters
    ----------
    path
        File to write; sample files are referred to relative to its folder.
    entries
        All records.
    sweeps
        Name of a swept parameter to (unit, value per entry), NaN where it is not swept.
    fits
        Results of the fits by name, plain data.
    provenance
        Resolved study, hashes and versions.
    """
    encoding = {"zlib": True, "shuffle": True}
    with atomic_path(path) as temporary:
        summary = _summary(path.parent, entries, sweeps)
        summary.attrs.update(format=FORMAT, format_version=FORMAT_VERSION)
        summary.to_netcdf(temporary, engine="h5netcdf")
        for campaign in dict.fromkeys(entry.campaign for entry in entries):
            arrays = _headlines([entry for entry in entries if entry.campaign == campaign])
            packed = {name: encoding for name, array in arrays.data_vars.items() if array.ndim > 1}
            arrays.to_netcdf(temporary, engine="h5netcdf", mode="a", group=f"campaigns/{campaign}", encoding=packed)
        for name, fit in fits.items():
            _fit(fit).to_netcdf(temporary, engine="h5netcdf", mode="a", group=f"fits/{name}")
        with h5py.File(temporary, "a") as file:
            about = file.create_group("provenance")
            for key, value in provenance.items():
                about[key] = value if isinstance(value, str) else json.dumps(value, sort_keys=True)


def _summary(folder: Path, entries: Sequence[Entry], sweeps: Mapping[str, Any]) -> xr.Dataset:
    words = {
        "campaign": [e.campaign for e in entries],
        "performer": [e.performer for e in entries],
        "slug": [e.slug for e in entries],
        "origin": [e.record.origin for e in entries],
        "status": [e.record.status for e in entries],
        "reason": [e.record.reason for e in entries],
        "file": [e.path for e in entries],
        "file_sha256": [file_digest(folder / e.path) for e in entries],
    }
    data: dict[str, Any] = {name: ("sample", np.array(values, dtype=object)) for name, values in words.items()}
    times = [float(e.record.how.get("wall_time_s", np.nan)) for e in entries]
    data["wall_time"] = ("sample", times, {"units": "s", "long_name": "wall time of the solve"})
    reduced = [e.scalars() for e in entries]
    for name in dict.fromkeys(name for scalars in reduced for name in scalars):
        values = [scalars[name].value if name in scalars else np.nan for scalars in reduced]
        known = next(scalars[name] for scalars in reduced if name in scalars)
        data[name] = ("sample", values, {"units": known.unit, "long_name": known.long_name or name})
    coordinates: dict[str, Any] = {"sample": [f"{e.campaign}.{e.performer}.{e.slug}" for e in entries]}
    for name, (unit, values) in sweeps.items():
        coordinates[name] = ("sample", values, {"units": unit, "long_name": f"swept {name}"})
    return xr.Dataset(data, coordinates, {"Conventions": "CF-1.11"})


def _headlines(entries: Sequence[Entry]) -> xr.Dataset:
    """Stacked arrays of a campaign; NaN for samples that have none, and behind the end of those that are shorter.

    Samples that run over different times, as shakes of several frequencies do, have no coordinate in common.
    """
    found = [entry.record.channels if entry.record.completed else {} for entry in entries]
    data = {}
    for name in HEADLINES:
        known = [channels[name] for channels in found if name in channels]
        if known:
            stack = _stacked([channels[name].values if name in channels else None for channels in found])
            data[name] = (("sample", *known[0].dims), stack, _attributes(known[0]))
    coordinates: dict[str, Any] = {"sample": [f"{e.performer}.{e.slug}" for e in entries]}
    for name in _INDICES:
        known = [channels[name] for channels in found if name in channels]
        longest = max(known, key=lambda channel: len(channel.values), default=None)
        if longest and all(np.array_equal(c.values, longest.values[: len(c.values)]) for c in known):
            coordinates[name] = (name, longest.values, _attributes(longest))
    return xr.Dataset(data, coordinates)


def _stacked(values: Sequence[np.ndarray | None]) -> np.ndarray:
    """Arrays of as many axes, one after another in the smallest array that holds them all, NaN where they do not."""
    known = [array.shape for array in values if array is not None]
    whole = np.full((len(values), *np.max(known, axis=0)), np.nan)
    for place, array in enumerate(values):
        if array is not None:
            whole[place][tuple(map(slice, array.shape))] = array
    return whole


def _attributes(channel: Channel) -> dict[str, str]:
    return {"units": channel.unit, "long_name": channel.long_name or channel.name}


def _fit(fit: Mapping[str, Any]) -> xr.Dataset:
    """A fit as a dataset over its parameters and generations; everything else as attributes."""
    parameters = fit["parameters"]
    names = [parameter["name"] for parameter in parameters]
    data: dict[str, Any] = {"unit": ("parameter", np.array([p["unit"] for p in parameters], dtype=object))}
    for key, text in (
        ("value", "fitted value"),
        ("standard_error", "standard error"),
        ("lower", "bound"),
        ("upper", "bound"),
    ):
        values = [np.nan if p[key] is None else p[key] for p in parameters]
        data[key] = ("parameter", np.array(values, dtype=float), {"long_name": text, "units": "as in unit"})
    if fit.get("correlation"):
        data["correlation"] = (
            ("parameter", "other_parameter"),
            np.array(fit["correlation"], dtype=float),
            {"units": "1"},
        )
    if fit.get("history"):
        attributes = {"units": fit["objective_unit"], "long_name": "best objective of each generation"}
        data["history"] = ("generation", np.array(fit["history"], dtype=float), attributes)
    known = {"parameters", "correlation", "history", "mjcf", "tables"}
    rest = {key: value for key, value in fit.items() if key not in known and value is not None}
    words = {k: v if isinstance(v, str | int | float) else json.dumps(v, sort_keys=True) for k, v in rest.items()}
    if fit.get("mjcf"):
        data["mjcf"] = ((), np.array(fit["mjcf"], dtype=object), {"long_name": "fitted model, MuJoCo XML"})
    return xr.Dataset(data, {"parameter": np.array(names, dtype=object)}, words)


def read_study(path: Path) -> xr.Dataset:
    """The summary of ``study.h5``, loaded.

    Raises
    ------
    StoreError
        When the file has another format or version.
    """
    with xr.open_dataset(path, engine="h5netcdf") as found:
        if found.attrs.get("format") != FORMAT or found.attrs.get("format_version") != FORMAT_VERSION:
            raise StoreError(f"{path}: not a {FORMAT} file of version {FORMAT_VERSION}")
        return found.load()
