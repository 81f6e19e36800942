"""FElupe's side of the assembly, under its own Python: ``_felupe.py JOB.npz``; prints JSON."""

import json
import sys
from time import perf_counter

import felupe
import numpy as np


def main(path: str) -> None:
    job = np.load(path)
    mesh = felupe.Mesh(job["points"], job["cells"], "VTK_TRIQUADRATIC_HEXAHEDRON")
    field = felupe.FieldContainer([felupe.Field(felupe.RegionTriQuadraticHexahedron(mesh), dim=3)])
    field[0].values[:] = job["displacement"]
    solid = felupe.SolidBody(felupe.NeoHookeCompressible(float(job["mu"]), float(job["lam"])), field)
    times = []
    for _ in range(5):
        begin = perf_counter()
        force, _ = solid.assemble.vector(field), solid.assemble.matrix(field)
        times.append(perf_counter() - begin)
    print(json.dumps({"seconds": min(times), "force": float(np.linalg.norm(force.toarray()))}))


if __name__ == "__main__":
    main(sys.argv[1])
