"""Records of shaken beams with orbits that are known, and of tubes with fins with forces and motions that are."""

import numpy as np
import pytest

from lab.experiments import BaseShake, FinPush, PaddleThrust, ShapePropagation
from lab.records import Channel, Record, channels
from lab.specimens import FinnedTube, TwistedBeam
from lab.specimens.finned_tube import LoadFin
from results.accuracy import Entry


def _ellipse(shake, major, ratio, tilt, phase):
    turn = 2 * np.pi * shake.frequency * shake.times + phase
    along, across = major / 2 * np.cos(turn), ratio * major / 2 * np.sin(turn)
    return np.stack(
        [np.cos(tilt) * along - np.sin(tilt) * across, np.sin(tilt) * along + np.cos(tilt) * across], axis=1
    )


@pytest.fixture
def orbit():
    """Entry of a beam whose tip travels an ellipse, or a given path of y and z, as seen from the clamp."""

    def make(
        performer="fea", *, specimen=None, major=4e-3, ratio=0.5, tilt=0.3, phase=0.4, path=None, campaign="shake",
        slug=None, status="completed", seen=None, **shake,
    ):  # fmt: skip
        specimen = specimen or TwistedBeam()
        experiment = BaseShake(**{"seen_from": "clamp", **shake})
        plane = _ellipse(experiment, major, ratio, tilt, phase) if path is None else path
        markers = np.concatenate([np.zeros((len(plane), 1)), plane], axis=1)[:, None]
        found = channels(
            Channel("time", "s", experiment.times, ("time",)),
            Channel("markers", "m", markers, ("time", "marker", "axis")),
        )
        origin = "fea" if performer == "fea" else "prb"
        record = Record(
            origin, performer, specimen.model_dump(mode="json"), experiment.model_dump(mode="json"), found,
            how={"wall_time_s": 1.0}, status=status, reason="" if status == "completed" else "not steady",
        )  # fmt: skip
        words = {"twist": f"{np.degrees(specimen.twist):g}deg", "frequency": f"{experiment.frequency:g}Hz"}
        name = slug or "_".join(f"{key}={value}" for key, value in words.items())
        return Entry(campaign, performer, name, "beam", experiment, record, "x", seen)

    return make


# ------------------------------------------------------------------------------------------- tubes with fins

#: Of the prototype's records unless a test says otherwise.
FINNED = FinnedTube()


def _finned(experiment, found, *, device=FINNED, performer="fea", campaign="c", slug="single", specimen="prototype",
            seen=None, status="completed", origin=None, fields=None, **how):  # fmt: skip
    record = Record(
        origin or ("fea" if performer.startswith("fea") else "prb"), performer, device.model_dump(mode="json"),
        experiment.model_dump(mode="json"), channels(*found), how=how, status=status, fields=fields,
        reason="" if status == "completed" else "the tube folds",
    )  # fmt: skip
    return Entry(campaign, performer, slug, specimen, experiment, record, f"fea/{campaign}.{slug}.vtkhdf", seen)


def _over(name, values, unit="1", dims=()):
    return Channel(name, unit, np.asarray(values), ("increment", *dims))


def angled(arc=65.0, theta=60.0, **changes):
    """A tube with fins of these angles, deg."""
    return FinnedTube(fin_arc=np.deg2rad(arc), attachment_angle=np.deg2rad(theta), **changes)


@pytest.fixture
def propagation():
    """Entry of a pinch in which P travels ``s`` and ``y`` in proportion to the pinch, x : z as 4 : 3."""

    def make(s=20e-3, y=6e-3, *, arc=65.0, theta=60.0, states=11, drive="pinch", reached=0.033, psi=40.0, **more):
        experiment = ShapePropagation(drive=drive, travel=0.033 if drive == "pinch" else 0.0)
        share = np.linspace(0.0, 1.0, states)
        turn = np.linspace(0.0, 2 * np.pi, 40, endpoint=False)
        ring = np.stack([np.cos(turn), np.sin(turn)], axis=1) * 0.02425
        found = [
            _over("increment", np.arange(states)),
            _over("travel", reached * (share if drive == "pinch" else share**0.5), "m"),
            _over("force", 30.0 * share if drive == "pinch" else 0.0 * share, "N"),
            _over("pressure", (0.0 if drive == "pinch" else psi * 6894.757293168) * share, "Pa"),
            _over("p", np.outer(share, [-0.8 * s, -y, 0.6 * s]), "m", ("axis",)),
            _over("section", ring * (1 + share[:, None, None] * [0.3, -0.6]), "m", ("place", "side")),
            _over("fin_radius", 0.02425 / (1 + share), "m"),
            _over("fin_angle", np.deg2rad(theta - 30.0 * share), "rad"),
            _over("strain", 0.2 * share),
        ]
        slug = more.pop("slug", f"fin_arc={arc:g}deg_attachment_angle={theta:g}deg")
        more.setdefault("wall_time_s", 60.0)
        return _finned(experiment, found, device=angled(arc, theta), slug=slug, **more)

    return make


@pytest.fixture
def fin_push():
    """Entry of a push whose force grows evenly to ``limit`` (N) at 5 mm, then falls to half of it at 20 mm."""

    def make(sense="opposite", travel=0.033, limit=5.0, *, snaps=True, **more):
        experiment = FinPush(sense=sense, travel=travel)
        way = np.linspace(0.0, 0.02, 21)
        end = 0.5 * limit if snaps else 2.0 * limit
        force = np.where(way <= 5e-3, limit * way / 5e-3, limit + (end - limit) * (way - 5e-3) / 15e-3)
        found = [
            _over("increment", np.arange(24)),
            _over("stage", np.array([0, 1, 1] + [2] * 21)),
            _over("travel", np.concatenate([[0, travel / 2], np.full(22, travel)]), "m"),
            _over("push", np.concatenate([np.zeros(3), way]), "m"),
            _over("force", np.concatenate([np.zeros(3), force]), "N"),
            _over("fin_angle", np.full(24, np.deg2rad(40.0)), "rad"),
            _over("fin_radius", np.full(24, 0.015), "m"),
        ]
        slug = more.pop("slug", f"travel={1e3 * travel:g}mm_sense={sense}")
        return _finned(experiment, found, slug=slug, **more)

    return make


@pytest.fixture
def paddling():
    """Entry of a stroke of half a sine to ``most`` (N) with air on, and one to ``least`` without."""

    def make(most=1.2, least=-0.98, *, load_fin=False, body="fixed", frequency=1.0, speed=0.053, tip=(0.3, 0.2),
             size=None, buckling=(0.1, -0.4), **more):  # fmt: skip
        experiment = PaddleThrust(body=body, frequency=frequency)
        time = experiment.times
        phase = (time * frequency) % 1.0
        power = experiment.power_stroke(time)
        wave = np.abs(np.sin(2 * np.pi * phase))
        index = ("time",)
        values = {
            "time": ("s", time), "thrust": ("N", np.where(power, most, least) * wave),
            "buckling": ("rad", np.where(power, buckling[0], buckling[1]) * wave),
            "tip_speed": ("m/s", np.where(power, tip[0], tip[1]) * np.ones(len(time))),
            "x1": ("m", 5e-3 * np.sin(np.pi * phase)), "fin_angle": ("rad", 1.0 - 0.5 * np.sin(np.pi * phase)),
        }  # fmt: skip
        if body == "free":
            values |= {"body": ("m", speed * time), "body_speed": ("m/s", np.full(len(time), speed))}
        found = [Channel(name, unit, array, index) for name, (unit, array) in values.items()]
        load = {"load_fin": LoadFin(**({} if size is None else {"length": size}))} if load_fin else {}
        words = [f"frequency={frequency:g}Hz"] if frequency != 1.0 else []
        words += [f"length={1e3 * size:g}mm"] if size is not None else []
        words += ["body=free"] if body == "free" else []
        more = {"performer": "paddler", "specimen": "loaded" if load_fin else "prototype", "wall_time_s": 0.004} | more
        slug = more.pop("slug", "_".join(words) or "single")
        return _finned(experiment, found, device=FinnedTube(**load), slug=slug, **more)

    return make
