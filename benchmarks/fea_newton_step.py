"""A Newton step of a tube, assembly and factorisation, against the bare numeric factorisation of the same matrix."""

from importlib.util import find_spec
from time import perf_counter
from typing import Any

import numpy as np

from benchmarks._measure import row
from tests.verification.devices import PinchedTube


def rows() -> list[dict[str, Any]]:
    return step(60, 46)


def step(around: int, along: int, repeats: int = 5) -> list[dict[str, Any]]:
    problem = PinchedTube().case("hexahedra", around, along, 1e-3).problem()
    state = np.zeros_like(problem.rest)
    problem.linearise(state, 0.1)
    whole, bare, assembly, solution = [], [], [], []
    for _ in range(repeats):  # in turn, so that what else goes on hits all alike
        clock = [perf_counter()]
        problem.linearise(state, 0.1)
        clock.append(perf_counter())
        _, data = problem.stiffness(state, 0.1)
        clock.append(perf_counter())
        again(problem, data)
        clock.append(perf_counter())
        problem.solve(np.ones_like(state))
        clock.append(perf_counter())
        for times, begin, end in zip((whole, assembly, bare, solution), clock[:-1], clock[1:], strict=True):
            times.append(end - begin)
    name, least = problem.linear.name, [min(times) for times in (whole, bare, assembly, solution)]
    what = f"{len(state)} unknowns, {len(problem.parts[0].cells)} hexahedra"
    return [
        row(f"assembly and factorisation, {what}", least[0], "s", "< 1.5", f"{name}, numeric factorisation alone",
            least[1], least[0] / least[1]),
        row(f"assembly, {what}", least[2], "s"),
        row(f"back-substitution, {what}", least[3], "s"),
    ]  # fmt: skip


def again(problem: Any, data: np.ndarray) -> None:
    """Numeric factorisation and nothing else; the matrix is already there."""
    if find_spec("pypardiso"):
        problem.linear._call(problem.linear._FACTORISE, np.zeros(len(problem.rest)))
    else:
        problem.linear.factorise(data)
