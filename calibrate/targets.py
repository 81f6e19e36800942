"""Records as a fit follows them."""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from calibrate.sensors import nuisance_coordinates
from calibrate.space import Coordinate
from calibrate.spec import FORCE_ENTRIES, DataSpec
from lab.experiments import BaseShake, Experiment, NaturalModes
from lab.records import Channel, Record, Scalar
from lab.specimens import Specimen

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Target:
    """A record that a fit follows.

    Parameters
    ----------
    name
        Unique among the targets of a fit.
    specimen, experiment
        What a performer is to do.
    record
        The reference, completed.
    quantities
        Names of its channels (first axis: the record's index) or reduced numbers that count.
    weight
        Beside other targets.
    window
        Part of the record that counts, s on its own clock; None: all of it.
    nuisances
        Searched sensor numbers; ``offset`` is solved in closed form.
    noise
        Known standard deviation of each sample, in the unit of the channels; None: unknown.
    """

    name: str
    specimen: Specimen
    experiment: Experiment
    record: Record
    quantities: tuple[str, ...]
    weight: float = 1.0
    window: tuple[float, float] | None = None
    nuisances: Mapping[str, Coordinate] = field(default_factory=dict)
    noise: float | None = None

    @property
    def searched(self) -> dict[str, Coordinate]:
        """Nuisances that are coordinates of the search."""
        return {name: c for name, c in self.nuisances.items() if name != "offset"}

    @property
    def channels(self) -> tuple[str, ...]:
        """The quantities that are channels."""
        return tuple(name for name in self.quantities if name in self.record.channels)

    def scalars(self) -> dict[str, Scalar]:
        """The quantities that are numbers: the record's own, or its reduction."""
        wanted = [name for name in self.quantities if name not in self.record.channels]
        if not wanted:
            return {}
        given = dict(self.record.scalars)
        if any(name not in given for name in wanted):
            given = {**self.experiment.reduce(self.record), **given}
        return {name: given[name] for name in wanted}


def default_quantities(experiment: Experiment, record: Record) -> tuple[str, ...]:
    """What counts of an experiment unless a study says otherwise; of natural modes all that the record has."""
    if isinstance(experiment, NaturalModes):
        return tuple(experiment.reduce(record))
    return ("markers",) if experiment.in_motion else FORCE_ENTRIES


def target(name: str, specimen: Specimen, experiment: Experiment, record: Record, data: DataSpec) -> Target:
    """The record as a target, checked.

    Raises
    ------
    ValueError
        In one line that names the record, when it cannot be followed.
    """
    try:
        if not record.completed:
            raise ValueError(f"it is {record.status}: {record.reason}")
        found = Target(
            name, specimen, experiment, record, tuple(data.quantities) or default_quantities(experiment, record),
            data.weight, data.window, nuisance_coordinates(name, experiment, data), data.noise,
        )  # fmt: skip
        check(found)
    except (ValueError, KeyError) as error:
        raise ValueError(f"record {name} ({record.origin}, {record.model}): {error}") from None
    return found


def check(target: Target) -> None:
    """Refuse a target whose quantities are missing, misshapen or not finite, by a ValueError in one line."""
    record, experiment = target.record, target.experiment
    if (kind := record.experiment.get("kind")) is not None and kind != experiment.kind:
        raise ValueError(f"it is a {kind}, not a {experiment.kind}")
    _check_quantities(target)
    if isinstance(experiment, NaturalModes) and target.channels:
        raise ValueError(f"of natural modes the numbers f_1, f_2, ... are followed, not {', '.join(target.channels)}")
    for name in target.channels:
        values = record[name]
        rows = (~np.isfinite(values.reshape(len(values), -1))).any(axis=1)
        if rows.any():
            raise ValueError(f"{name} has no value in sample {int(np.argmax(rows))} (and {int(rows.sum()) - 1} more)")
    if "markers" in target.channels:
        markers, count = record["markers"], len(getattr(experiment, "markers", ()))
        if markers.shape[1:] != (count, 3):
            raise ValueError(f"markers have the shape {markers.shape}; the experiment says (samples, {count}, 3)")
    if isinstance(experiment, BaseShake) and target.channels and len(record[target.channels[0]]) != experiment.samples:
        count = len(record[target.channels[0]])
        raise ValueError(
            f"{target.channels[0]} has {count} samples; a period of the experiment has {experiment.samples}"
        )
    for name, scalar in target.scalars().items():
        if not math.isfinite(scalar.value):
            raise ValueError(f"{name} has no value")
    if target.window and "time" not in record.channels:
        raise ValueError("a window needs the channel time")
    rows_of(target)


def _check_quantities(target: Target) -> None:
    record = target.record
    missing = [name for name in target.quantities if name not in record.channels and name not in record.scalars]
    if missing:
        try:
            reduced = target.experiment.reduce(record)
        except KeyError as error:
            known = ", ".join([*record.channels, *record.scalars])
            raise ValueError(f"no quantity {missing[0]!r} (nor the channel {error}); it has {known}") from None
        for name in missing:
            if name not in reduced:
                known = ", ".join([*record.channels, *record.scalars, *reduced])
                raise ValueError(f"no quantity {name!r}; it has {known}")
    if "offset" in target.nuisances and not target.channels:
        raise ValueError("nuisance offset needs a channel")
    if (
        "offset" in target.nuisances
        and target.nuisances["offset"].lower > -math.inf
        and target.channels != ("markers",)
    ):
        raise ValueError("bounds of offset are in m: they need markers as the only channel")


def rows_of(target: Target) -> NDArray[np.bool_]:
    """Samples of the channels that count, (samples,).

    Raises
    ------
    ValueError
        For a clock that does not run on, or a window with fewer than two samples in it.
    """
    names = target.channels
    count = len(target.record[names[0]]) if names else 0
    inside = np.ones(count, bool)
    if names and "time" in target.record.channels:
        time = target.record["time"]
        if len(time) != count or np.any(np.diff(time) <= 0.0):
            raise ValueError(f"time must rise over the {count} samples of {names[0]}")
        if target.window:
            inside = (time >= target.window[0]) & (time <= target.window[1])
            if inside.sum() < 2:
                low, high = target.window
                raise ValueError(
                    f"window {low:g} s to {high:g} s holds {int(inside.sum())} samples; "
                    f"the record runs from {time[0]:g} s to {time[-1]:g} s"
                )
    return inside


def record_of(target: Target, channels: Mapping[str, Array], origin: Record | None = None) -> Record:
    """A record like the target's with the channels of a response, for the experiment's reduction."""
    like = origin or target.record
    made = {
        name: Channel(name, like.channels[name].unit if name in like.channels else "1", values, _dims(values))
        for name, values in channels.items()
    }
    return dataclasses.replace(like, channels=made, scalars={}, fields=None)


def _dims(values: Array) -> tuple[str, ...]:
    return tuple(f"axis{i}" for i in range(values.ndim))


def unique_names(targets: Sequence[Target]) -> None:
    """Refuse targets of the same name, by a ValueError."""
    names = [t.name for t in targets]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise ValueError(f"record {', '.join(twice)} is given more than once")
