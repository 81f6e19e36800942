"""Many paddling devices at once: the compiled motion lets go of the interpreter, so threads share them."""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

from lab.experiments import PaddleThrust
from lab.requests import Request, Response
from lab.specimens import FinnedTube
from prb.declaration import Declaration
from prb.experiments.paddling import responses
from prb.fin_curves import FinCurves
from prb.paddler import is_paddler, paddle, paddler_of, stroke_of


def paddle_all(
    requests: Sequence[Request], topology: Declaration, fin: FinCurves | None, time_step: float, threads: int
) -> list[tuple[Response, str]]:
    """Channels of every request, or None with the reason."""

    def one(request: Request) -> tuple[Response, str]:
        specimen, experiment = request.specimen, request.experiment
        if not isinstance(specimen, FinnedTube) or not is_paddler(topology):
            return None, f"topology {topology.name} cannot make a {specimen.kind} paddle"
        assert isinstance(experiment, PaddleThrust)
        try:
            motion = paddle(paddler_of(specimen, request.values, fin), stroke_of(experiment), time_step)
        except ValueError as error:
            return None, str(error)
        if not motion.completed:
            return None, f"the motion runs away with steps of {motion.step:.3g} s"
        return responses(experiment, motion), ""

    if threads == 1 or len(requests) == 1:
        return [one(request) for request in requests]
    with ThreadPoolExecutor(threads) as pool:
        return list(pool.map(one, requests))
