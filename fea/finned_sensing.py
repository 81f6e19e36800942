"""What is sensed at a tube with fins."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fea.face_strains import face_strains
from fea.finned_device import Device
from fea.parts import Deformable
from fea.pictures import fields, together
from lab.experiments.fin_drive import FIN_STAGES
from lab.records import Channel, Fields, channels

Array = NDArray[np.float64]


@dataclass
class Sensed:
    """Rows of the record as they come in."""

    device: Device
    stage: list[int] = field(default_factory=list)
    states: list[Array] = field(default_factory=list)
    _rows: list[dict[str, Array]] = field(default_factory=list)

    def read(self, stage: str, state: Array, t: float) -> None:
        """Sense an accepted increment."""
        device = self.device
        x = device.problem.displacement(state, t)
        row = {
            "travel": device.approach(x),
            "force": device.pinch_force(state, t),
            "pressure": device.pressure(t),
            "p": device.fin.moved(x, device.corner)[0],
            "tip": self._tip_middle(x),
            "fin_y": float(-device.fin.moved(x, self._upper)[:, 1].min()),
            "section": device.section(x),
            "fin_radius": self._fin_radius(x),
            "fin_angle": self._fin_angle(x),
            "gap": device.gap(x),
            "energy": device.copies * sum(float(part.strain_energy(u).sum()) for part, u in self._of_parts(x)),
            "strain": max(largest_strain(part, u) for part, u in self._of_parts(x)),
        }
        if device.plate is not None:
            pressing = (2 if "y" in device.mirrors else 1) * device.plate.pressing(x, t)
            along = device.plate.place(x, t) - device.specimen.crown_along
            row |= {"grip_force": row["force"], "force": pressing, "push": device.plate.way(t), "contact": along}
        self.stage.append(FIN_STAGES.index(stage))
        self.states.append(x[: len(device.points)].copy())
        self._rows.append({name: np.asarray(value, dtype=float) for name, value in row.items()})

    def column(self, name: str) -> Array:
        """One quantity at all increments."""
        return np.array([row[name] for row in self._rows])

    def pictures(self) -> Fields:
        """The states that ``pictured`` chooses, of all parts."""
        shown = self.pictured()
        states = [self._of_parts(self.states[n]) for n in shown]
        values = [float(n) for n in shown]
        return together(
            [fields(part, values, [state[i][1] for state in states]) for i, part in enumerate(self.device.parts)]
        )

    def _of_parts(self, x: Array) -> list[tuple[Deformable, Array]]:
        """Every part with its nodes' share of displacements (N, 3)."""
        return [(part, x[place]) for part, place in zip(self.device.parts, self.device.problem.places, strict=True)]

    @cached_property
    def _upper(self) -> NDArray[np.int64]:
        """Surface nodes of the fin with y > 0."""
        return np.flatnonzero(self.device.fin.mid[:, 1] > 0.0)

    def _tip_middle(self, x: Array) -> Array:
        return np.asarray(self.device.fin.moved(x, self.device.crown[-1:])[0])

    def _fin_angle(self, x: Array) -> float:
        along = np.diff(self.device.fin.now(x, self.device.crown[[0, -1]]), axis=0)[0]
        return float(np.arctan2(along[0], along[2]))

    def _fin_radius(self, x: Array) -> float:
        tip = self.device.fin.now(x, self.device.tip)
        if "y" in self.device.mirrors:
            tip = np.concatenate([tip[:0:-1] * [1.0, -1.0, 1.0], tip])
        return fitted_radius(tip)

    def pictured(self) -> list[int]:
        """Increments for pictures: rest, half-way, ends of stages, the largest force of the plate."""
        stage = np.array(self.stage)
        chosen = {0, *np.flatnonzero(np.diff(np.append(stage, -1))).tolist()}
        for number in range(1, len(FIN_STAGES)):
            during = np.flatnonzero(stage == number)
            chosen |= set(during[len(during) // 2 : len(during) // 2 + 1].tolist())
        if self.device.plate is not None:
            chosen.add(int(self.column("force").argmax()))
        return sorted(chosen)

    def channels(self) -> dict[str, Channel]:
        """Channels of the record, see ``lab.experiments.ShapePropagation`` and ``FinPush``."""
        rows = ("increment",)

        def one(name: str, unit: str, words: str, *dims: str) -> Channel:
            return Channel(name, unit, self.column(name), (*rows, *dims), words)

        common = [
            Channel("increment", "1", np.arange(len(self.stage)), rows, "number of the increment"),
            one("travel", "m", "approach of top and bottom at mid-length"),
            one("pressure", "Pa", "in the chambers, over outside"),
            one("p", "m", "displacement of P", "axis"),
            one("tip", "m", "displacement of the middle of the tip", "axis"),
            one("fin_y", "m", "largest motion of the fin's upper half towards the x-z plane"),
            one("section", "m", "middle of the wall at mid-length", "place", "plane_axis"),
            one("fin_radius", "m", "circle that fits the tip's edge"),
            one("fin_angle", "rad", "fin's crown from the tube's axis"),
            one("gap", "m", "smallest between inner walls"),
            one("energy", "J", "elastic energy of the device"),
            one("strain", "1", "largest principal strain"),
        ]
        if self.device.plate is None:
            return channels(*common, one("force", "N", "of the pinch on one side"))
        return channels(
            *common,
            Channel(
                "stage", "1", np.array(self.stage, dtype=np.int64), rows, f"one of {', '.join(FIN_STAGES)}, from 0"
            ),
            one("force", "N", "of the plate along its way"),
            one("grip_force", "N", "of the pinch on one side"),
            one("push", "m", "way of the plate from first touch"),
            one("contact", "m", "where the plate's force acts, from the crease along the crown; NaN: nowhere"),
        )


def fitted_radius(points: Array) -> float:
    """Radius, m, of the circle that fits points (n, 3), m, in their plane by least squares; infinite for a line."""
    arms = points - points.mean(axis=0)
    _, _, axes = np.linalg.svd(arms, full_matrices=False)
    u, v = arms @ axes[0], arms @ axes[1]
    scale = float(np.abs(u).max())
    if np.abs(v).max() < 1e-9 * scale:
        return float("inf")
    matrix = np.column_stack([2 * u, 2 * v, np.full(len(u), scale)]) / scale
    a, b, c = np.linalg.lstsq(matrix, (u**2 + v**2) / scale, rcond=None)[0]
    return float(np.sqrt(c * scale + a**2 + b**2))


def largest_strain(part: Deformable, x: Array) -> float:
    """Largest principal Green-Lagrange strain on the faces of a sheet at displacements (nodes, 3), m."""
    return float(np.linalg.eigvalsh(face_strains(part, x))[..., -1].max())
