"""The pinch of a tube in a process of its own: ``_pinch.py hexahedra AROUND ALONG TRAVEL``; prints JSON."""

import json
import sys

from fea import static
from tests.verification.devices import PinchedTube

#: First increment, the same as CalculiX gets.
FIRST = 0.25


def main(elements: str, around: str, along: str, travel: str) -> None:
    case = PinchedTube().case(elements, int(around), int(along), float(travel))
    run = static(case, first=FIRST)
    told = {key: value for key, value in run.history.items() if key != "per_increment"}
    force = float(-run.reaction("stamp")[-1, 2])
    print(json.dumps({"force": force, "status": run.status, "solution": run.wall_time, **told}))


if __name__ == "__main__":
    main(*sys.argv[1:])
