"""A pinch to contact in a process of its own: ``_closing.py PART ACROSS ALONG``; prints JSON."""

import json
import sys

import numpy as np

from fea import FeaModel, perform
from lab.experiments import Pinch
from lab.experiments.pinch import closing
from lab.specimens import PinchedTube
from meshes.tube import tube_surface

#: Force is compared there too, before the tube buckles sideways, which an eighth cannot.
TRAVEL = 20e-3


def main(part: str, across: str, along: str) -> None:
    tube, experiment = PinchedTube.model_validate({"size": "printed-tpu"}), Pinch()
    model = FeaModel.model_validate({"element": "shell", "tube_mesh": {"across": int(across), "along": int(along)}})
    record = perform(tube, experiment, model, tube_surface(tube, model.tube_mesh, part))
    found = closing(record)
    print(
        json.dumps(
            {
                "status": record.status,
                "seconds": record.how["wall_time_s"],
                "unknowns": record.how["unknowns"],
                "closing": found["closing_force"].value,
                "before": float(np.interp(TRAVEL, record["travel"], record["force"])),
            }
        )
    )


if __name__ == "__main__":
    main(*sys.argv[1:])
