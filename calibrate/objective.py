"""The misfit between a model and all its targets, on the unit cube of what is searched."""

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from calibrate.blocks import SCALARS, Block, View, number_scales
from calibrate.performers import Performer, free_coordinates
from calibrate.sensors import clock, experiment_with
from calibrate.space import Coordinate, Space
from calibrate.spec import Bounds
from calibrate.targets import Target, rows_of, unique_names
from lab.experiments import RingDown
from lab.requests import Request

Array = NDArray[np.float64]
Objective = Literal["rms", "relative"]
UNITS: Mapping[str, str] = {"rms": "m", "relative": "1"}


@dataclass
class Problem:
    """Residuals of a performer against targets.

    Parameters
    ----------
    performer, targets, objective
        What is fitted to what, by which measure.
    free
        Free numbers of the performer, with bounds; they come first among the coordinates, nuisances follow.
    fixed
        Further numbers of the performer that differ from its own, SI.
    held
        Nuisances, by the names of their coordinates, that are known: they are not searched.

    Attributes
    ----------
    evaluations
        Candidates simulated so far.
    """

    performer: Performer
    targets: Sequence[Target]
    objective: Objective = "rms"
    free: Mapping[str, Bounds | None] = field(default_factory=dict)
    fixed: Mapping[str, float] = field(default_factory=dict)
    held: Mapping[str, float] = field(default_factory=dict)
    evaluations: int = 0

    def __post_init__(self) -> None:
        if not self.targets:
            raise ValueError("a fit needs at least one record")
        unique_names(self.targets)
        parameters = free_coordinates(self.performer, [t.specimen for t in self.targets], self.free)
        nuisances: dict[str, Coordinate] = {}
        for target in self.targets:
            for coordinate in target.searched.values():
                if coordinate.name not in self.held:
                    nuisances.setdefault(coordinate.name, coordinate)
        self.space = Space((*parameters, *nuisances.values()))
        self.views = [self._view(target) for target in self.targets]
        self.blocks = [block for i in range(len(self.targets)) for block in self._blocks(i)]

    @property
    def parameters(self) -> int:
        """How many of the coordinates are free numbers of the performer."""
        return len(self.free)

    @property
    def size(self) -> int:
        """Number of residuals N."""
        return sum(block.reference.size for block in self.blocks)

    @property
    def penalty(self) -> float:
        """Objective of candidates that cannot be simulated: ten times what a model that never moves scores."""
        zero = [block.factor * block.reference for block in self.blocks]
        return 10.0 * float(np.sqrt(sum(np.sum(z**2) for z in zero)))

    def start(self) -> Array:
        """The nominal place in the unit cube, (n,)."""
        return self.space.place(np.array([c.nominal for c in self.space.coordinates]))

    def predictions(self, unit: Array) -> list[Array]:
        """What the sensors of every block would show, without its offset.

        Parameters
        ----------
        unit
            Points of the unit cube, (p, n).

        Returns
        -------
        predictions
            One array (p, rows, columns) per block, NaN where a run failed.
        """
        self.evaluations += len(unit)
        values = self.space.values(unit) if len(self.space) else np.empty((len(unit), 0))
        requests = [self._request(view, row) for row in values for view in self.views]
        responses = self.performer.run(requests)
        found = [np.full((len(unit), *block.reference.shape), np.nan) for block in self.blocks]
        for candidate, row in enumerate(values):
            block = 0
            for number, view in enumerate(self.views):
                mine = sum(b.target == number for b in self.blocks)
                response = responses[candidate * len(self.views) + number]
                read = view.read(response, view.numbers(row))
                for k, part in enumerate(read or []):
                    found[block + k][candidate] = part
                block += mine
        return found

    def residuals_of(self, predictions: Sequence[Array], references: Sequence[Array] | None = None) -> Array:
        """Scaled differences; the root of their sum of squares is the objective.

        Parameters
        ----------
        predictions
            From ``predictions``.
        references
            One array (p, rows, columns) per block in place of the records, as resampled ones.

        Returns
        -------
        residuals
            (p, N), NaN for candidates that failed in any target.
        """
        parts = []
        for i, (block, prediction) in enumerate(zip(self.blocks, predictions, strict=True)):
            difference, _ = block.difference(prediction, None if references is None else references[i])
            parts.append((block.factor * difference).reshape(len(prediction), -1))
        joined = np.concatenate(parts, axis=1)
        joined[~np.isfinite(joined).all(axis=1)] = np.nan
        return joined

    def residuals(self, unit: Array) -> Array:
        """``residuals_of`` the points (p, n) of the unit cube, all of them in one batch."""
        return self.residuals_of(self.predictions(unit))

    def objectives(self, unit: Array) -> Array:
        """Objective of points (p, n), (p,); failed candidates get the ``penalty``."""
        return np.nan_to_num(np.sqrt(np.sum(self.residuals(unit) ** 2, axis=1)), nan=self.penalty)

    def derivative(self, unit: Array, which: Sequence[int] | None = None) -> Array:
        """Central differences of the residual inside the cube, (N, n), in one batch.

        Parameters
        ----------
        unit
            (n,).
        which
            Coordinates to differentiate by; None: all.  The others' columns are left out.
        """
        chosen = list(range(len(self.space))) if which is None else list(which)
        steps = self.performer.difference * np.eye(len(self.space))[chosen]
        up, down = np.clip(unit + steps, 0.0, 1.0), np.clip(unit - steps, 0.0, 1.0)
        width = np.sum(up - down, axis=1)
        high, low = np.split(self.residuals(np.vstack([up, down])), 2)
        if not (np.isfinite(high).all() and np.isfinite(low).all()):
            return self._one_sided(unit, (up, high), (down, low))
        return ((high - low) / width[:, None]).T

    def _one_sided(self, unit: Array, upper: tuple[Array, Array], lower: tuple[Array, Array]) -> Array:
        """Differences to the middle where a run on one side failed; zero where both did."""
        middle, columns = self.residuals(unit[None])[0], []
        for up, high, down, low in zip(*upper, *lower, strict=True):
            ends = [(p, r) for p, r in ((up, high), (down, low)) if np.isfinite(r).all()]
            ends = [*ends, (unit, middle)][:2]
            width = np.sum(ends[0][0] - ends[1][0]) if len(ends) == 2 else 0.0
            columns.append((ends[0][1] - ends[1][1]) / width if width else np.zeros_like(middle))
        return np.array(columns).T

    def rough(self) -> "Problem":
        """The same problem, faster and less exact: for a search that ends with this one."""
        other = copy.copy(self)
        other.performer = self.performer.rough()
        return other

    def with_references(self, references: Sequence[Array]) -> "Problem":
        """The same problem with other records, one array (rows, columns) per block."""
        other = copy.copy(self)
        other.blocks = [replace(b, reference=r) for b, r in zip(self.blocks, references, strict=True)]
        return other

    def split(self, residual: Array) -> list[Array]:
        """A residual (N,), or rows of a derivative (N, n), block by block: (rows * columns, ...)."""
        ends = np.cumsum([block.reference.size for block in self.blocks])[:-1]
        return np.split(residual, ends)

    def _request(self, view: View, row: Array) -> Request:
        values = {**self.fixed, **dict(zip(self.free, row[: self.parameters].tolist(), strict=True))}
        experiment = experiment_with(view.experiment, view.numbers(row))
        return self.performer.request(view.target.specimen, experiment, values)

    def _view(self, target: Target) -> View:
        rows = rows_of(target)
        ticking = None
        if target.channels and isinstance(target.experiment, RingDown):
            ticking = clock(target.experiment, target.record["time"][rows], target.nuisances.get("release_time"))
        held = {name: self.held[c.name] for name, c in target.searched.items() if c.name in self.held}
        columns = {name: self.space.names.index(c.name) for name, c in target.searched.items() if name not in held}
        experiment = ticking.experiment if ticking else target.experiment
        return View(target, experiment, ticking, rows, columns, held, tuple(target.scalars()))

    def _blocks(self, number: int) -> list[Block]:
        target, view = self.targets[number], self.views[number]
        if self.objective == "rms" and target.quantities != ("markers",):
            raise ValueError(
                f"record {target.name}: objective rms (eq. 5.13) is in metres and takes markers only, "
                f"not {', '.join(target.quantities)}; choose relative"
            )
        share = target.weight / sum(t.weight for t in self.targets)
        pieces = len(target.channels) + bool(view.names)
        offset = target.nuisances.get("offset")
        blocks = []
        for name in target.channels:
            values = target.record[name][view.rows]
            reference = np.asarray(values, dtype=float).reshape(len(values), -1)
            scale = np.sqrt(values.shape[0] * values.shape[1]) if self.objective == "rms" else np.linalg.norm(reference)
            bounds = (offset.lower, offset.upper) if offset else None
            root = float(np.sqrt(share / pieces))
            blocks.append(Block(number, name, reference, root, np.full((1, 1), scale), bounds))
        if view.names:
            given = target.scalars()
            values = np.array([[given[name].value] for name in view.names])
            root = float(np.sqrt(share / pieces / len(values)))
            blocks.append(Block(number, SCALARS, values, root, number_scales(target)))
        return blocks
