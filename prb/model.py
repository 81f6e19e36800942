"""What a study may choose about the pseudo-rigid-body performer."""

from typing import Annotated, Any, Literal

from pydantic import Field, ValidationInfo, field_validator

from lab.materials import Frozen
from lab.specimens import Specimen
from lab.units import Quantity
from prb.mechanism import Mechanism
from prb.topologies import TOPOLOGIES


class PrbModel(Frozen):
    """Pseudo-rigid-body performer: a declared topology and the values of its parameters.

    Parameters that are left out take the topology's nominal value for the specimen.  Values are
    SI floats here; in a study file they carry units.
    """

    kind: Literal["prb"] = "prb"
    topology: Literal["five-hinge", "five-hinge-anisotropic", "gauss-chain"]
    parameters: dict[str, float] = Field(default_factory=dict)
    #: Longest step of the simulator; the sampling interval is divided into whole steps.
    time_step: Annotated[float, Quantity("s", "ms"), Field(gt=0)] = 0.25e-3

    @field_validator("parameters", mode="before", json_schema_input_type=dict[str, float | str])
    @classmethod
    def _read_parameters(cls, value: Any, info: ValidationInfo) -> Any:
        if not isinstance(value, dict) or "topology" not in info.data:
            return value  # the field's own error says what is wrong
        topology = TOPOLOGIES[info.data["topology"]]
        numbers = {}
        for name, written in value.items():
            parameter = topology.parameter(name)
            numbers[name] = _read(written, Quantity(parameter.unit, parameter.shown_in), name, info)
            parameter.check(numbers[name])
        return numbers

    def values(self, specimen: Specimen) -> dict[str, float]:
        """Every parameter of the topology in SI units, checked against its bounds for ``specimen``."""
        return TOPOLOGIES[self.topology].values(specimen, self.parameters)

    def mechanism(self, specimen: Specimen) -> Mechanism:
        """The mechanism that stands for ``specimen``."""
        return TOPOLOGIES[self.topology].build(specimen, self.values(specimen))


def _read(written: Any, quantity: Quantity, name: str, info: ValidationInfo) -> float:
    try:
        return float(quantity.read(written, info))
    except (TypeError, ValueError) as error:
        raise ValueError(f"parameter {name}: {error}") from None
