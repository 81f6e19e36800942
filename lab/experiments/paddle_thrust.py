"""Thrust and speed of the paddling device in water (4.5.2, 4.5.3)."""

from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from lab.materials import Frozen
from lab.records import Record, Scalar
from lab.units import Quantity

Array = NDArray[np.float64]


class PaddleThrust(Frozen):
    """A valve lets air into the chambers and out of them; the fins paddle, the body is held or swims.

    In every cycle air is on from its start for the share ``duty`` (the text's valve has two positions: ASSUMED half
    and half): the tube flattens and the fins close, the power stroke; the rest is the recovery stroke.  Forward is
    along -z, where thrust is positive: closing fins sweep water towards +z.  Without gravity: ASSUMED neutral
    buoyancy.

    Sensed over time (index ``time``): ``thrust`` (n,), on the whole device along -z, N; ``x1`` (n,), motion of the
    tube's side, m; ``fin_angle`` (n,), of the fin's proximal part from +z towards +x, rad; ``buckling`` (n,), angle of
    the distal part against the proximal one, positive where the tip gives way to the load of the power stroke, rad;
    ``tip_speed`` (n,), of the fin's tip (the load fin's, where there is one) relative to the body, m/s;
    ``input_force`` (n,), N; with a free body ``body`` (n,), way along -z, m, and ``body_speed`` (n,), m/s.
    """

    kind: Literal["PaddleThrust"] = "PaddleThrust"
    in_motion: ClassVar[bool] = True
    frequency: Annotated[float, Quantity("Hz", "Hz"), Field(gt=0)] = 1.0
    cycles: int = Field(4, ge=1, le=1000)
    warm_up: int = Field(1, ge=0, description="First cycles that numbers leave out.")
    body: Literal["fixed", "free"] = "fixed"
    pressure: Annotated[float, Quantity("Pa", "kPa"), Field(gt=0, description="60 psi.")] = 413685.44
    duty: float = Field(0.5, gt=0, lt=1, description="Share of the cycle with air on.")
    water_density: Annotated[float, Quantity("kg/m^3", "kg/m^3"), Field(ge=0)] = 1000.0
    samples_per_cycle: int = Field(200, ge=20, le=100_000)

    @model_validator(mode="after")
    def _leaves_a_cycle(self) -> "PaddleThrust":
        if self.warm_up >= self.cycles:
            raise ValueError(f"warm_up {self.warm_up} leaves none of {self.cycles} cycles to take numbers from")
        return self

    @property
    def samples(self) -> int:
        """Number of samples in the record, both ends included."""
        return self.cycles * self.samples_per_cycle + 1

    @property
    def times(self) -> Array:
        """Times of the samples (samples,), s."""
        return np.arange(self.samples) / (self.samples_per_cycle * self.frequency)

    def power_stroke(self, times: Array) -> NDArray[np.bool_]:
        """Whether air is on at ``times`` (n,), s."""
        # Steps of whole samples may end a rounding before the next cycle.
        return (times * self.frequency + 1e-9) % 1.0 < self.duty

    def reduce(self, record: Record) -> dict[str, Scalar]:
        """Peaks and means over the whole cycles after ``warm_up``."""
        time = record["time"]
        # The last sample begins a cycle that is not there.
        kept = (time > (self.warm_up - 1e-9) / self.frequency) & (time < (self.cycles - 1e-9) / self.frequency)
        thrust, buckling, speed = (record[name][kept] for name in ("thrust", "buckling", "tip_speed"))
        power = self.power_stroke(time[kept])
        found = {
            "thrust_max": Scalar(float(thrust.max()), "N", "largest thrust"),
            "thrust_min": Scalar(float(thrust.min()), "N", "smallest thrust"),
            "thrust_mean": Scalar(float(thrust.mean()), "N", "mean thrust over whole cycles"),
            "buckling_min": Scalar(float(buckling.min()), "rad", "smallest angle of the fin's distal part"),
            "buckling_max": Scalar(float(buckling.max()), "rad", "largest angle of the fin's distal part"),
            "tip_speed_max": Scalar(float(speed.max()), "m/s", "largest speed of the tip"),
            "tip_speed_mean_power": Scalar(float(speed[power].mean()), "m/s", "mean speed of the tip with air on"),
            "tip_speed_mean_recovery": Scalar(float(speed[~power].mean()), "m/s", "mean speed of the tip with air off"),
        }
        if self.body == "free":
            way = record["body"]
            ends = np.interp([self.warm_up / self.frequency, self.cycles / self.frequency], time, way)
            spent = (self.cycles - self.warm_up) / self.frequency
            found["swim_speed"] = Scalar(float(ends[1] - ends[0]) / spent, "m/s", "mean forward speed")
        return found
