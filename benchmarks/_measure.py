"""Clocks, processes and rows that the benchmarks share."""

import json
import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter, process_time
from typing import Any

ROOT = Path(__file__).resolve().parent.parent


def row(
    name: str, value: float | None, unit: str = "", goal: str = "", peer: str = "", peer_value: float | None = None,
    ratio: float | None = None,
) -> dict[str, Any]:  # fmt: skip
    return {
        "name": name, "value": value, "unit": unit, "peer": peer, "peer_value": peer_value, "ratio": ratio,
        "goal": goal,
    }  # fmt: skip


def against(
    name: str, seconds: float, peer: str, peer_seconds: float | None, goal: str = "", install: str = ""
) -> dict[str, Any]:
    """Row of two times; the ratio says how many times faster ours is, and an absent peer how to get it."""
    if peer_seconds is None:
        return row(name, seconds, "s", goal, f"{peer}: missing; {install}")
    return row(name, seconds, "s", goal, peer, peer_seconds, peer_seconds / seconds)


def best_of(work: Callable[[], object], repeats: int = 5, clock: Callable[[], float] = perf_counter) -> float:
    """Shortest time of some runs, s: other programs only ever add to it."""
    times = []
    for _ in range(repeats):
        begin = clock()
        work()
        times.append(clock() - begin)
    return min(times)


def processor_time(work: Callable[[], object], repeats: int = 5) -> float:
    """Shortest processor time, all threads together, s."""
    return best_of(work, repeats, process_time)


@dataclass(frozen=True)
class Told:
    """What a process of its own printed last (JSON), and its times from start to exit, s, and largest memory, bytes."""

    printed: dict[str, Any]
    seconds: float
    processor: float
    memory: float


def in_process(module: str, words: Sequence[object], python: str | Path = sys.executable) -> Told:
    """Start a module of this folder in a process of its own."""
    command = [str(python), str(ROOT / "benchmarks" / f"{module}.py"), *map(str, words)]
    begin = perf_counter()
    child = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=os.environ | {"PYTHONPATH": str(ROOT)})
    assert child.stdout is not None
    printed = child.stdout.read()
    _, status, usage = os.wait4(child.pid, 0)
    seconds = perf_counter() - begin
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode:
        raise RuntimeError(f"{' '.join(command)} ended with code {child.returncode}")
    unit = 1 if sys.platform == "darwin" else 1024
    return Told(
        json.loads(printed.splitlines()[-1]), seconds, usage.ru_utime + usage.ru_stime, float(usage.ru_maxrss * unit)
    )
