"""Many paddling devices at once: the compiled motion lets go of the interpreter, so threads share them."""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

from lab.experiments import PaddleThrust
from lab.requests import Request, Response
from lab.specimens import FinnedTube
from prb.declaration import Declaration
from prb.experiments.paddling import responses
from prb.fin_curves import FinCurves
from prb.paddler import is_paddler, paddler_of, stroke_of
from prb.water import Water, paddle_in


def paddle_all(
    requests: Sequence[Request],
    topology: Declaration,
    fin: FinCurves | None,
    water: Water,
    time_step: float,
    threads: int,
) -> list[tuple[Response, str]]:
    """Channels of every request, or None with the reason; MuJoCo's passive force is global: one run at a time."""

    def one(request: Request) -> tuple[Response, str]:
        specimen, experiment = request.specimen, request.experiment
        if not isinstance(specimen, FinnedTube) or not is_paddler(topology):
            return None, f"topology {topology.name} cannot make a {specimen.kind} paddle"
        assert isinstance(experiment, PaddleThrust)
        try:
            motion = paddle_in(water, paddler_of(specimen, request.values, fin), stroke_of(experiment), time_step)
        except ValueError as error:
            return None, str(error)
        return (None, motion.fault) if motion.fault else (responses(experiment, motion), "")

    if threads == 1 or len(requests) == 1 or water != "plate":
        return [one(request) for request in requests]
    with ThreadPoolExecutor(threads) as pool:
        return list(pool.map(one, requests))
