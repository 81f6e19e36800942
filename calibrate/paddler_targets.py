"""The published thrust of the paddling device as targets, and what the text says of buckling (4.5.2, 4.5.3)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from calibrate.objective import Problem
from calibrate.performers import Performer
from calibrate.spec import Bounds
from calibrate.targets import Target
from lab.experiments import PaddleThrust
from lab.published import figures
from lab.records import Record, Scalar
from lab.specimens import FinnedTube
from lab.specimens.finned_tube import LoadFin

Array = NDArray[np.float64]
#: Ids of the published figures, without and with load fin.
_IDS = {
    "lab": {
        "thrust_max": ("c4-thrust-max-nofin", "c4-thrust-max-fin"),
        "thrust_min": ("c4-thrust-min-nofin", "c4-thrust-min-fin"),
        "thrust_mean": ("c4-thrust-net-nofin", "c4-thrust-net-fin"),
    },
    "model": {
        "thrust_max": ("c4-sim-max-nofin", "c4-sim-max-fin"),
        "thrust_min": ("c4-sim-min-nofin", "c4-sim-min-fin"),
    },
}
CASES = ("without load fin", "with load fin")
#: The second stroke from rest: a fin that has not come to rest when the valve opens again is judged as it goes on.
STROKES = PaddleThrust(cycles=2, warm_up=1, samples_per_cycle=400)
#: "Not readily observed", and "buckling": ASSUMED angles of the distal part in recovery, rad.
STRAIGHT, BUCKLED = np.deg2rad(5.0), np.deg2rad(20.0)


def published(follows: Literal["lab", "model"]) -> list[dict[str, Scalar]]:
    """Peaks and, of the lab, means of thrust without and with load fin, N."""
    return [
        {name: Scalar(float(figures()[ids[case]]["value"]), "N") for name, ids in _IDS[follows].items()}
        for case in (0, 1)
    ]


def devices(specimen: FinnedTube) -> list[FinnedTube]:
    """The device without and with load fin: its own, or the one that is ASSUMED."""
    return [specimen.model_copy(update={"load_fin": load}) for load in (None, specimen.load_fin or LoadFin())]


def thrust_targets(specimen: FinnedTube, follows: Literal["lab", "model"]) -> list[Target]:
    """Published thrust of the device in both cases."""
    found = []
    for case, device, numbers in zip(CASES, devices(specimen), published(follows), strict=True):
        record = Record(
            "lab", f"published {follows}", device.model_dump(mode="json"), STROKES.model_dump(mode="json"),
            scalars=numbers,
        )  # fmt: skip
        found.append(Target(case, device, STROKES, record, tuple(numbers)))
    return found


@dataclass
class BucklingProblem(Problem):
    """A problem that also asks for what the text says of buckling.

    Two more residuals, zero where the bare fin stays within ``STRAIGHT`` and the loaded one goes beyond ``BUCKLED`` in
    recovery, else the angle that is missing (rad).
    """

    asked: bool = True

    @property
    def size(self) -> int:
        """Number of residuals N."""
        return super().size + 2

    def predictions(self, unit: Array) -> list[Array]:
        """Thrust of both cases, then their smallest buckling angle (p, 1, 1)."""
        self.evaluations += len(unit)
        values = self.space.values(unit)
        found = [np.full((len(unit), *block.reference.shape), np.nan) for block in self.blocks]
        angles = [np.full((len(unit), 1, 1), np.nan) for _ in self.targets]
        requests = [self._request(view, row) for row in values for view in self.views]
        responses = self.performer.run(requests)
        for place, response in enumerate(responses):
            candidate, number = divmod(place, len(self.views))
            if response is not None:
                view = self.views[number]
                read = view.read(response, view.numbers(values[candidate]))
                assert read is not None
                found[number][candidate] = read[0]
                angles[number][candidate] = response["buckling"].min()
        return [*found, *angles]

    def residuals_of(self, predictions: Sequence[Array], references: Sequence[Array] | None = None) -> Array:
        """Residuals of the thrust (p, N - 2), and of the buckling."""
        bare, loaded = (-prediction[:, 0, 0] for prediction in predictions[-2:])
        thrust = super().residuals_of(predictions[:-2], references)
        missing = np.stack([np.maximum(bare - STRAIGHT, 0.0), np.maximum(BUCKLED - loaded, 0.0)], axis=1)
        return np.column_stack([thrust, missing])


def thrust_problem(
    targets: Sequence[Target],
    free: Mapping[str, Bounds | None],
    performer: Performer,
    *,
    buckles: bool = False,
    mean_weight: float = 1.0,
) -> Problem:
    """Misfit of the thrust over its largest value, rms over all numbers; with what is said of buckling beside it."""
    problem = (BucklingProblem if buckles else Problem)(performer, targets, "relative", free)
    for number, block in enumerate(problem.blocks):
        means = np.array([[name == "thrust_mean"] for name in problem.views[block.target].names])
        problem.blocks[number] = replace(block, scale=np.where(means, block.scale / mean_weight, block.scale))
    return problem
