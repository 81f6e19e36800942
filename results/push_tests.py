"""Push tests of one tube open and closed, side by side (fig. 3.6)."""

from collections.abc import Hashable, Sequence
from dataclasses import dataclass

from lab.experiments import PinchedBending
from lab.specimens import PinchedTube
from results.accuracy import Entry
from results.benches import Bench
from results.slugs import words

#: Fields that say how a tube was closed: they mean nothing to the open one.
_CLOSING = ("pinch_angle", "law", "pair_forces", "firmness", "force_limit", "duration", "increments", "order")
#: Fields that differ between the two tests of a pair, or that hardly matter to a slope.
_OWN = ("pinched", "push", "bend_duration", "bend_increments", "returns")


@dataclass(frozen=True)
class PushTest:
    """One push test.

    Parameters
    ----------
    entry, bench
        Its record, and everything that a sweep may vary.
    k
        Slope of force against motion, N/m; NaN without a result.
    """

    entry: Entry
    bench: Bench
    k: float

    @property
    def experiment(self) -> PinchedBending:
        """How it was pushed."""
        experiment = self.bench.parts["experiment"]
        assert isinstance(experiment, PinchedBending)
        return experiment

    @property
    def specimen(self) -> PinchedTube:
        """What was pushed."""
        specimen = self.bench.parts["specimen"]
        assert isinstance(specimen, PinchedTube)
        return specimen

    @property
    def is_plain(self) -> bool:
        """Whether nothing but the state of the tube and the way of the push is swept."""
        return not words(self.entry.slug).keys() - {"pinched", "pinch_angle", "law", "direction"}

    @property
    def rig(self) -> Hashable:
        """Equal for tests of one tube by one performer on one rig."""
        left_out = {f"experiment.{name}" for name in (*_CLOSING, *_OWN)}
        fields = tuple((path, value) for path, value in self.bench.fields.items() if path not in left_out)
        return self.entry.performer, self.entry.specimen, fields


def push_tests(entries: Sequence[Entry]) -> list[PushTest]:
    """All push tests among the entries, in their order."""
    found = []
    for entry in entries:
        if isinstance(entry.experiment, PinchedBending) and entry.experiment.push is not None:
            numbers = entry.scalars()
            k = numbers["k"].value if "k" in numbers else float("nan")
            found.append(PushTest(entry, Bench.whole(entry), k))
    return found


def pairs(tests: Sequence[PushTest]) -> list[tuple[PushTest | None, PushTest | None]]:
    """Every closed test with the open one on the same rig, and open ones without a closed one; None for what lacks."""
    opened: dict[Hashable, PushTest] = {}
    for test in tests:
        if not test.experiment.pinched:
            opened.setdefault(test.rig, test)
    closed = [test for test in tests if test.experiment.pinched]
    used = {test.rig for test in closed}
    alone: list[tuple[PushTest | None, PushTest | None]] = [(t, None) for rig, t in opened.items() if rig not in used]
    return [*((opened.get(test.rig), test) for test in closed), *alone]
