"""One static increment of a tube in a process of its own: ``_one_step.py ELEMENTS AROUND ALONG``; prints JSON."""

import json
import sys
from time import perf_counter

from fea import static
from tests.verification.devices import PinchedTube


def main(elements: str, around: str, along: str) -> None:
    case = PinchedTube().case(elements, int(around), int(along), 1e-4)
    begin = perf_counter()
    run = static(case, first=1.0)
    seconds = perf_counter() - begin
    problem, state = run.problem, run.state()
    times = []
    for _ in range(2):
        begin = perf_counter()
        right, _ = problem.linearise(state, 1.0)
        problem.solve(right)
        times.append(perf_counter() - begin)
    print(json.dumps({"unknowns": len(state), "increment": seconds, "step": min(times)}))


if __name__ == "__main__":
    main(*sys.argv[1:])
