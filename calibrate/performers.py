"""Models as a fit sees them: named free numbers, and many runs at once.  Importing this is light."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

from calibrate.space import Coordinate
from calibrate.spec import Bounds
from fea.model import FeaModel
from lab.experiments import Experiment
from lab.requests import Request, Response
from lab.specimens import Specimen
from prb.model import PrbModel

#: Bounds of FEA figures when a study gives none: shares of the nominal value, or SI values.
_SHARES = {"youngs_modulus": (0.1, 10.0), "thickness": (0.8, 1.25)}
_RANGES = {"viscous_time": (1e-5, 0.1), "mass_damping": (0.0, 100.0), "poisson_ratio": (0.2, 0.495)}
_UNITS = {
    "youngs_modulus": ("Pa", "MPa"), "viscous_time": ("s", "ms"), "mass_damping": ("1/s", "1/s"),
    "poisson_ratio": ("dimensionless", "dimensionless"), "thickness": ("m", "mm"),
}  # fmt: skip

#: Steps of a rough PRB run over those of an exact one.
_COARSER = 3.0


class Performer(Protocol):
    """What a fit needs of a model.

    Attributes
    ----------
    difference
        Step of central differences as a share of a coordinate's range: well above the model's own noise.
    cheap
        Whether thousands of runs are a matter of seconds.
    """

    difference: float
    cheap: bool

    @property
    def name(self) -> str:
        """For messages."""

    def declared(self, specimen: Specimen) -> Mapping[str, Coordinate]:
        """Every free number with its widest bounds for ``specimen``."""

    def request(self, specimen: Specimen, experiment: Experiment, values: Mapping[str, float]) -> Request:
        """A run with the numbers of ``values`` (SI), the model's own elsewhere."""

    def run(self, requests: Sequence[Request]) -> list[Response]:
        """Responses in the order of the requests; None where a run failed."""

    def rough(self) -> "Performer":
        """A faster performer for a search that something exact ends; itself where there is none."""


@dataclass
class PrbPerformer:
    """A PRB model and its topology's parameters."""

    model: PrbModel
    threads: int = 1
    difference: float = 5e-5
    cheap: bool = True
    _batch: Any = field(default=None, repr=False)
    _nominal: dict[int, tuple[Specimen, dict[str, float]]] = field(default_factory=dict, repr=False)

    @property
    def name(self) -> str:
        """The topology's name."""
        return f"topology {self.model.topology.name}"

    def declared(self, specimen: Specimen) -> Mapping[str, Coordinate]:
        """The topology's parameters; nominal is the model's own value where it has one."""
        values = self.model.values(specimen)
        return {
            p.name: Coordinate(p.name, p.unit, p.shown_in, values[p.name], float(p.lower), float(p.upper))
            for p in self.model.topology.declare(specimen)
        }

    def request(self, specimen: Specimen, experiment: Experiment, values: Mapping[str, float]) -> Request:
        """A run with every parameter of the topology."""
        # By identity: a fit asks for the same few specimens many thousand times, and hashing them is slow.
        known, nominal = self._nominal.get(id(specimen), (None, {}))
        if known is not specimen:
            nominal = self.model.values(specimen)
            self._nominal[id(specimen)] = (specimen, nominal)
        return Request(specimen, experiment, {**nominal, **values})

    def run(self, requests: Sequence[Request]) -> list[Response]:
        """Roll-outs in one batch, whose compiled models are kept."""
        if self._batch is None:
            from prb.batch import Batch  # loads MuJoCo

            self._batch = Batch(
                self.model.topology,
                time_step=self.model.time_step,
                threads=self.threads,
                fin=self.model.fin,
                water=self.model.water,
            )
        return list(self._batch(requests))

    def rough(self) -> Performer:
        """Longer steps: a third of the time."""
        model = self.model.model_copy(update={"time_step": _COARSER * self.model.time_step})
        return _RoughPrb(model, self.threads, _nominal=self._nominal, fine=self)


@dataclass
class _RoughPrb(PrbPerformer):
    """With longer steps wherever those are stable, exact elsewhere."""

    fine: PrbPerformer | None = None

    def run(self, requests: Sequence[Request]) -> list[Response]:
        """Roll-outs with long steps; those that fail once more with short ones."""
        found = super().run(requests)
        failed = [i for i, response in enumerate(found) if response is None]
        assert self.fine is not None
        for place, response in zip(failed, self.fine.run([requests[i] for i in failed]) if failed else [], strict=True):
            found[place] = response
        return found

    def rough(self) -> Performer:
        """Itself."""
        return self


@dataclass
class FeaPerformer:
    """An FEA model and the figures of material and shell that may be fitted."""

    model: FeaModel
    workers: int = 1
    # Newton's tolerance is noise to a difference quotient: longer steps than for PRB.
    difference: float = 3e-3
    cheap: bool = False
    _batch: Any = field(default=None, repr=False)

    @property
    def name(self) -> str:
        """Kind of elements."""
        return f"FEA with {self.model.element} elements"

    def declared(self, specimen: Specimen) -> Mapping[str, Coordinate]:
        """Figures of ``fea.model.MaterialChange``, and the thickness of shells."""
        nominal = self.model.applied_to(specimen)
        found = {}
        for name, (unit, shown_in) in _UNITS.items():
            if name == "thickness" and (self.model.element != "shell" or not hasattr(nominal, "thickness")):
                continue
            value = float(getattr(nominal if name == "thickness" else nominal.material, name))
            low, high = _RANGES.get(name) or tuple(share * value for share in _SHARES[name])
            # A figure of the model's own always lies inside.
            found[name] = Coordinate(name, unit, shown_in, value, min(low, value), max(high, value))
        return found

    def request(self, specimen: Specimen, experiment: Experiment, values: Mapping[str, float]) -> Request:
        """A run on the specimen with its figures replaced."""
        own = self.model.applied_to(specimen)
        figures = {name: value for name, value in values.items() if name != "thickness"}
        update: dict[str, Any] = {"material": own.material.model_copy(update=figures)}
        if "thickness" in values:
            update["thickness"] = values["thickness"]
        return Request(own.model_copy(update=update), experiment)

    def run(self, requests: Sequence[Request]) -> list[Response]:
        """Runs shared by processes."""
        if self._batch is None:
            from fea.batch import Batch

            self._batch = Batch(self.model, workers=self.workers)
        return list(self._batch(requests))

    def rough(self) -> Performer:
        """Itself: meshes are the user's choice."""
        return self


def performer_of(model: PrbModel | FeaModel, threads: int = 1) -> Performer:
    """The performer of a model."""
    return FeaPerformer(model, threads) if isinstance(model, FeaModel) else PrbPerformer(model, threads)


def free_coordinates(
    performer: Performer, specimens: Sequence[Specimen], free: Mapping[str, Bounds | None]
) -> list[Coordinate]:
    """Free numbers with bounds that hold for all ``specimens``.

    Raises
    ------
    ValueError
        In one line, for an unknown number or bounds that cannot be.
    """
    from calibrate.space import common

    declared = [performer.declared(specimen) for specimen in specimens]
    for name in free:
        if name not in declared[0]:
            raise ValueError(f"{performer.name} has no parameter {name!r}; it has {', '.join(declared[0])}")
    return [common([d[name] for d in declared]).within(bounds) for name, bounds in free.items()]
