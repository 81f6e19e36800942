"""Tangent assembly of 27-node hexahedra: our compiled kernel against scikit-fem's generic form, same mesh, same run."""

from time import perf_counter

import numpy as np
from skfem import Basis, BilinearForm, ElementHex2, ElementVector
from skfem.helpers import ddot, eye, grad, mul, trace, transpose

from fea.body import Body
from fea.setting_up import warm_up
from lab.specimens import TwistedBeam
from meshes.block import beam_mesh
from meshes.options import MeshOptions


def generic(body: Body, displacement: np.ndarray) -> None:
    material = body.material
    mu, lam = material.shear_modulus, material.lame_lambda
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

    tangent.assemble(basis, u=basis.interpolate(vector))


def timed(work, *arguments, repeat: int) -> float:
    times = []
    for _ in range(repeat):
        began = perf_counter()
        work(*arguments)
        times.append(perf_counter() - began)
    return min(times)


def main() -> None:
    began = perf_counter()
    warm_up("auto")
    print(f"kernels compiled or loaded in {perf_counter() - began:.2f} s")
    specimen = TwistedBeam()
    for options in (MeshOptions(along=12, across=4, through=1), MeshOptions()):
        body = Body(beam_mesh(specimen, options), specimen.material)
        displacement = 1e-4 * np.sin(np.arange(3.0 * body.nodes)).reshape(-1, 3)
        body.tangent(displacement)
        ours, theirs = timed(body.tangent, displacement, repeat=5), timed(generic, body, displacement, repeat=1)
        force = timed(body.internal_force, displacement, repeat=5)
        print(
            f"{len(body.cells)} elements, {3 * body.nodes} unknowns: kernel {1e3 * ours:.1f} ms, scikit-fem form "
            f"{1e3 * theirs:.0f} ms, ratio {theirs / ours:.0f}; force only {1e3 * force:.2f} ms"
        )


if __name__ == "__main__":
    main()
