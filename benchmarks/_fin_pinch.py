"""Shape propagation in a process of its own: ``_fin_pinch.py ALPHA THETA ACROSS ALONG INCREMENTS``; prints JSON."""

import json
import sys

from fea import FeaModel, perform
from lab.experiments import ShapePropagation
from lab.specimens import FinnedTube
from meshes.finned_tube import finned_surface


def main(alpha: str, theta: str, across: str, along: str, increments: str) -> None:
    tube = FinnedTube.model_validate({"fin_arc": f"{alpha} deg", "attachment_angle": f"{theta} deg"})
    experiment = ShapePropagation(increments=int(increments))
    mesh = {"across": int(across), "along": int(along)}
    model = FeaModel.model_validate({"element": "shell", "fin_mesh": mesh, "material": {"law": "neo-hookean"}})
    record = perform(tube, experiment, model, finned_surface(tube, model.fin_mesh, "quarter"))
    found = experiment.reduce(record)
    print(
        json.dumps(
            {
                "status": record.status,
                "seconds": record.how["wall_time_s"],
                "elements": record.how["mesh"]["elements"],
                "s": found["s"].value,
                "y": found["y"].value,
            }
        )
    )


if __name__ == "__main__":
    main(*sys.argv[1:])
