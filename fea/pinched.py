"""``Pinch``, ``PinchedBending`` and ``ShapeRecovery`` by finite elements."""

from time import perf_counter

from fea.model import FeaModel
from fea.pictures import fields
from fea.pinching import Story
from fea.setting_up import Mesh, how, said, warm_up
from fea.tube import TubeExperiment, set_up
from lab.records import Record
from lab.specimens import PinchedTube


def perform(specimen: PinchedTube, experiment: TubeExperiment, model: FeaModel, mesh: Mesh) -> Record:
    """Pinch the tube, and load it, stage by stage; see ``fea.perform``.

    A mesh of an eighth (``meshes.tube``) serves a ``Pinch`` of the first pair: symmetric in all, so that it does not
    buckle sideways, and its ``flexibility`` is NaN.
    """
    warm_up(model.linear_solver, model.element)
    began = perf_counter()
    tube = set_up(specimen, experiment, model, mesh)
    story = Story(tube, experiment, model.tolerance)
    story.play()
    seconds, sensed = perf_counter() - began, story.sensed
    shown = sensed.pictured()
    return Record(
        **said(specimen, experiment, model),
        channels=sensed.channels(),
        how=how(tube.part, model, tube.problem.linear, seconds, story.history.summary()) | {"notes": story.notes},
        status="diverged" if story.reason else "completed",
        reason=story.reason,
        fields=fields(tube.part, [float(n) for n in shown], [sensed.states[n] for n in shown]),
    )
