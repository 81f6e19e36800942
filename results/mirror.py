"""Whether orbits obey the symmetries of the beam: checked on the records, pair by pair.

A mirror in the plane z = 0 turns the beam into the one of opposite twist and the clamp's motion A sin(2 pi f t) into
its opposite, which is the same motion half a period later.  So the mirrored beam's path must be the mirrored path,
half a period later, travelled the other way round.  Without gravity a half turn about the beam's axis does likewise
with y -> -y, z -> -z: the weight moves to the opposite corner of its frame, the sense of travel stays.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lab.experiments import BaseShake
from lab.orbits import LINE, ellipse
from lab.specimens import TwistedBeam
from results.accuracy import Entry
from results.slugs import short
from results.tables import Table

Array = NDArray[np.float64]

#: Digits (rad) to which angles of partners agree.
_DIGITS = 9
_NOTE = (
    "the mirrored beam must travel the mirrored path, half a period later and the other way round; after a half turn "
    "about its axis, which moves the weight to the opposite corner, the turned path and the same way round (without "
    "gravity); deviation: largest distance of the two paths over the length of the major axis, and what is left of "
    "the transient shows in it; a beam that is its own mirror image is its own partner"
)
_HEADER = ("campaign", "model", "symmetry", "pairs", "largest deviation [%]", "at", "senses as they must be")


class Pair(NamedTuple):
    """Two orbits that a symmetry makes one.

    Parameters
    ----------
    one, other
        Their entries; the same twice where the specimen is its own image.
    deviation
        Largest distance of the other's path from the image of the one's over the length of its major axis.
    senses_agree
        Whether the senses of travel are as the symmetry wants; lines have none.
    """

    one: Entry
    other: Entry
    deviation: float
    senses_agree: bool


@dataclass(frozen=True)
class Symmetry:
    """What maps beams on beams.

    Parameters
    ----------
    name
        For tables.
    image
        Specimen that takes the place of another.
    signs
        Of y and z of its path, half a period later, (2,).
    holds
        Experiments whose gravity and markers the symmetry leaves alone.
    """

    name: str
    image: Callable[[TwistedBeam], TwistedBeam]
    signs: tuple[float, float]
    holds: Callable[[BaseShake], bool]

    def of(self, path: Array) -> Array:
        """Image of a path over one period, (samples, 2), m."""
        return later(path) * np.array(self.signs)


def later(path: Array) -> Array:
    """A closed path (samples, 2) that begins half a period later; between samples by its harmonics."""
    amplitudes = np.fft.rfft(path[:-1], axis=0)
    shifted = np.fft.irfft(amplitudes * (-1.0) ** np.arange(len(amplitudes))[:, None], len(path) - 1, axis=0)
    return np.concatenate([shifted, shifted[:1]])


def _half_turned(specimen: TwistedBeam) -> TwistedBeam:
    frame = specimen.load_frame
    if frame is None:
        return specimen
    height, _, side = frame.mirrored().corner.partition("-")
    corner = f"{'upper' if height == 'lower' else 'lower'}-{side}"
    return specimen.model_copy(update={"load_frame": frame.model_copy(update={"corner": corner})})


def _marked_alike(shake: BaseShake, signs: tuple[float, float]) -> bool:
    images = [(x, signs[0] * y, signs[1] * z) for x, y, z in shake.markers]
    return np.allclose(sorted(images), sorted(shake.markers), rtol=0.0, atol=1e-12)


MIRROR = Symmetry(
    "mirror", lambda specimen: specimen.mirrored(), (1.0, -1.0),
    lambda shake: (shake.own_weight is None or abs(math.sin(shake.own_weight)) < 10**-_DIGITS)
    and _marked_alike(shake, (1.0, -1.0)),
)  # fmt: skip
HALF_TURN = Symmetry(
    "half turn", _half_turned, (-1.0, -1.0),
    lambda shake: shake.own_weight is None and _marked_alike(shake, (-1.0, -1.0)),
)  # fmt: skip


def pairs(entries: Sequence[Entry], symmetry: Symmetry) -> list[Pair]:
    """Pairs among the orbits of one performer in one campaign, each once, in the order of the entries."""
    known: dict[tuple[TwistedBeam, BaseShake], list[Entry]] = {}
    for entry in entries:
        if isinstance(entry.experiment, BaseShake) and entry.record.completed and symmetry.holds(entry.experiment):
            specimen = entry.tested()
            assert isinstance(specimen, TwistedBeam)  # no performer shakes anything else
            known.setdefault((_named(specimen), entry.experiment), []).append(entry)
    found, done = [], set()
    for (specimen, shake), ones in known.items():
        image = (_named(symmetry.image(specimen)), shake)
        done.add((specimen, shake))
        if image in known and (image == (specimen, shake) or image not in done):
            # Several with the same specimen and experiment differ in the performer's own swept settings.
            found += [_pair(one, other, symmetry) for one, other in zip(ones, known[image], strict=False)]
    return found


def mirror_table(entries: Sequence[Entry]) -> Table | None:
    """Both symmetries for every performer of every campaign of shakes; None where no orbit has a partner.

    The half turn is checked for beams with a load frame only: a bare one is its own image.
    """
    framed = [entry for entry in entries if entry.record.specimen.get("load_frame")]
    lines = [*_lines(entries, MIRROR), *_lines(framed, HALF_TURN)]
    return Table("symmetry of the orbits", _HEADER, tuple(lines), (_NOTE,)) if lines else None


def _lines(entries: Sequence[Entry], symmetry: Symmetry) -> Iterator[tuple[str, ...]]:
    groups: dict[tuple[str, str], list[Entry]] = {}
    for entry in entries:
        groups.setdefault((entry.campaign, entry.performer), []).append(entry)
    for names, group in groups.items():
        if found := pairs(group, symmetry):
            worst = max(found, key=lambda pair: pair.deviation)
            agree = sum(pair.senses_agree for pair in found)
            deviation, place = f"{100 * worst.deviation:.2g}", short(worst.one.slug)
            yield (*names, symmetry.name, str(len(found)), deviation, place, f"{agree} of {len(found)}")


def _pair(one: Entry, other: Entry, symmetry: Symmetry) -> Pair:
    assert isinstance(one.experiment, BaseShake)
    assert isinstance(other.experiment, BaseShake)
    wanted, path = symmetry.of(one.experiment.path(one.record)), other.experiment.path(other.record)
    image, seen = ellipse(wanted), ellipse(path)
    deviation = float(np.linalg.norm(path - wanted, axis=1).max()) / image.major
    # Lines have no sense, and on the border to them either verdict is right.
    agree = image.ratio * seen.ratio > 0.0 or abs(image.ratio - seen.ratio) < LINE
    return Pair(one, other, deviation, agree)


def _named(specimen: TwistedBeam) -> TwistedBeam:
    """Equal for specimens that are the same body: a section turned by half a turn is the same section."""
    root = round(specimen.root_angle, _DIGITS) % round(math.pi, _DIGITS)
    # Adding nothing makes -0 a 0.
    return specimen.model_copy(update={"twist": round(specimen.twist, _DIGITS) + 0.0, "root_angle": root + 0.0})
