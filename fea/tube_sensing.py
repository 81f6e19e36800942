"""What is sensed at a pinched tube, and which states make its pictures."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fea.face_strains import face_strains
from fea.shell import Shell
from fea.tube import Tube
from lab.experiments.pinch_drive import STAGES
from lab.records import Channel, channels
from meshes.tube import pad_share

Array = NDArray[np.float64]


@dataclass
class Sensed:
    """Rows of the record as they come in."""

    tube: Tube
    stage: list[int] = field(default_factory=list)
    states: list[Array] = field(default_factory=list)
    _rows: list[dict[str, Array]] = field(default_factory=list)
    _work: float = 0.0

    def read(self, stage: str, state: Array, t: float) -> None:
        """Sense an accepted increment."""
        tube, problem = self.tube, self.tube.problem
        x = problem.displacement(state, t)
        tendons, load = tube.tendons, tube.block_load
        gap, contact = tube.touch(x)
        flexibility, negative = tube.flexibility(state, t)
        row = {
            "time": t,
            "travel": tendons.done(x),
            "force": tendons.joint_force(x, t),
            "pair_force": _padded(tendons.forces(x, t), tube.specimen.pairs),
            "shortening": _padded(tendons.shortening(x), tube.specimen.pairs),
            "gap": gap if np.isfinite(gap) else np.nan,
            "contact_force": contact,
            "pose": tube.pose(state, t),
            "section": tube.section(x),
            "flexibility": flexibility,
            "strain": self._largest_strain(x[: tube.part.nodes]),
            "load": load.total(x, t),
            "pushed": load.moved(x),
            "energy": tube.copies * float(tube.part.strain_energy(x[: tube.part.nodes]).sum()),
            "unstable": negative,
        }
        self.stage.append(STAGES.index(stage))
        self.states.append(x[: tube.part.nodes].copy())
        self._rows.append({name: np.asarray(value) for name, value in row.items()})

    def largest_force(self, stage: str) -> float:
        """Largest F_p in a stage, N."""
        number = STAGES.index(stage)
        return max(float(r["force"]) for r, s in zip(self._rows, self.stage, strict=True) if s == number)

    def column(self, name: str) -> Array:
        """One quantity at all increments."""
        return np.array([row[name] for row in self._rows])

    def _largest_strain(self, x: Array) -> float:
        """Largest principal Green-Lagrange strain of the wall outside pads and transitions."""
        part, bare = self.tube.part, self._bare
        if isinstance(part, Shell):
            strain = face_strains(part, x, bare)
        else:
            voigt = part.strains(x)[bare] * [1, 1, 1, 0.5, 0.5, 0.5]
            strain = voigt[..., [[0, 3, 4], [3, 1, 5], [4, 5, 2]]]
        return float(np.linalg.eigvalsh(strain)[..., -1].max())

    @cached_property
    def _bare(self) -> NDArray[np.bool_]:
        part = self.tube.part
        return np.asarray((pad_share(self.tube.specimen, part.points) < 0.01)[part.cells].all(axis=1))

    def pictured(self) -> list[int]:
        """Increments for pictures: rest, half-way, the largest force before a touch, first touch, ends of stages."""
        stage = np.array(self.stage)
        ends = np.flatnonzero(np.diff(np.append(stage, -1)))
        chosen = {0, *ends.tolist()}
        pinching = np.flatnonzero(stage == STAGES.index("pinch"))
        touching = pinching[self.column("contact_force")[pinching] > 0]
        chosen |= set(touching[:1].tolist())
        before = pinching[pinching < touching[0]] if len(touching) else pinching
        if len(before):
            travel = self.column("travel")[before]
            chosen.add(int(before[self.column("force")[before].argmax()]))
            chosen.add(int(before[np.abs(travel - 0.5 * travel[-1]).argmin()]))
        return sorted(chosen)

    def channels(self) -> dict[str, Channel]:
        """Channels of the record, see ``lab.experiments.Pinch`` and ``PinchedBending``."""
        rows = ("increment",)

        def one(name: str, unit: str, words: str, *dims: str) -> Channel:
            return Channel(name, unit, self.column(name), (*rows, *dims), words)

        return channels(
            Channel("increment", "1", np.arange(len(self.stage)), rows, "number of the increment"),
            Channel("stage", "1", np.array(self.stage, dtype=np.int64), rows, f"one of {', '.join(STAGES)}, from 0"),
            one("time", "s", "time since rest"),
            one("travel", "m", "travel that F_p works on"),
            one("force", "N", "F_p"),
            one("pair_force", "N", "force of every pair's tendon", "pair"),
            one("shortening", "m", "shortening of the line between the pads of every pair", "pair"),
            one("gap", "m", "smallest gap between inner walls; NaN where far"),
            one("contact_force", "N", "contact force between inner walls"),
            one("pose", "m, rad", "pose of the distal block's face", "dof"),
            one("section", "m", "middle of the wall at mid-length", "place", "axis"),
            one("flexibility", "m/N, 1/N, rad/(N*m)",
                "change of the pose by a small wrench on the face's centre, tendons held", "dof", "dof_loaded"),
            one("strain", "1", "largest principal strain of the wall outside the pads"),
            one("load", "N", "force on the block's point along the direction"),
            one("pushed", "m", "motion of that point along the direction"),
            one("energy", "J", "elastic energy of the tube"),
            one("unstable", "1", "negative eigenvalues of the elastic tangent, tendons held; -1 unknown"),
        )  # fmt: skip


def _padded(values: Array, size: int) -> Array:
    return np.concatenate([values, np.zeros(size - len(values))])
