"""Covariance and identifiability from the derivative of a residual."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
#: Singular values below this share of the largest count as zero.
_NEGLIGIBLE = 1e-9


@dataclass(frozen=True)
class Uncertainty:
    """Of p parameters.

    Parameters
    ----------
    standard_errors
        Relative to the values, (p,); infinite in directions that the residual does not see.
    correlation
        (p, p).
    condition
        Ratio of the extreme singular values of the derivative by the parameters' logarithms.
    """

    standard_errors: Array
    correlation: Array
    condition: float


def relative_uncertainty(derivative: Array, residual: Array) -> Uncertainty:
    """Uncertainty from the Gauss-Newton covariance s^2 (J^T J)^-1, s^2 = |r|^2 / (N - p).

    Takes the residual for independent noise of one size.  Errors of the model are neither, so that
    the intervals are too narrow where they dominate.

    Parameters
    ----------
    derivative
        Of the residual by the logarithms of the parameters, (N, p).
    residual
        At the optimum, (N,).
    """
    count, p = derivative.shape
    if count <= p:
        return Uncertainty(np.full(p, np.nan), np.eye(p), float("nan"))
    _, singular, directions = np.linalg.svd(derivative, full_matrices=False)
    seen = singular > _NEGLIGIBLE * singular[0]
    inverse = np.where(seen, 1.0 / np.where(seen, singular, 1.0), 0.0)
    half = directions.T * inverse
    covariance = half @ half.T * (residual @ residual) / (count - p)
    errors = np.sqrt(np.diag(covariance))
    # A parameter with a share in an unseen direction can take any value.
    unseen = (np.abs(directions[~seen]) > 1e-6).any(axis=0)
    safe = np.where(errors > 0.0, errors, 1.0)
    correlation = covariance / np.outer(safe, safe)
    np.fill_diagonal(correlation, 1.0)
    condition = float(singular[0] / singular[-1]) if seen.all() else float("inf")
    return Uncertainty(np.where(unseen, np.inf, errors), correlation, condition)
