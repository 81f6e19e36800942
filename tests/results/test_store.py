import json
import os
import signal
import subprocess
import sys
import time

import h5py
import numpy as np
import pytest
import xarray as xr

from lab.records import Channel, Fields, Record, Scalar, channels
from results.store import StoreError, read_record, write_record


@pytest.fixture
def record():
    rng = np.random.default_rng(0)
    points = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1, 2)], float)
    cells = np.array([[0, 1, 4, 3, 6, 7, 10, 9], [1, 2, 5, 4, 7, 8, 11, 10]])
    moved = rng.random((4, 12, 3)).astype("f4")
    energy = rng.random((4, 2)).astype("f4")
    fields = Fields(
        points,
        cells,
        12,
        np.array([0.0, 0.1, 0.2, 0.3]),
        {"displacement": Channel("displacement", "m", moved, ("state", "point", "axis"))},
        {"strain_energy_density": Channel("strain_energy_density", "J/m^3", energy, ("state", "cell"))},
    )
    curves = channels(
        Channel("time", "s", np.linspace(0, 1, 5), ("time",), "time after release"),
        Channel("markers", "m", rng.random((5, 3, 3)), ("time", "marker", "axis"), "marker displacement"),
    )
    how = {"wall_time_s": 1.5, "history": list(range(30_000))}  # longer than an HDF5 attribute may be
    scalars = {"frequency": Scalar(29.5, "Hz", "main mode")}
    return Record("fea", "m", {"kind": "TwistedBeam"}, {"kind": "RingDown"}, curves, scalars, how, fields=fields)


def test_what_is_written_is_read_back(record, tmp_path):
    path = tmp_path / "a.vtkhdf"
    write_record(path, record, {"source_hash": "x"})
    found = read_record(path)
    assert (found.origin, found.model, found.how, found.scalars) == (record.origin, "m", record.how, record.scalars)
    for name, channel in record.channels.items():
        assert found.channels[name].dims == channel.dims
        assert found.channels[name].unit == channel.unit
        assert np.array_equal(found[name], channel.values)
    for ours, theirs in (
        (record.fields.point_data, found.fields.point_data),
        (record.fields.cell_data, found.fields.cell_data),
    ):
        for name in ours:
            assert np.array_equal(ours[name].values, theirs[name].values)


def test_pyvista_reads_every_state(record, tmp_path):
    """VTK's reader never raises: it hands back what it could not read as the step before."""
    import pyvista as pv

    path = tmp_path / "a.vtkhdf"
    write_record(path, record, {})
    reader = pv.get_reader(path)
    assert reader.reader.GetNumberOfSteps() == 4
    for step in range(4):
        reader.reader.SetStep(step)
        grid = reader.read()
        assert np.array_equal(grid["displacement"], record.fields.point_data["displacement"].values[step])
        assert np.array_equal(
            grid["strain_energy_density"], record.fields.cell_data["strain_energy_density"].values[step]
        )


def test_xarray_reads_named_dimensions_and_units(record, tmp_path):
    path = tmp_path / "a.vtkhdf"
    write_record(path, record, {})
    with xr.open_dataset(path, engine="h5netcdf", group="curves") as found:
        assert found.markers.dims == ("time", "marker", "axis")
        assert found.markers.attrs["units"] == "m"


def test_the_same_record_gives_the_same_bytes(record, tmp_path):
    for name in ("a", "b"):
        write_record(tmp_path / f"{name}.vtkhdf", record, {"source_hash": "x"})
    assert (tmp_path / "a.vtkhdf").read_bytes() == (tmp_path / "b.vtkhdf").read_bytes()


def test_a_failed_write_keeps_the_old_file(record, tmp_path):
    path = tmp_path / "a.vtkhdf"
    write_record(path, record, {})
    before = path.read_bytes()
    with pytest.raises(TypeError):
        write_record(path, record, {"unwritable": object()})
    assert path.read_bytes() == before
    assert os.listdir(tmp_path) == ["a.vtkhdf"]


def test_a_killed_writer_leaves_nothing_that_looks_like_a_result(tmp_path):
    path = tmp_path / "a.vtkhdf"
    code = (
        "import sys, time, h5py, pathlib\n"
        "from results.store import atomic_path\n"
        "with atomic_path(pathlib.Path(sys.argv[1])) as t, h5py.File(t, 'w') as f:\n"
        "    f['x'] = 1; print('writing', flush=True); time.sleep(60)\n"
    )
    child = subprocess.Popen([sys.executable, "-c", code, str(path)], stdout=subprocess.PIPE, text=True)
    assert child.stdout.readline() == "writing\n"
    child.send_signal(signal.SIGKILL)
    child.wait()
    time.sleep(0.1)
    assert not path.exists()


def test_unknown_versions_and_other_files_are_refused(record, tmp_path):
    path = tmp_path / "a.vtkhdf"
    write_record(path, record, {})
    with h5py.File(path, "a") as file:
        file["provenance"].attrs["format_version"] = 99
    with pytest.raises(StoreError, match="format version 99; this program reads 1"):
        read_record(path)
    with h5py.File(tmp_path / "b.h5", "w") as file:
        file["x"] = 1
    with pytest.raises(StoreError, match="not a scram-record file"):
        read_record(tmp_path / "b.h5")
    (tmp_path / "c.vtkhdf").write_text("text")
    with pytest.raises(StoreError, match="not a readable HDF5 file"):
        read_record(tmp_path / "c.vtkhdf")


def test_provenance_is_plain_json(record, tmp_path):
    path = tmp_path / "a.vtkhdf"
    write_record(path, record, {"versions": {"numpy": "2"}})
    with h5py.File(path) as file:
        assert json.loads(file["provenance/versions"][()]) == {"numpy": "2"}
