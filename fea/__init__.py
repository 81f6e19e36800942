"""Finite elements: large-deformation solids and shells on scikit-fem, and experiments performed with them.

Cases of one's own begin with ``Case`` (see ``docs/fea.md``); studies call ``perform``.
"""

import hashlib
import os
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fea.model import FeaModel
from lab.experiments import Experiment
from lab.records import Record
from lab.specimens import Specimen

if TYPE_CHECKING:
    from fea.body import Body as Body
    from fea.case import Case as Case
    from fea.case import constant as constant
    from fea.case import proportional as proportional
    from fea.case import stages as stages
    from fea.motion import transient as transient
    from fea.newton import Options as Options
    from fea.run import Run as Run
    from fea.shell import Shell as Shell
    from fea.statics import Steer as Steer
    from fea.statics import static as static
    from fea.statics import trace as trace
    from fea.vibration import linear_buckling as linear_buckling
    from fea.vibration import vibrations as vibrations
    from fea.writing import record as record


def _kernel_cache() -> str:
    """Folder of compiled kernels for exactly these sources.

    numba compiles a function anew when its own file has changed, but not when that of a function which it calls
    has: after an update it would go on with the old one.
    """
    here, digest = Path(__file__).parent, hashlib.sha256()
    for source in (file.read_bytes() for file in sorted(here.rglob("*.py"))):
        if b"\n@njit" in source:
            digest.update(source)
    return str(here / "__pycache__" / f"kernels-{digest.hexdigest()[:12]}")


os.environ.setdefault("NUMBA_CACHE_DIR", _kernel_cache())

#: Experiment kind to the module that performs it.
PERFORMERS = {
    "StaticStiffness": "fea.static_stiffness",
    "RingDown": "fea.ring_down",
    "BaseShake": "fea.base_shake",
    "NaturalModes": "fea.natural_modes",
    "Pinch": "fea.pinched",
    "PinchedBending": "fea.pinched",
    "ShapeRecovery": "fea.pinched",
    "ShapePropagation": "fea.finned",
    "FinPush": "fea.finned",
}
#: What a module performs with, where that is no beam.
_SPECIMENS = {"fea.pinched": "PinchedTube", "fea.finned": "FinnedTube"}

#: Public names to their modules: numba and scikit-fem load only when there is work for them.
_PUBLIC = {
    "Body": "fea.body", "Shell": "fea.shell",
    "Case": "fea.case", "constant": "fea.case", "proportional": "fea.case", "stages": "fea.case",
    "static": "fea.statics", "trace": "fea.statics", "Steer": "fea.statics", "Options": "fea.newton",
    "transient": "fea.motion", "Run": "fea.run",
    "vibrations": "fea.vibration", "linear_buckling": "fea.vibration",
    "record": "fea.writing",
}  # fmt: skip

__all__ = ["PERFORMERS", "FeaModel", "perform", *_PUBLIC]  # noqa: PLE0604


def __getattr__(name: str) -> Any:
    if name not in _PUBLIC:
        raise AttributeError(f"fea has no {name!r}")
    return getattr(import_module(_PUBLIC[name]), name)


def perform(specimen: Specimen, experiment: Experiment, model: FeaModel, mesh: Any) -> Record:
    """Put a specimen through an experiment by finite elements.

    Parameters
    ----------
    specimen
        The device; SI.
    experiment
        Load case and sensors.
    model
        Material changes, solver, time step.  Its mesh options are not used here.
    mesh
        Mesh of the specimen as the model changes it, as from ``meshes.read_mesh``.

    Returns
    -------
    Record
        Status ``diverged`` with the reason and what was reached when equilibrium was lost,
        ``unsupported`` for an experiment that this performer does not know.
    """
    module, why = PERFORMERS.get(experiment.kind), ""
    if module is None:
        why = f"no finite-element performer for {experiment.kind}; there are {', '.join(PERFORMERS)}"
    elif specimen.kind != _SPECIMENS.get(module, "TwistedBeam"):
        why = f"{experiment.kind} is not for a {specimen.kind} by finite elements"
    if module is None or why:
        return Record(
            model.origin, model.kind, specimen.model_dump(), experiment.model_dump(), status="unsupported", reason=why
        )
    performer: Callable[..., Record] = import_module(module).perform
    return performer(specimen, experiment, model, mesh)
