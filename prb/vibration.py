"""Small vibrations of a mechanism about slack springs."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from prb.mechanism import Hinge, Mechanism
from prb.release import inertia_at
from prb.statics import Chain

Array = NDArray[np.float64]
_ROUNDS, _SETTLED = 30, 1e-12
#: Joint motion over which the springs' stiffness is taken, rad or m.
_STEP = 1e-6
#: Share of the slowest mode's squared period below which a motion counts as one without mass.
_MASSLESS = 1e-10


@dataclass(frozen=True)
class Modes:
    """Undamped modes, slowest first.

    Parameters
    ----------
    frequencies
        (modes,), Hz.
    damping_ratios
        Of the dampers and branches in each mode, which they are taken not to change, (modes,).
    shapes
        Joint coordinates of each mode, of unit modal mass, (modes, joints), rad or m over sqrt(kg) m.
    """

    frequencies: Array
    damping_ratios: Array
    shapes: Array


def vibrations(mechanism: Mechanism, chain: Chain, count: int) -> Modes:
    """The ``count`` slowest modes; fewer of a mechanism that has fewer.

    A mode of frequency w is that of the mechanism with the springs' storage stiffness at w (Maxwell branches are
    partly stiff).  Motions without mass, as of two parallel hinges at one place, are no modes: there the springs
    give way in series.

    Parameters
    ----------
    mechanism
        All its joints move (see ``Mechanism.in_motion``), and each is held by a spring at rest (``is_sprung``).
    chain
        Of the same mechanism.
    """
    found = list(islice(_modes(mechanism, chain), count))
    frequencies, ratios, shapes = (np.array([mode[i] for mode in found]) for i in range(3))
    return Modes(frequencies, ratios, shapes.reshape(-1, len(mechanism.hinges)))


def _modes(mechanism: Mechanism, chain: Chain) -> Iterator[tuple[float, float, Array]]:
    """Frequency (Hz), damping ratio and shape (joints,) of every mode."""
    hinges, ties = mechanism.hinges, _tie_damping(mechanism)
    mass = inertia_at(chain.model, chain.data, chain.laws.with_hidden(chain.slack))[: len(hinges), : len(hinges)]
    relaxed = _relaxed_stiffness(chain)
    for number in range(len(hinges)):
        turning, before = 0.0, np.inf
        for _ in range(_ROUNDS):
            storage, loss = _storage_and_loss(hinges, turning)
            squares, shapes = _eigen(relaxed + np.diag(storage), mass)
            if number >= len(squares):
                return
            if abs(turning - before) <= _SETTLED * turning:
                break
            turning, before = float(np.sqrt(squares[number])), turning
        shape = shapes[:, number]
        yield turning / (2.0 * np.pi), float(shape @ (ties + np.diag(loss)) @ shape) / (2.0 * turning), shape


def _eigen(stiffness: Array, mass: Array) -> tuple[Array, Array]:
    """Squares of the angular frequencies (n,), rad^2/s^2, ascending, and shapes (joints, n) of unit modal mass."""
    # The inverse problem: the mass may be singular, the stiffness not.
    half = np.linalg.cholesky(stiffness)
    inverse, vectors = np.linalg.eigh(np.linalg.solve(half, np.linalg.solve(half, mass).T))
    shapes = np.linalg.solve(half.T, vectors)
    kept = np.flatnonzero(inverse > _MASSLESS * inverse[-1])[::-1]
    return 1.0 / inverse[kept], shapes[:, kept] / np.sqrt(inverse[kept])


def _relaxed_stiffness(chain: Chain) -> Array:
    """Derivative of the springs' torques at rest, (joints, joints); the mean of both sides at a knee."""
    steps = _STEP * np.eye(chain.laws.count)
    return np.array(
        [(chain.laws.torque(chain.slack + e) - chain.laws.torque(chain.slack - e)) / (2.0 * _STEP) for e in steps]
    ).T


def _tie_damping(mechanism: Mechanism) -> Array:
    """Damping matrix of the ties, (joints, joints)."""
    numbers = {hinge.name: number for number, hinge in enumerate(mechanism.hinges)}
    damping = np.zeros((len(numbers), len(numbers)))
    for tie in mechanism.ties:
        shares = np.zeros(len(numbers))
        for joint, share in tie.shares:
            shares[numbers[joint]] += share
        damping += tie.damping * np.outer(shares, shares)
    return damping


def _storage_and_loss(hinges: Sequence[Hinge], turning: float) -> tuple[Array, Array]:
    """Stiffness that the branches add at an angular frequency (rad/s), and damping with the dampers, (joints,) each."""
    storage, loss = np.zeros(len(hinges)), np.array([hinge.damping for hinge in hinges])
    for joint, hinge in enumerate(hinges):
        for branch in hinge.branches:
            square = (turning * branch.time) ** 2
            storage[joint] += branch.stiffness * square / (1.0 + square)
            loss[joint] += branch.stiffness * branch.time / (1.0 + square)
    return storage, loss
