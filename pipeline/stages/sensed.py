"""The run of a fitted model as the sensors of one recording saw it.

A fit finds, for every record that it follows, what the record's sensors did: a clock that ran late, an offset, a test
that was not quite as written.  A model's own record of the same sample is made with these numbers, so that tables and
figures compare it with the recording and not with a test that nobody made.
"""

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from calibrate.sensors import clock, experiment_with
from calibrate.space import Coordinate
from calibrate.spec import Fit
from lab.experiments import Experiment, RingDown
from lab.records import Record
from pipeline.plan import Plan, Sample
from pipeline.stages.gather import fit_result

Run = Callable[[Experiment], Record]


def nuisances_of(plan: Plan, sample: Sample, name: str, result: Mapping[str, Any]) -> dict[str, Any]:
    """Sensor numbers that the fit ``name`` found for the record of this sample, SI; empty where it followed none."""
    fit = result.get("chosen", name)  # of a selection, the fit behind its model
    if not isinstance(plan.study.fits[fit], Fit):
        return {}
    if fit != name:
        result = fit_result(plan, fit)
    place = (sample.campaign, sample.slug)
    labels = {d.label for d in plan.data(fit) if d.row is None and (d.sample.campaign, d.sample.slug) == place}
    found = [target["nuisances"] for target in result.get("targets", ()) if target["name"] in labels]
    return dict(found[0]) if found else {}


def perform_sensed(run: Run, experiment: Experiment, nuisances: Mapping[str, Any]) -> Record:
    """Record of ``run`` with the sensors' numbers put on it.

    Parameters
    ----------
    nuisances
        ``release_time`` (s), ``gain``, ``offset`` (marker, axis; m) and ``experiment.PATH``.
    """
    if not nuisances:
        return run(experiment)
    numbers = {name: value for name, value in nuisances.items() if name != "offset"}
    made = experiment_with(experiment, numbers)
    late = float(numbers.get("release_time", 0.0))
    record = _read_late(run, made, late) if late and isinstance(made, RingDown) else run(made)
    if not record.completed:
        return record
    about = {**record.how, "sensors": {"note": "as fitted to the recording", **nuisances}}
    return dataclasses.replace(record, channels=_with_gain(record, nuisances), how=about)


def _read_late(run: Run, experiment: RingDown, late: float) -> Record:
    """The run on a clock that shows the release at ``late``."""
    times = np.arange(experiment.samples) / experiment.rate
    reader = clock(experiment, times, Coordinate("release_time", "s", "ms", late, late, late))
    record = run(reader.experiment)
    if not record.completed:
        return record
    time = record["time"]
    moved = {
        name: dataclasses.replace(c, values=reader.read(time, c.values, late) if name != "time" else times)
        if c.dims[:1] == ("time",)
        else c
        for name, c in record.channels.items()
    }
    return dataclasses.replace(record, channels=moved, experiment=experiment.model_dump(mode="json"))


def _with_gain(record: Record, nuisances: Mapping[str, Any]) -> dict[str, Any]:
    markers = record.channels.get("markers")
    if markers is None or not {"gain", "offset"} & set(nuisances):
        return dict(record.channels)
    offset = np.array(nuisances.get("offset", 0.0))
    values = nuisances.get("gain", 1.0) * markers.values + offset
    return {**record.channels, "markers": dataclasses.replace(markers, values=values)}
