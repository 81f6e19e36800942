"""A clamped shell in a dozen numbers: projection onto shapes of its own motion, exact in all but the choice of shapes.

Saint Venant-Kirchhoff's energy e'H e/2 is a quartic polynomial, since the sampled strains e are quadratic in the
displacement.  In u = V q the strains are linear in the monomials z = (q_i, q_i q_j), so the energy is z'G z/2 with a
constant G, which is factorised once: G = R'R, directions that carry no energy dropped.  Kelvin-Voigt stress is
linear in e and its rate, so the same G damps; the difference quotients are those of the full model.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fea import foresight
from fea import reduced_stepping as stepping
from fea.materials import LAWS, SAINT_VENANT_KIRCHHOFF
from fea.modes import natural_modes
from fea.shell_motion import Acceleration, ShellMotion, Trajectory
from fea.shell_stepping import INSTANTS
from lab.experiments.shaking import SmoothShake

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

#: Directions with less than this share of the largest energy, at the size they have in the snapshots, are dropped.
_ENERGY = 1e-10


def shaken(
    motion: ShellMotion, amplitude: tuple[float, float, float], frequencies: Sequence[float], duration: float = 0.6,
    step: float = 1e-3,
) -> Array:  # fmt: skip
    """Snapshots (snapshots, nodes, 3), m, of the full model shaken from rest at each of the ``frequencies``, Hz.

    Raises
    ------
    ArithmeticError
        Where the full model stops.
    """
    snapshots = []
    for frequency in frequencies:
        shake = SmoothShake(amplitude, frequency)
        run = motion.run(step, round(duration / step) + 1, base=shake.acceleration)
        if run.stopped:
            raise ArithmeticError(f"training at {frequency:g} Hz: {run.stopped}")
        snapshots.append(run.displacement[1:])
    return np.concatenate(snapshots)


def proper_shapes(motion: ShellMotion, snapshots: Array, count: int) -> Array:
    """Shapes (nodes, 3, count) that hold most of the ``snapshots`` (snapshots, nodes, 3), of unit modal mass.

    Proper orthogonal decomposition where the size of a displacement is its strain energy at rest plus the kinetic
    energy that it has at the first natural frequency: stiff, small components count as they do in the equations.
    """
    shell, free = motion.shell, motion.free
    pattern, taken = shell.pattern.restrict(free)
    stiffness = shell.tangent(np.zeros((shell.nodes, 3)))[1][taken]
    mass = shell.mass(motion.on_boundary)[taken]
    first = natural_modes(pattern, stiffness, mass, 1).frequencies[0]
    full_mass = pattern.full(mass)
    metric = pattern.full(stiffness + (2 * np.pi * first) ** 2 * mass).toarray()
    root = np.linalg.cholesky(metric)
    scaled = root.T @ snapshots.reshape(len(snapshots), -1)[:, free].T
    energy, directions = np.linalg.eigh(scaled @ scaled.T)
    if not 1 <= count <= np.count_nonzero(energy > 1e-14 * energy[-1]):
        raise ValueError(f"{len(snapshots)} snapshots do not hold {count} independent shapes")
    shapes = np.linalg.solve(root.T, directions[:, ::-1][:, :count])
    shapes = np.linalg.solve(np.linalg.cholesky(shapes.T @ (full_mass @ shapes)), shapes.T).T
    result = np.zeros((3 * shell.nodes, count))
    result[free] = shapes
    return result.reshape(shell.nodes, 3, count)


@dataclass(frozen=True)
class Reduction:
    """Full model and reduced equations.

    Parameters
    ----------
    motion
        The full model; Saint Venant-Kirchhoff.
    shapes
        (nodes, 3, r), 1/sqrt(kg), orthonormal with the mass.
    equations
        See ``fea.reduced_stepping``.
    """

    motion: ShellMotion
    shapes: Array
    equations: stepping.Reduced

    def run(
        self, interval: float, count: int, substeps: int = 1, base: Acceleration | None = None,
        u: Array | None = None, v: Array | None = None, kept: Ints | None = None,
    ) -> Trajectory:  # fmt: skip
        """What ``ShellMotion.run`` does; starts are projected onto the shapes."""
        step, r = interval / substeps, self.shapes.shape[2]
        instants = (step / INSTANTS) * np.arange(INSTANTS * substeps * (count - 1) + 1, dtype=np.float64)
        pushed = np.zeros((1, 3)) if base is None else np.ascontiguousarray(base(instants), dtype=np.float64)
        q, speed = self._projected(u), self._projected(v)
        scheme = self.motion.scheme
        past = scheme.viscous_time * _rates(q, speed)
        numbers, energies = np.empty((count, r)), np.empty((count, 2))
        done = stepping.run(
            self.equations, scheme, foresight.trail(r), q, speed, np.zeros(r), past, step, substeps, INSTANTS,
            pushed, numbers, energies,
        )  # fmt: skip
        numbers, times = numbers[:done], interval * np.arange(done, dtype=np.float64)
        stopped = "" if done == count else f"no equilibrium of forces after {times[-1]:.6g} s"
        sampled = pushed[:: INSTANTS * substeps][:done] if len(pushed) > 1 else np.zeros((done, 3))
        force = self.equations.load - sampled @ self.equations.push.T
        gains = np.einsum("sr,sr->s", 0.5 * (force[1:] + force[:-1]), np.diff(numbers, axis=0))
        shapes = self.shapes if kept is None else self.shapes[kept]
        displacement = (numbers @ shapes.reshape(-1, r).T).reshape(done, -1, 3)
        kinetic, strain = energies[:done].T.copy()
        return Trajectory(times, displacement, kinetic, strain, np.cumsum([0.0, *gains]), stopped)

    def _projected(self, nodal: Array | None) -> Array:
        free, r = self.motion.free, self.shapes.shape[2]
        if nodal is None:
            return np.zeros(r)
        return self.shapes.reshape(-1, r)[free].T @ (self.motion.mass @ np.asarray(nodal).reshape(-1)[free])


def reduced(motion: ShellMotion, snapshots: Array, count: int = 10) -> Reduction:
    """Reduced model of ``motion`` in ``count`` shapes of its ``snapshots`` (snapshots, nodes, 3), m.

    Raises
    ------
    ValueError
        For another law than Saint Venant-Kirchhoff, or snapshots that hold too few shapes.
    """
    if LAWS[motion.shell.material.law] != SAINT_VENANT_KIRCHHOFF:
        raise ValueError(
            f"only Saint Venant-Kirchhoff's energy is a polynomial, not that of {motion.shell.material.law}"
        )
    shapes = proper_shapes(motion, snapshots, count)
    system, flat = motion.system, shapes.reshape(-1, count)
    numbers = snapshots.reshape(len(snapshots), -1)[:, motion.free] @ (motion.mass @ flat[motion.free])
    equations = stepping.Reduced(
        _strain_factors(motion, shapes, numbers),
        np.ascontiguousarray(flat[system.unknowns].T @ system.carried), flat[system.unknowns].T @ system.load,
    )  # fmt: skip
    return Reduction(motion, shapes, equations)


def _strain_factors(motion: ShellMotion, shapes: Array, numbers: Array) -> Array:
    """R (k, m) of the energy |R z|^2 / 2, exact where ``numbers`` (snapshots, r) have been."""
    strains = _monomial_strains(motion, shapes)
    stiffness = np.einsum(
        "eam,eab,ebn->mn", strains, motion.system.elements.stiffness, strains, optimize=True
    )  # fmt: skip
    pairs = np.triu_indices(numbers.shape[1])
    size = np.sqrt((np.hstack([numbers, numbers[:, pairs[0]] * numbers[:, pairs[1]]]) ** 2).mean(axis=0))
    energy, directions = np.linalg.eigh(stiffness * size[:, None] * size)
    kept = energy > _ENERGY * energy[-1]
    return np.ascontiguousarray((directions[:, kept] * np.sqrt(energy[kept])).T / size)


def _monomial_strains(motion: ShellMotion, shapes: Array) -> Array:
    """Sampled strains (elements, 53, m) for unit monomials of the ``shapes``."""
    count, shell = shapes.shape[2], motion.shell
    # Strains are a quadratic without constant: its coefficients follow from few values, at sizes of 1 mm.
    size = 1e-3 / np.abs(shapes).max(axis=(0, 1))
    scaled = shapes * size
    ahead = [shell.strains(scaled[..., i]) for i in range(count)]
    behind = [shell.strains(-scaled[..., i]) for i in range(count)]
    squares = [0.5 * (a + b) for a, b in zip(ahead, behind, strict=True)]
    columns = [0.5 * (a - b) / s for a, b, s in zip(ahead, behind, size, strict=True)]
    for i in range(count):
        for j in range(i, count):
            column = squares[i]
            if i != j:
                both = scaled[..., i] + scaled[..., j]
                column = 0.5 * (shell.strains(both) + shell.strains(-both)) - squares[i] - squares[j]
            columns.append(column / (size[i] * size[j]))
    return np.stack(columns, axis=-1)


def _rates(q: Array, speed: Array) -> Array:
    """Rate of the monomials."""
    rates = np.outer(q, speed) + np.outer(speed, q)
    np.fill_diagonal(rates, 2.0 * q * speed)
    return np.concatenate([speed, rates[np.triu_indices(len(q))]])
