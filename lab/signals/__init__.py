"""What may be done with a recording, each an explicit step that says so in its history."""

from lab.signals.forces import move_moments, reversed_wrench, tare
from lab.signals.frames import align, kabsch, take_rest, turned
from lab.signals.gaps import fill_gaps, refuse_gaps
from lab.signals.rates import Method, low_pass, resample
from lab.signals.releases import detect_release, release_at
from lab.signals.windows import Window, crop, cut

__all__ = [
    "Method", "Window", "align", "crop", "cut", "detect_release", "fill_gaps", "kabsch", "low_pass", "move_moments",
    "refuse_gaps", "release_at", "resample", "reversed_wrench", "take_rest", "tare", "turned",
]  # fmt: skip
