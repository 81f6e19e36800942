"""Targets as arrays: what is compared, over what, and how a response is read."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.sensors import Clock, without_offset
from calibrate.targets import Target, record_of
from lab.experiments import Experiment
from lab.requests import Response

Array = NDArray[np.float64]
SCALARS = "numbers"


@dataclass(frozen=True)
class Block:
    """One channel of a target, or all its reduced numbers.

    Parameters
    ----------
    target, quantity
        Place of the target, and the channel's name or ``numbers``.
    reference
        (rows, columns): samples and coordinates, or one row per number.
    share
        Root of the block's share of the objective's square.
    scale
        What differences are divided by, (rows, 1) or (1, 1).
    offset
        Bounds of a free constant per column; None: there is none.
    """

    target: int
    quantity: str
    reference: Array
    share: float
    scale: Array
    offset: tuple[float, float] | None = None

    @property
    def factor(self) -> Array:
        """What differences are multiplied by; then their squares add up to the objective's square."""
        return self.share / self.scale

    @property
    def timed(self) -> bool:
        """Whether rows follow each other in time."""
        return self.quantity != SCALARS

    def difference(self, prediction: Array, reference: Array | None = None) -> tuple[Array, Array]:
        """Prediction minus reference, (..., rows, columns), and the offset (..., columns) that was taken out."""
        raw = prediction - (self.reference if reference is None else reference)
        if self.offset is None:
            return raw, np.zeros((*raw.shape[:-2], raw.shape[-1]))
        return without_offset(raw, self.offset)


@dataclass
class View:
    """A target as the problem asks for it and reads the answer.

    Parameters
    ----------
    columns, held
        Places of its nuisances among the coordinates; values of those that are known.
    """

    target: Target
    experiment: Experiment
    clock: Clock | None
    rows: NDArray[np.bool_]
    columns: dict[str, int]
    held: dict[str, float]
    names: tuple[str, ...]

    def numbers(self, row: Array) -> dict[str, float]:
        """Nuisances of a candidate, from its coordinates (n,), SI."""
        return {**self.held, **{name: float(row[column]) for name, column in self.columns.items()}}

    def read(self, response: Response, numbers: Mapping[str, float]) -> list[Array] | None:
        """One array (rows, columns) per block; None where the run failed.

        Raises
        ------
        ValueError
            In one line, when the model never has a number that is followed, as one of few joints has few modes.
        """
        if response is None:
            return None
        found = []
        gain = numbers.get("gain", 1.0)
        for name in self.target.channels:
            values = np.asarray(response[name], dtype=float)
            if self.clock is not None:
                values = self.clock.read(response["time"], values, numbers.get("release_time", 0.0))
            else:
                values = values[self.rows]
            found.append(gain * values.reshape(len(values), -1))
        if self.names:
            reduced = self.target.experiment.reduce(record_of(self.target, response))
            if missing := [name for name in self.names if name not in reduced]:
                known = ", ".join(reduced)
                raise ValueError(f"record {self.target.name}: the model has no {missing[0]} to follow; it has {known}")
            found.append(gain * np.array([[reduced[name].value] for name in self.names]))
        return found


def number_scales(target: Target) -> Array:
    """What misfits of the reduced numbers are divided by, (numbers, 1): the largest one of the same unit.

    A number's own value would let couplings that should vanish decide the fit.
    """
    given = target.scalars().values()
    sizes = [max(abs(other.value) for other in given if other.unit == scalar.unit) for scalar in given]
    return np.array([[size or 1.0] for size in sizes])
