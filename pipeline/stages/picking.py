"""Which entries a picture shows when it cannot show all, and what its file is called."""

import re
from collections.abc import Sequence

import numpy as np

from results.accuracy import Entry

#: Lines in a figure of curves.
LINES = 12


def few(entries: Sequence[Entry], count: int) -> list[Entry]:
    """Entries of at most ``count`` samples, evenly chosen among all."""
    slugs = list(dict.fromkeys(entry.slug for entry in entries))
    chosen = {slugs[i] for i in np.linspace(0, len(slugs) - 1, min(count, len(slugs))).round().astype(int)}
    return [entry for entry in entries if entry.slug in chosen]


def readable(entries: Sequence[Entry]) -> list[Entry]:
    """As many samples as curves can be told apart, at least four."""
    return few(entries, max(LINES // len({entry.performer for entry in entries}), 4))


def file_word(label: str) -> str:
    """A label as part of a file name."""
    return re.sub(r"[^\w.+-]+", "-", label)
