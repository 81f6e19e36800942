"""Arms of pinched tubes in series: each is open, or a hinge about an axis that its pinch chooses (chapter 8).

Tube k's distal block carries the next one.  Gravity pulls at walls, blocks and payload; a cable through holes in all
blocks may pull as well.  Tubes are straight while they are pinched and bend about their hinges only.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

import mujoco
import numpy as np
from numpy.typing import NDArray

from lab.specimens import PinchedTube
from prb.arm_statics import Cable, Pull, settled
from prb.mechanism import Link, Mechanism, Vector
from prb.model import PrbModel
from prb.mujoco_model import build_spec, compile_mechanism, write_mechanism
from prb.statics import Chain, Load, NotConverged

Array = NDArray[np.float64]
#: What a tube is: open (None), or closed at this pinch angle, rad.
Choice = float | None

__all__ = ["Arm", "Cable", "Choice", "Pose"]


@dataclass(frozen=True)
class Arm:
    """Equal tubes in series on a clamp; z runs along the straight arm.

    Parameters
    ----------
    tube, model
        One tube, and its model with the curves of a fit of kind hinge.
    count
        Tubes.
    block_mass, payload
        Of each distal block, which stands for servos, and at the tip, kg.
    gravity
        m/s^2; along -y it loads a horizontal arm as the text loads a tube.
    cable
        None: no cable.
    """

    tube: PinchedTube
    model: PrbModel
    count: int = 3
    block_mass: float = 0.0
    payload: float = 0.0
    gravity: Vector = (0.0, -9.81, 0.0)
    cable: Cable | None = None

    def __post_init__(self) -> None:
        if self.count < 1:
            raise ValueError(f"count {self.count} must be at least 1")
        if min(self.block_mass, self.payload) < 0:
            raise ValueError(f"block_mass {self.block_mass:g} kg and payload {self.payload:g} kg must not be negative")
        if self.cable and not 0.0 <= self.cable.radius <= self.tube.radius:
            raise ValueError(f"cable radius {self.cable.radius:g} m must lie within the block, {self.tube.radius:g} m")

    def mechanism(self, choices: Sequence[Choice]) -> Mechanism:
        """Links of the arm for a choice of every tube, from the clamp to the tip; the arm starts at a block's face.

        Raises
        ------
        ValueError
            For a wrong number of choices, or a pinch angle without a fit behind it.
        """
        if len(choices) != self.count:
            raise ValueError(f"{len(choices)} choices for {self.count} tubes")
        links: list[Link] = []
        block = self.tube.block_length
        for number, choice in enumerate(choices):
            proximal, distal = self._halves[choice] if choice in self._halves else self._learned(choice)
            first = number == 0
            links += [
                replace(
                    proximal, name=f"proximal{number}", length=proximal.length + (0.0 if first else block),
                    rotation=proximal.rotation if first else (0.0, 0.0, 0.0),
                ),
                replace(
                    distal, name=f"distal{number}", length=distal.length + block, mass=distal.mass + self.block_mass,
                    hinges=tuple(replace(h, name=f"{h.name}{number}") for h in distal.hinges), parent=None, place=None,
                ),
            ]  # fmt: skip
            links[-2] = replace(links[-2], parent=None, place=None)
        side = 2 * self.tube.radius
        return Mechanism(tuple(links), tip_mass=self.payload, tip_face=(side, side, 0.0))

    @cached_property
    def _halves(self) -> dict[Choice, tuple[Link, Link]]:
        return {}

    def _learned(self, choice: Choice) -> tuple[Link, Link]:
        """Both halves of a tube; an open one is that at the begin of any pinch."""
        curves = self.model.hinge
        if curves is None:
            if choice is not None:
                raise ValueError("a pinched tube needs a model with the curves of a fit of kind hinge")
            model = self.model
        else:
            if choice is not None and (reason := curves.refusal(choice)):
                raise ValueError(reason)
            state = curves.state(curves.tables[0].pinch_angle if choice is None else choice, float(choice is not None))
            model = self.model.pinched(state.parameters)
        proximal, distal = model.mechanism(self.tube).links
        self._halves[choice] = proximal, distal
        return proximal, distal

    def rest(self, choices: Sequence[Choice]) -> "Pose":
        """Equilibrium under gravity and cable; NotConverged where nothing stable bears them."""
        mechanism = self.mechanism(choices)
        return self._rest(mechanism, Chain(compile_mechanism(mechanism)))

    def _rest(self, mechanism: Mechanism, chain: Chain) -> "Pose":
        pull = None if self.cable is None else Pull(chain, self.cable, self._holes(mechanism))
        return Pose(chain, settled(chain, Load(np.zeros(3), None, np.array(self.gravity)), pull))

    def _holes(self, mechanism: Mechanism) -> list[tuple[int, Vector]]:
        """Link (-1: the clamp) and place in its frame of every hole: at the clamp, and at both faces of each block."""
        if self.cable is None:
            return []
        across, up = self.cable.radius * np.cos(self.cable.angle), self.cable.radius * np.sin(self.cable.angle)
        # A link's frame has x along the tube and z against the fixed x.
        found: list[tuple[int, Vector]] = [(-1, (across, up, 0.0))]
        for number, link in enumerate(mechanism.links):
            if number % 2:
                places = (link.length - self.tube.block_length, link.length)
                found += [(number, (place, up, -across)) for place in places]
        return found

    def workspace(self, options: Sequence[Choice]) -> tuple[list[tuple[Choice, ...]], Array]:
        """Tips (n, 3), m, over all combinations of ``options`` for the tubes; NaN where nothing stable stands."""
        combinations = list(product(options, repeat=self.count))
        tips = np.full((len(combinations), 3), np.nan)
        # All combinations share one compiled model, whose numbers are rewritten.
        model = compile_mechanism(self.mechanism(combinations[0]))
        data = mujoco.MjData(model)
        for place, choices in enumerate(combinations):
            mechanism = self.mechanism(choices)
            write_mechanism(model, data, mechanism, ())
            try:
                tips[place] = self._rest(mechanism, Chain(model, data)).tip
            except NotConverged:
                continue
        return combinations, tips

    def to_mjcf(self, choices: Sequence[Choice], time_step: float = 1e-4) -> str:
        """MJCF text with gravity, payload, and the cable as a tendon with a motor that pulls."""
        mechanism = self.mechanism(choices)
        spec = build_spec(mechanism, time_step=time_step)
        spec.modelname = "arm of pinched tubes"
        spec.option.gravity = list(self.gravity)
        if self.cable:
            tendon = spec.add_tendon(name="cable")
            for number, (body, place) in enumerate(self._holes(mechanism)):
                owner = spec.worldbody if body < 0 else spec.body(mechanism.links[body].name)
                owner.add_site(name=f"guide{number}", pos=place, size=[0.002] * 3)
                tendon.wrap_site(f"guide{number}")
            motor = spec.add_actuator(name="cable", target="cable", trntype=mujoco.mjtTrn.mjTRN_TENDON)
            motor.ctrlrange, motor.ctrllimited = [-self.cable.tension, 0.0], True
        spec.compile()
        return str(spec.to_xml())


@dataclass(frozen=True)
class Pose:
    """An arm at rest: its chain and joint coordinates (joints,), rad or m."""

    chain: Chain
    joints: Array

    @property
    def tip(self) -> Array:
        """Place of the last block's far face (3,), m."""
        return self.chain.tip(self.joints).position

    @property
    def line(self) -> Array:
        """Ends of all links in order, (n, 3), m."""
        return self.chain.nodes(self.joints)
