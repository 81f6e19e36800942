"""What a study may choose about the pseudo-rigid-body performer."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationInfo, field_validator, model_validator

from lab.materials import Frozen
from lab.specimens import Specimen
from lab.units import Quantity
from prb.declaration import Declaration, checked
from prb.fin_curves import FinCurves
from prb.hinge_curves import HingeCurves
from prb.mechanism import Mechanism
from prb.topologies import topology
from prb.water import Water

#: Longest step of the simulator, s.
TIME_STEP = 0.5e-3
#: Key of the validation context: folder of the study file, beside which declarations lie.
BESIDE = "beside"


class PrbModel(Frozen):
    """Pseudo-rigid-body performer: a declared topology and the values of its parameters.

    Parameters that are left out take the topology's nominal value for the specimen.  Values are
    SI floats here; in a study file they carry units.
    """

    kind: Literal["prb"] = "prb"
    #: Whole numbers that change the topology's structure.
    settings: dict[str, int] = Field(default_factory=dict)
    #: A shipped name, a YAML file beside the study, or the declaration itself, which is what is kept.
    topology: Declaration
    parameters: dict[str, float] = Field(default_factory=dict)
    #: Longest step of the simulator; the sampling interval is divided into whole steps.  Every motion is
    #: simulated with this step and with half of it, and extrapolated.  A paddling device takes this step where it runs
    #: compiled, a fifth of it and less in MuJoCo (``prb.water``).
    time_step: Annotated[float, Quantity("s", "ms"), Field(gt=0)] = TIME_STEP
    #: What a fit of kind hinge has learned of a pinched tube: its numbers take the place of the parameters.
    hinge: HingeCurves | None = None
    #: What a fit of kind paddler has learned of a fin: its curves take the place of the parameters.
    fin: FinCurves | None = None
    #: Law of the water that a paddling device moves in: the plate law, one of MuJoCo's own fluids, or no water.
    water: Water = "plate"

    @field_validator("topology", mode="before", json_schema_input_type=str | Declaration)
    @classmethod
    def _read_topology(cls, value: Any, info: ValidationInfo) -> Any:
        if isinstance(value, str):
            return topology(value, Path((info.context or {}).get(BESIDE, ".")))
        return checked(value, "the declaration") if isinstance(value, dict) else value

    @field_validator("topology", mode="after")
    @classmethod
    def _with_settings(cls, value: Declaration, info: ValidationInfo) -> Declaration:
        return value.with_settings(info.data.get("settings", {}))

    @field_validator("parameters", mode="before", json_schema_input_type=dict[str, float | str])
    @classmethod
    def _read_parameters(cls, value: Any, info: ValidationInfo) -> Any:
        if not isinstance(value, dict) or "topology" not in info.data:
            return value  # the field's own error says what is wrong
        declared = info.data["topology"]
        numbers = {}
        for name, written in value.items():
            parameter = declared.parameter(name)
            numbers[name] = _read(written, Quantity(parameter.unit, parameter.shown_in), name, info)
            parameter.check(numbers[name])
        return numbers

    @model_validator(mode="after")
    def _paddles_in_water(self) -> "PrbModel":
        if self.water != "plate":
            from prb.paddler import is_paddler  # compiled code, which only such a model needs

            if not is_paddler(self.topology):
                raise ValueError(f"water: topology {self.topology.name} does not paddle; leave water out")
        return self

    def values(self, specimen: Specimen) -> dict[str, float]:
        """Every parameter of the topology in SI units, checked against its bounds for ``specimen``."""
        return self.topology.values(specimen, self.parameters)

    def pinched(self, parameters: Mapping[str, float]) -> "PrbModel":
        """The model with those of a hinge's ``parameters`` that its topology has."""
        mine = {name: value for name, value in parameters.items() if name in self.topology.names}
        return self.model_copy(update={"parameters": {**self.parameters, **mine}})

    def mechanism(self, specimen: Specimen) -> Mechanism:
        """The mechanism that stands for ``specimen``."""
        return self.topology.build(specimen, self.values(specimen))


def _read(written: Any, quantity: Quantity, name: str, info: ValidationInfo) -> float:
    try:
        return float(quantity.read(written, info))
    except (TypeError, ValueError) as error:
        raise ValueError(f"parameter {name}: {error}") from None
