"""``ShapePropagation`` and ``FinPush`` by finite elements."""

from time import perf_counter

from fea.finned_device import FinExperiment, set_up
from fea.finned_stages import Play
from fea.model import FeaModel
from fea.setting_up import Mesh, how, said, warm_up
from lab.records import Record
from lab.specimens import FinnedTube


def perform(specimen: FinnedTube, experiment: FinExperiment, model: FeaModel, mesh: Mesh) -> Record:
    """Flatten the tube, and push a fin; see ``fea.perform``.

    The planes of symmetry are those of the mesh (``meshes.finned_tube``, by ``FeaModel.part_for``): the other parts
    are mirror images, both fins are pushed where x = 0 is one.  A pinch that loses its way as a path of equilibria is
    done again slowly in time with the model's steadying viscosity, and the record says so.
    """
    warm_up(model.linear_solver, model.element)
    began = perf_counter()
    notes = []
    play = _played(specimen, experiment, model, mesh, 0.0)
    if play.reason and not play.device.problem.seconds:
        notes.append(f"done in time with steadying viscosity: {play.reason}")
        play = _played(specimen, experiment, model, mesh, 1.0)
    seconds, sensed, device = perf_counter() - began, play.sensed, play.device
    notes += play.notes
    if device.chambers is not None and (met := device.chambers.report(play.x)["force of meeting tops [N]"]):
        notes.append(f"chambers meet across y = 0, at the end with {device.copies / 2 * met:.3g} N")
    told = how(device.parts, model, device.problem.linear, seconds, play.history.summary())
    return Record(
        **said(specimen, experiment, model),
        channels=sensed.channels(),
        how=told | {"notes": notes, "mirrors": device.mirrors, "pinched_length_m": device.pinched_length},
        status="diverged" if play.reason else "completed",
        reason=play.reason,
        fields=sensed.pictures(),
    )


def _played(specimen: FinnedTube, experiment: FinExperiment, model: FeaModel, mesh: Mesh, seconds: float) -> Play:
    play = Play(set_up(specimen, experiment, model, mesh, seconds), experiment, model.tolerance)
    play.play()
    return play
