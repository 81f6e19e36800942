"""Direct solution of sparse symmetric systems behind one small interface."""

import importlib.metadata
import importlib.util
import os
import weakref
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from fea.pattern import Pattern

Array = NDArray[np.float64]


class SingularMatrixError(ArithmeticError):
    """The matrix could not be factorised or holds numbers that are not finite."""


class LinearSolver(Protocol):
    """Factorise once, solve often; the pattern stays."""

    name: str

    def factorise(self, data: Array) -> None:
        """Take the values (stored,) of the pattern's upper triangle."""

    def solve(self, right: Array) -> Array:
        """Solution for ``right`` (n,) or (n, m) with the last factorisation."""

    @property
    def negative_pivots(self) -> int | None:
        """Negative eigenvalues of the last matrix (Sylvester's law of inertia); None where they are not counted."""


class Pardiso:
    """MKL Pardiso, symmetric indefinite, symbolic analysis kept between factorisations."""

    name = "MKL Pardiso"
    _MTYPE = -2
    _ANALYSE, _FACTORISE, _SOLVE, _RELEASE = 11, 22, 33, -1
    #: Parameter that counts negative pivots, from 0.
    _NEGATIVE = 22

    def __init__(self, pattern: Pattern) -> None:
        _point_to_mkl()
        from pypardiso import PyPardisoSolver
        from pypardiso.pardiso_wrapper import PyPardisoError

        self._error = PyPardisoError
        self._pattern = pattern
        self._solver = PyPardisoSolver(mtype=self._MTYPE)
        self._matrix: Any = None
        # Own settings: nested dissection, scaled 1x1 and 2x2 pivots, and no iterative refinement,
        # which Newton's method does anyway and which costs two more solutions each time.
        for number, value in ((1, 1), (2, 2), (8, 0), (10, 8), (21, 1)):
            self._solver.iparm[number - 1] = value
        weakref.finalize(self, _release, self._solver)

    def factorise(self, data: Array) -> None:
        """See ``LinearSolver``."""
        from scipy.sparse import csr_matrix

        if not np.isfinite(data).all():
            raise SingularMatrixError("the matrix holds numbers that are not finite")
        n, nothing = self._pattern.size, np.zeros(self._pattern.size)
        fresh = self._matrix is None
        self._matrix = csr_matrix((data, self._pattern.indices, self._pattern.indptr), shape=(n, n))
        try:
            for phase in ([self._ANALYSE] if fresh else []) + [self._FACTORISE]:
                self._call(phase, nothing)
        except self._error as error:
            raise SingularMatrixError(str(error)) from None

    def solve(self, right: Array) -> Array:
        """See ``LinearSolver``."""
        return self._call(self._SOLVE, np.asfortranarray(right))

    @property
    def negative_pivots(self) -> int | None:
        """See ``LinearSolver``."""
        return int(self._solver.iparm[self._NEGATIVE]) if self._matrix is not None else None

    def _call(self, phase: int, right: Array) -> Array:
        self._solver.set_phase(phase)
        # The public ``factorize`` would analyse again: the phases are called one by one.
        return self._solver._call_pardiso(self._matrix, right)


def _point_to_mkl() -> None:
    """Tell pypardiso where MKL lies: it would search the whole environment, 0.4 s for every solver."""
    if "PYPARDISO_MKL_RT" not in os.environ:
        for file in importlib.metadata.files("mkl") or ():
            if file.name.startswith("libmkl_rt."):
                os.environ["PYPARDISO_MKL_RT"] = str(file.locate())


def _release(solver: Any) -> None:
    solver.free_memory(everything=True)


class SuperLU:
    """SciPy's SuperLU in symmetric mode; everywhere available."""

    name = "SciPy SuperLU"
    negative_pivots = None

    def __init__(self, pattern: Pattern) -> None:
        self._pattern = pattern
        self._factors: Any = None

    def factorise(self, data: Array) -> None:
        """See ``LinearSolver``."""
        from scipy.sparse.linalg import splu

        if not np.isfinite(data).all():
            raise SingularMatrixError("the matrix holds numbers that are not finite")
        try:
            self._factors = splu(
                self._pattern.full(data).tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0,
                options={"SymmetricMode": True},
            )  # fmt: skip
        except RuntimeError as error:
            raise SingularMatrixError(str(error)) from None

    def solve(self, right: Array) -> Array:
        """See ``LinearSolver``."""
        return self._factors.solve(np.ascontiguousarray(right))


SOLVERS: dict[str, type[Pardiso] | type[SuperLU]] = {"pardiso": Pardiso, "superlu": SuperLU}


def solver_class(kind: str) -> type[Pardiso] | type[SuperLU]:
    """Class of ``kind`` ``pardiso``, ``superlu`` or ``auto`` (Pardiso where it is installed)."""
    if kind == "auto":
        kind = "pardiso" if importlib.util.find_spec("pypardiso") else "superlu"
    if kind not in SOLVERS:
        raise ValueError(f"no linear solver {kind!r}; there are auto, {', '.join(SOLVERS)}")
    return SOLVERS[kind]


def make_solver(kind: str, pattern: Pattern) -> LinearSolver:
    """Solver of a kind, see ``solver_class``."""
    return solver_class(kind)(pattern)
