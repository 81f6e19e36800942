"""Many runs for a fit: meshes in memory, kept between calls; in several processes where that is wished."""

import os
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import TYPE_CHECKING, Any

import fea
from fea.model import FeaModel, MaterialChange
from lab.experiments import Experiment
from lab.requests import Request, Response
from lab.specimens import FinnedTube, PinchedTube, Specimen
from meshes.options import MeshOptions

if TYPE_CHECKING:
    from fea.setting_up import Mesh
    from meshes.finned_tube import FinnedPart
    from meshes.tube import Part

#: Channels of the record that a fit sees.
_SENSED = {
    "RingDown": ("time", "markers"),
    "BaseShake": ("time", "markers"),
    "StaticStiffness": ("leg", "motion", "wrench"),
    "NaturalModes": ("frequency", "tip"),
    "Pinch": ("stage", "travel", "force", "contact_force", "pose", "section", "flexibility"),
    "PinchedBending": ("stage", "travel", "force", "load", "pushed", "pose"),
    "ShapeRecovery": ("stage", "force", "load", "pushed", "pose", "section"),
    "ShapePropagation": ("travel", "force", "pressure", "p", "fin_radius", "fin_angle", "section", "energy"),
    "FinPush": ("stage", "travel", "push", "force", "p", "tip", "contact", "fin_radius", "fin_angle"),
}

#: Outcome of one run: the response, and why there is none.
_Outcome = tuple[Response, str]


class Batch:
    """Runs of one finite-element model for any specimens and experiments.

    Assembled matrices are not kept: setting up takes some 40 ms of a run's second, in stepping the rest.

    Parameters
    ----------
    model
        Elements, mesh options, solver, time step.  What it changes in the specimen (``material``, ``thickness``) is
        left out, since the specimens of the requests carry all: make them by ``model.applied_to``.
    workers
        Processes that share the requests; they do not change the result.  A second one pays from some ten runs on:
        each takes seconds to start.  Scripts need the usual ``if __name__ == "__main__"``.

    Attributes
    ----------
    failures
        Why requests of the last call have no response, by their place.
    """

    def __init__(self, model: FeaModel, *, workers: int = 1) -> None:
        self.model = model.model_copy(update={"material": MaterialChange(), "thickness": None})
        self.workers = workers
        self.failures: dict[int, str] = {}
        self._meshes: dict[Any, Mesh] = {}
        self._pool: ProcessPoolExecutor | None = None

    def __call__(self, requests: Sequence[Request]) -> list[Response]:
        """Responses in the order of the requests.

        Returns
        -------
        responses
            ``RingDown`` and ``BaseShake``: ``time`` (samples,), ``markers`` (samples, markers, 3).
            ``StaticStiffness``: ``leg`` (n,), ``motion`` and ``wrench`` (n, 6).  ``NaturalModes``: ``frequency``
            (modes,), ``tip`` (modes, 6).  Tubes: some of the channels of their experiments.  None where the run did not
            complete: see ``failures``.

        Raises
        ------
        ValueError
            For a request with ``values``, which finite elements do not know.
        """
        for request in requests:
            if request.values:
                raise ValueError(
                    f"finite elements take no values ({', '.join(request.values)}): the specimen carries all"
                )
        parallel = self.workers > 1 and len(requests) > 1
        outcomes = list(self._processes().map(_in_process, requests) if parallel else map(self._one, requests))
        self.failures = {place: reason for place, (_, reason) in enumerate(outcomes) if reason}
        return [response for response, _ in outcomes]

    def close(self) -> None:
        """End the processes; the next call starts others."""
        if self._pool is not None:
            self._pool.shutdown()
            self._pool = None

    def _one(self, request: Request) -> _Outcome:
        specimen, experiment = request.specimen, request.experiment
        record = fea.perform(specimen, experiment, self.model, self._mesh(specimen, experiment))
        if not record.completed:
            return None, f"{record.status}: {record.reason}"
        return {name: record[name] for name in _SENSED[experiment.kind]}, ""

    def _mesh(self, specimen: Specimen, experiment: Experiment) -> "Mesh":
        geometry, options, shell = specimen.geometry(), self.model.mesh_for(experiment), self.model.element == "shell"
        if shell:
            # The middle surface of a beam does not depend on it, so that fits of the thickness share one.
            geometry.pop("thickness", None)
        part = self.model.part_for(experiment)
        key = (specimen.kind, repr(geometry), options, part)
        if key not in self._meshes:
            self._meshes[key] = _made(specimen, options, shell, part)
        return self._meshes[key]

    def _processes(self) -> ProcessPoolExecutor:
        if self._pool is None:
            # Not forked: numba and MKL do not survive that once they have threads.
            self._pool = ProcessPoolExecutor(
                self.workers, mp_context=get_context("spawn"), initializer=_begin, initargs=(self.model,)
            )
        return self._pool


def _made(specimen: Specimen, options: MeshOptions, shell: bool, part: "Part | FinnedPart") -> "Mesh":
    from meshes.block import beam_mesh, beam_surface
    from meshes.finned_tube import PARTS, finned_surface
    from meshes.tube import tube_solid, tube_surface

    if isinstance(specimen, FinnedTube):
        if not shell or part not in PARTS:
            raise ValueError("a tube with fins is solved as a shell: choose element 'shell'")
        return finned_surface(specimen, options, part)
    if isinstance(specimen, PinchedTube):
        return tube_surface(specimen, options) if shell else tube_solid(specimen, options)
    return beam_surface(specimen, options) if shell else beam_mesh(specimen, options)


#: What a process of a batch works with.
_own: list[Batch] = []


def _begin(model: FeaModel) -> None:
    os.environ.setdefault("MKL_NUM_THREADS", "1")
    _own[:] = [Batch(model)]


def _in_process(request: Request) -> _Outcome:
    return _own[0]._one(request)
