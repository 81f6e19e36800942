"""Memory and time of a tube in one layer of hexahedra, and of solid shells, from 10,000 to 300,000 unknowns.

Every size runs in a process of its own: set-up, one static increment, then Newton steps by the clock.
"""

from typing import Any

import numpy as np

from benchmarks._measure import in_process, row

#: Elements around and along, by elements and unknowns.
MESHES = {
    "hexahedra": {10_000: (18, 15), 30_000: (30, 27), 100_000: (60, 46), 300_000: (101, 83)},
    "shell": {10_000: (22, 18), 30_000: (40, 30), 100_000: (70, 60), 300_000: (120, 105)},
}
LIMITS = {100_000: "< 2", 300_000: "< 8"}


def rows() -> list[dict[str, Any]]:
    in_process("_one_step", ("hexahedra", 2, 2))
    in_process("_one_step", ("shell", 2, 2))
    return grow("hexahedra", MESHES["hexahedra"]) + grow("shell", MESHES["shell"])


def grow(elements: str, meshes: dict[int, tuple[int, int]]) -> list[dict[str, Any]]:
    empty = in_process("_one_step", (elements, 2, 2)).memory
    what, result, sizes, times, memories = "solid shells" if elements == "shell" else elements, [], [], [], []
    for about, mesh in meshes.items():
        child = in_process("_one_step", (elements, *mesh))
        told, memory = child.printed, child.memory
        sizes.append(told["unknowns"])
        times.append(told["step"])
        memories.append(memory)
        size = f"{told['unknowns']} unknowns, {what}"
        result.append(row(f"largest memory, {size}", memory / 1e9, "GB", LIMITS.get(about, "")))
        result.append(row(f"Newton step, {size}", told["step"], "s"))
    result.append(
        row(
            f"growth of memory (less {empty / 1e9:.2f} GB), {what}",
            slope(sizes, np.subtract(memories, empty)),
            "log-log slope",
        )
    )
    result.append(row(f"growth of the time of a Newton step, {what}", slope(sizes, times), "log-log slope"))
    return result


def slope(sizes: Any, values: Any) -> float:
    """Exponent of the power law through points."""
    return float(np.polyfit(np.log(sizes), np.log(values), 1)[0])
