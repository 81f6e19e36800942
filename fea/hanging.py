"""Where a motion begins: equilibria of a clamped part under its own weight and what hangs from it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fea.case import Case, stages
from fea.model import FeaModel
from fea.newton import Options
from fea.parts import Deformable
from fea.run import Run
from fea.statics import static
from lab.specimens import TwistedBeam

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Hung:
    """Equilibria of a part whose root is clamped.

    Parameters
    ----------
    run
        The static solution.
    rest
        Displacements under the own weight alone (nodes, 3), m; zero without it.
    hung
        The same with the load as well.
    weight
        Nodal forces of the own weight (nodes, 3), N.
    reason
        Empty, or why the load was not reached; ``hung`` is then as far as it went.
    """

    run: Run
    rest: Array
    hung: Array
    weight: Array
    reason: str = ""


def hang(
    part: Deformable, specimen: TwistedBeam, model: FeaModel, gravity: tuple[float, float, float] | None,
    load: Array | None = None,
) -> Hung:  # fmt: skip
    """Apply the own weight, where it counts, and then a load.

    Parameters
    ----------
    part
        The specimen in elements.
    specimen, model
        What its tip carries; solver and tolerance.
    gravity
        Acceleration that gravity gives the part and what its tip carries, m/s^2; None: left out.
    load
        Constant nodal forces (nodes, 3), N; at least one of the two is needed.
    """
    case = Case(part, solver=model.linear_solver).fix("root").mass("tip", specimen.tip_mass)
    levels = np.cumsum([1.0] * ((gravity is not None) + (load is not None)))
    if gravity is not None:
        case.gravity(gravity, stages((0.0, 0.0), (1.0, 1.0)))
    if load is not None:
        loading = stages((levels[-1] - 1.0, 0.0), (levels[-1], 1.0))
        for node in np.flatnonzero(load.any(axis=1)):
            case.force([int(node)], load[node], loading)
    run = static(case, levels, options=Options(tolerance=model.tolerance))
    at_rest = np.zeros_like(part.points)
    rest = run.field(1) if gravity is not None and run.t[-1] >= 1.0 else at_rest
    weight = at_rest if gravity is None else np.outer(case.nodal_mass(), gravity)
    reason = ""
    if not run.completed:
        sags = gravity is not None and run.t[-1] < 1.0
        what, share = ("own weight", run.t[-1]) if sags else ("hanging load", run.t[-1] - levels[-1] + 1.0)
        reason = f"the {what} was reached to {100 * share:.3g} % only: {run.reason}"
    return Hung(run, rest, run.field(), weight, reason)
