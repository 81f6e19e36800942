"""The stages of experiments with a tube with fins: pinch, and push.

A pinch is a path of equilibria, and the tube is then held until all is still.  A fin that is pushed may buckle: steps
in time with the material's viscosity pass that.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from fea.finned_device import Device, FinExperiment
from fea.finned_sensing import Sensed
from fea.newton import Branch, DivergedError, History, Options, follow
from lab.experiments import FinPush
from meshes.finned_tube import fin_parameters

Array = NDArray[np.float64]

#: First step of a stage over that between records: where drives have kinks, and plates meet fins.
_FIRST = 0.25
#: Smallest step over that between records.
_STUBBORN = 1e-4


@dataclass
class Play:
    """Goes through the stages of an experiment and senses.

    Attributes
    ----------
    reason
        Why a stage could not be finished; empty while all is well.
    notes
        What a reader should know: a fin that has slipped off the plate.
    """

    device: Device
    experiment: FinExperiment
    tolerance: float
    sensed: Sensed = field(init=False)
    history: History = field(default_factory=History)
    notes: list[str] = field(default_factory=list)
    reason: str = ""

    def __post_init__(self) -> None:
        self._branch = Branch.start(self.device.problem.rest, 1.0)
        self.sensed = Sensed(self.device)
        self.sensed.read("rest", self.device.problem.rest, 0.0)
        self._options = Options(tolerance=max(self.tolerance, 1e-6), max_iterations=15, min_increment=_STUBBORN)

    @property
    def t(self) -> float:
        """What has been reached; every stage takes 1, and 1 s where anything is viscous."""
        return self._branch.parameters[-1]

    @property
    def x(self) -> Array:
        """Displacements there (N, 3), m."""
        return self.device.problem.displacement(self._branch.states[-1], self.t)

    def play(self) -> None:
        """All stages, as far as they go."""
        if self.experiment.drive == "pressure" or self.experiment.travel > 0:
            self.flatten()
        if isinstance(self.experiment, FinPush) and not self.reason:
            self.push(self.experiment)

    def flatten(self) -> None:
        """Move the crest lines together, or inflate the chambers."""
        experiment, device = self.experiment, self.device
        given = experiment.travel if experiment.drive == "pinch" else experiment.pressure
        device.drive.goes(self.t, self.t + 1.0, given)
        self._march("pinch", experiment.increments)

    def push(self, experiment: FinPush) -> None:
        """Bring the plate to the fin, across its crown as that stands now, and move it on."""
        device, plate = self.device, self.device.plate
        assert plate is not None
        now = device.fin.now(self.x, device.crown)
        along = fin_parameters(device.specimen, device.fin.mid[device.crown])[1] - device.specimen.crown_along
        edge = np.array([np.interp(experiment.place * device.specimen.fin_length, along, axis) for axis in now.T])
        upwards = now[-1] - now[0]
        upwards /= np.linalg.norm(upwards)
        # Across the crown in the x-z plane, on the convex side.
        convex = np.cross([0.0, 1.0, 0.0], upwards)
        convex *= np.sign(convex @ device.specimen.fin_normal)
        plate.meet(self.x, convex if experiment.sense == "opposite" else -convex, upwards, edge)
        if not device.problem.seconds:
            device.problem.pass_time(self._branch.states[-1], self.t, 1.0)
        plate.way.goes(self.t, self.t + 1.0, experiment.push)
        self._march("push", experiment.push_increments)

    def _march(self, stage: str, increments: int) -> None:
        """Go on by 1, recording at even steps."""
        problem, branch, start = self.device.problem, self._branch, self.t
        # Drives have kinks here.
        branch.restart(_FIRST / increments)
        for number in range(1, increments + 1):
            try:
                follow(problem, branch, start + number / increments, self._options, self.history)
            except DivergedError as error:
                if not self._slipped_off():
                    done = 100 * (self.t - start)
                    self.reason = f"stage {stage} stopped at {done:.3g} % of its way: {error}"
                if self.t > start + (number - 1) / increments:
                    self.sensed.read(stage, branch.states[-1], self.t)
                return
            self.sensed.read(stage, branch.states[-1], self.t)
            if self._slipped_off():
                return

    def _slipped_off(self) -> bool:
        """Whether the fin has left the plate, which is the end of a push; noted."""
        plate = self.device.plate
        if plate is None or not plate.slipped_off:
            return False
        self.notes.append(f"the fin slipped off the plate by {1e3 * plate.way(self.t):.3g} mm of its way: the end")
        return True
