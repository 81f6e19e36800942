"""The pinch of a tube by 20 mm, from the start of the process to the force, against CalculiX on the same mesh.

The solid shell stands on the middle surface of the same hexahedra.
"""

import tempfile
from pathlib import Path
from typing import Any

from benchmarks._measure import against, in_process, row
from benchmarks._pinch import FIRST
from tests.verification.calculix import INSTALL, Answer, Deck, program, solve
from tests.verification.devices import PinchedTube, prescribed

TRAVEL, PEER = 20e-3, "CalculiX C3D20R"
#: Elements around a quarter and along the half, and the least ratio that is wanted.
MESHES = ((12, 20, ""), (60, 40, ">= 5"))


def theirs(around: int, along: int) -> Answer | None:
    if program() is None:
        return None
    case = PinchedTube().case("hexahedra", around, along, TRAVEL)
    deck = Deck(case.parts[0], "C3D20R", prescribed(case), case.watched["stamp"], increment=FIRST)
    with tempfile.TemporaryDirectory() as folder:
        return solve(deck, Path(folder))


def rows() -> list[dict[str, Any]]:
    in_process("_pinch", ("hexahedra", 2, 2, 1e-4))  # compiles what is not compiled yet
    in_process("_pinch", ("shell", 2, 2, 1e-4))
    return [line for mesh in MESHES for line in pinch(*mesh)]


def pinch(around: int, along: int, goal: str) -> list[dict[str, Any]]:
    peer, result = theirs(around, along), []
    for elements in ("hexahedra", "shell"):
        ours = in_process("_pinch", (elements, around, along, TRAVEL))
        what = f"{around * along} {'solid shells' if elements == 'shell' else elements}"
        result += [
            against(f"{what}, whole process", ours.seconds, PEER, peer and peer.seconds, goal, INSTALL),
            against(f"{what}, processor time", ours.processor, PEER, peer and peer.processor, "", INSTALL),
            force(what, ours.printed["force"], peer, bool(goal)),
            row(f"{what}, tangents", ours.printed["tangents"], "", "", PEER, peer and peer.iterations),
        ]
    return result


def force(what: str, newtons: float, peer: Answer | None, strict: bool) -> dict[str, Any]:
    """The same answer is what makes the times comparable; coarse meshes differ by what reduced integration does."""
    if peer is None:
        return row(f"{what}, force", newtons, "N", "", f"{PEER}: missing; {INSTALL}")
    reference = -float(peer.reactions[-1, 2])
    return row(f"{what}, force", newtons, "N", "0.99 to 1.01" if strict else "", PEER, reference, newtons / reference)
