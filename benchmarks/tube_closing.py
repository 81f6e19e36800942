"""The printed tube of chapter 3 pinched until it closes: whole, with self-contact, and an eighth with three mirrors.

The eighth stays symmetric, where the whole tube buckles sideways: their forces are the same only before that.
"""

from typing import Any

from benchmarks._measure import Told, in_process, row

#: Elements from pad to pad and along the length.
WHOLE, EIGHTH, FINER = (8, 24), (8, 24), (16, 48)


def rows() -> list[dict[str, Any]]:
    in_process("_closing", ("eighth", 6, 8))  # compiles what is not compiled yet
    finer = in_process("_closing", ("eighth", *FINER))
    eighth = in_process("_closing", ("eighth", *EIGHTH))
    whole = in_process("_closing", ("whole", *WHOLE))
    solved, other = eighth.printed["seconds"], whole.printed["seconds"]
    return [
        row("eighth of the tube, to contact", solved, "s", "<= 10"),
        row("whole tube, to contact", other, "s", "<= 180"),
        row("whole tube beside its eighth", other, "s", "", "eighth", solved, other / solved),
        row("whole tube, unknowns", whole.printed["unknowns"]),
        *_forces("eighth", eighth, finer),
        _force("whole tube, force at 20 mm", whole, "before", "eighth, refined twice", finer),
    ]


def _forces(name: str, ours: Told, finer: Told) -> list[dict[str, Any]]:
    peer = "refined twice"
    return [
        _force(f"{name}, force at 20 mm", ours, "before", peer, finer),
        _force(f"{name}, closing force", ours, "closing", peer, finer),
    ]


def _force(name: str, ours: Told, which: str, peer: str, finer: Told) -> dict[str, Any]:
    one, other = ours.printed[which], finer.printed[which]
    return row(name, one, "N", "0.99 to 1.01", peer, other, one / other)
