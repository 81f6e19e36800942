"""Natural vibrations about a state, and linear buckling: the lowest eigenpairs by shift-invert Lanczos."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.linalg import LinearOperator, eigsh

from fea.linear import LinearSolver, SingularMatrixError, make_solver
from fea.pattern import Pattern

Array = NDArray[np.float64]

#: Shift below zero as a share of the highest eigenvalue: free bodies keep a matrix that can be factorised.
_SHIFT = 1e-10
#: Rigid motions are slower than this share of the fastest mode found, and their eigenvalue is rounding.
_RIGID, _ROUNDING = 1e-3, 1e-12


@dataclass(frozen=True)
class Modes:
    """Natural vibrations, slowest first.

    Parameters
    ----------
    frequencies
        (modes,), Hz; 0 for rigid motions, negative for motions that grow as exp(2 pi |f| t): the state is unstable.
    shapes
        (modes, n), of unit modal mass, 1/sqrt(kg).
    missed
        Modes below the highest one found that are not among them, by the count of negative pivots; None where the
        solver does not count them.
    """

    frequencies: Array
    shapes: Array
    missed: int | None = None


@dataclass(frozen=True)
class BucklingModes:
    """Load factors, smallest first, and shapes (modes, n) whose largest displacement is 1 m.

    ``missed`` as in ``Modes``.
    """

    factors: Array
    shapes: Array
    missed: int | None = None


def natural_modes(
    pattern: Pattern, stiffness: Array, mass: Array, count: int, shift: float | None = None, solver: str = "auto"
) -> Modes:
    """Lowest ``count`` natural vibrations of K phi = (2 pi f)^2 M phi.

    Parameters
    ----------
    pattern
        Of both matrices.
    stiffness, mass
        Values (stored,), N/m and kg.  The stiffness at a deformed state gives the prestressed vibrations.
    count
        How many.
    shift
        Square of the angular frequency, 1/s^2, about which to look.  None: a little below zero, so that bodies
        that move freely keep a matrix that can be factorised.
    solver
        See ``fea.linear.make_solver``.
    """
    _check_count(count, pattern.size)
    fastest = _fastest(pattern, stiffness, mass)
    if shift is None:
        shift = -_SHIFT * fastest
    linear = make_solver(solver, pattern)
    linear.factorise(stiffness - shift * mass)
    full_stiffness, full_mass = pattern.full(stiffness), pattern.full(mass)
    squares, shapes = _eigenpairs(full_stiffness, full_mass, count, shift, linear.solve)
    order = np.argsort(squares)
    squares, shapes = squares[order], shapes.T[order]
    shapes /= np.sqrt(np.einsum("mi,mi->m", shapes, (full_mass @ shapes.T).T))[:, None]
    rigid = np.abs(squares) < min(_RIGID**2 * np.abs(squares).max(), _ROUNDING * fastest)
    frequencies = np.where(rigid, 0.0, np.sign(squares) * np.sqrt(np.abs(squares)) / (2 * np.pi))
    missed = _missed(linear, lambda at: stiffness - at * mass, squares)
    return Modes(frequencies, shapes, missed)


def buckling(pattern: Pattern, stiffness: Array, geometric: Array, count: int, solver: str = "auto") -> BucklingModes:
    """Smallest positive load factors of (K + factor Kg) phi = 0.

    Parameters
    ----------
    pattern
        Of both matrices.
    stiffness
        At rest (stored,), N/m.
    geometric
        What the reference load adds to it, (stored,), N/m: (K at a small load - K) / (its share of the load).
    count
        How many.
    solver
        See ``fea.linear.make_solver``.
    """
    _check_count(count, pattern.size)
    linear = make_solver(solver, pattern)
    linear.factorise(stiffness)
    full_stiffness = pattern.full(stiffness)
    # -Kg phi = mu K phi with mu = 1 / factor: the largest mu are the smallest positive factors.
    inverse = _operator(pattern.size, linear.solve)
    found, shapes = eigsh(
        -pattern.full(geometric), count, full_stiffness, which="LA", Minv=inverse, v0=_start(pattern.size)
    )
    order = np.argsort(-found)
    found, shapes = found[order], shapes.T[order]
    if not (found > 0.0).any():
        raise ValueError("this load buckles nothing: no positive load factor; reverse the load or check its size")
    shapes = shapes[found > 0.0]
    factors = 1.0 / found[found > 0.0]
    shapes = shapes / np.abs(shapes).max(axis=1, keepdims=True)
    missed = _missed(linear, lambda at: stiffness + at * geometric, factors)
    return BucklingModes(factors, shapes, missed)


def _check_count(count: int, size: int) -> None:
    if not 1 <= count < size:
        raise ValueError(f"between 1 and {size - 1} modes of {size} unknowns can be asked for, not {count}")


def _start(size: int) -> Array:
    """Start vector without symmetry, the same every time."""
    return np.random.default_rng(0).standard_normal(size)


def _operator(size: int, apply: Callable[[Array], Array]) -> LinearOperator:
    return LinearOperator((size, size), matvec=lambda x: apply(np.ravel(x)).ravel(), dtype=float)


def _fastest(pattern: Pattern, stiffness: Array, mass: Array) -> float:
    """Order of the highest eigenvalue, 1/s^2, by Rayleigh's quotients of single unknowns."""
    diagonal = pattern.indptr[:-1]
    return float(np.max(np.abs(stiffness[diagonal]) / mass[diagonal]))


def _eigenpairs(
    stiffness: csr_array, mass: csr_array, count: int, shift: float, solve: Callable[[Array], Array]
) -> tuple[Array, Array]:
    size = mass.shape[0]
    if count > size - 2 or size < 60:
        from scipy.linalg import eigh

        values, shapes = eigh(stiffness.toarray(), mass.toarray())
        return values[:count], shapes[:, :count]
    # Room beyond ARPACK's default: clusters and double modes of symmetric plates need it.
    basis = min(size - 1, max(2 * count + 10, 30))
    return eigsh(
        stiffness, count, mass, sigma=shift, OPinv=_operator(size, solve), ncv=basis, v0=_start(size), tol=1e-11
    )


def _missed(linear: LinearSolver, matrix_at: Callable[[float], Array], values: Array) -> int | None:
    """Eigenvalues below the highest of ``values`` (ascending) that are not among them (Sylvester's law of inertia)."""
    # Just below the highest: a pair of equal ones may have been cut in two.
    edge = float(values[-1]) - 1e-6 * abs(float(values[-1]))
    try:
        linear.factorise(matrix_at(edge))
    except SingularMatrixError:
        return None
    below = linear.negative_pivots
    return None if below is None else below - int(np.count_nonzero(values < edge))
