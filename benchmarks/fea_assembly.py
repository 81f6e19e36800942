"""Assembly of tangents: our compiled kernels against scikit-fem's generic form and FElupe, same hexahedra.

FElupe lives in an environment of its own, apart from the locked one; its compiled-in law is the compressible
neo-Hookean one, which is therefore compared.
"""

from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from skfem import Basis, BilinearForm, ElementHex2, ElementVector
from skfem.helpers import ddot, eye, grad, mul, trace, transpose

from benchmarks._measure import ROOT, against, best_of, in_process, processor_time, row
from fea.body import Body
from tests.verification.devices import PinchedTube

FELUPE = ROOT / ".tools" / "felupe" / "bin" / "python"
INSTALL = "python3 -m venv .tools/felupe && .tools/felupe/bin/pip install felupe==11.3.0"


def generic(body: Body, displacement: np.ndarray) -> None:
    """The same tangent by scikit-fem's form language."""
    mu, lam = body.material.shear_modulus, body.material.lame_lambda
    basis = Basis(body.mesh, ElementVector(ElementHex2()), intorder=5)
    vector = np.empty(basis.N)
    unknowns = (3 * body.cells[:, :, None] + np.arange(3)).reshape(len(body.cells), -1).T
    vector[basis.element_dofs] = displacement.ravel()[unknowns]

    @BilinearForm
    def tangent(u, v, w):
        one = 1.0 + 0.0 * w["u"].grad[0, 0]
        f = grad(w["u"]) + eye(one, 3)
        e = 0.5 * (mul(transpose(f), f) - eye(one, 3))
        s = lam * eye(trace(e), 3) + 2 * mu * e
        de = 0.5 * (mul(transpose(f), grad(u)) + mul(transpose(grad(u)), f))
        return ddot(mul(grad(u), s) + mul(f, lam * eye(trace(de), 3) + 2 * mu * de), grad(v))

    return tangent.assemble(basis, u=basis.interpolate(vector))


def felupe(body: Body, displacement: np.ndarray) -> dict[str, float] | None:
    """Time and force of FElupe with the same nodes, displacements and material; None where it is missing."""
    if not FELUPE.exists():
        return None
    points, cells, _, _ = body.picture()
    mu, lam = body.material.shear_modulus, body.material.lame_lambda
    with TemporaryDirectory() as folder:
        file = Path(folder) / "job.npz"
        np.savez(file, points=points, cells=cells, displacement=displacement, mu=mu, lam=lam)
        return in_process("_felupe", (file,), FELUPE).printed


def waves(count: int) -> np.ndarray:
    """Small displacements (count, 3), m, without any pattern."""
    return 1e-5 * np.sin(np.arange(3.0 * count)).reshape(-1, 3)


def rows() -> list[dict[str, Any]]:
    return hexahedra(12, 20) + shell(62, 60)


def hexahedra(around: int, along: int) -> list[dict[str, Any]]:
    body = PinchedTube().case("hexahedra", around, along, 1e-3).parts[0]
    rubber = replace(body, material=body.material.model_copy(update={"law": "neo-hookean"}))
    moved = waves(body.nodes)
    body.tangent(moved)
    force, _ = rubber.tangent(moved)
    peer = felupe(rubber, moved)
    if peer is not None and abs(peer["force"] - np.linalg.norm(force)) > 1e-6 * peer["force"]:
        raise RuntimeError("FElupe was given another problem: its forces differ from ours")
    ours, generically = best_of(partial(body.tangent, moved), 40), best_of(partial(generic, body, moved), 1)
    softly = best_of(partial(rubber.tangent, moved), 40)
    what = f"tangent and force, {len(body.cells)} hexahedra"
    return [
        against(what, ours, "scikit-fem form", generically, ">= 100"),
        against(f"{what}, neo-Hookean", softly, "FElupe", peer and peer["seconds"], ">= 30", INSTALL),
        row(f"force alone, {len(body.cells)} hexahedra", best_of(partial(body.internal_force, moved), 10), "s"),
    ]


def shell(around: int, along: int) -> list[dict[str, Any]]:
    part = PinchedTube().case("shell", around, along, 1e-3).parts[0]
    moved = waves(part.nodes)
    part.tangent(moved)
    part.internal_force(moved)
    what = f"solid shell, {part.nodes} nodes, processor time"
    return [
        row(f"tangent and force, {what}", processor_time(partial(part.tangent, moved)), "s", "< 0.2"),
        row(f"force alone, {what}", processor_time(partial(part.internal_force, moved), 10), "s", "< 0.03"),
    ]
