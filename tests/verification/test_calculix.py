"""Two devices of the project against CalculiX on the same meshes; ``-s`` shows the figures."""

import numpy as np
import pytest

from fea import Body, Case, Shell, static
from lab.materials import Material
from lab.specimens import TwistedBeam
from meshes.block import beam_mesh, block_mesh
from meshes.options import MeshOptions
from tests.verification.calculix import INSTALL, Deck, program, solve
from tests.verification.devices import PinchedTube, prescribed

pytestmark = pytest.mark.skipif(program() is None, reason=f"CalculiX is not installed; {INSTALL}")


def show(what, reference, ours):
    print(f"{what}: CalculiX {reference:.6g}, ours {ours:.6g}, error {100 * (ours / reference - 1):+.3f} %")


def eight_node_shares(body, boundary):
    """Shares (nodes,) of an even dead traction on parallelograms whose middle nodes the element has not."""
    surface = body.surface(boundary)
    tangents = np.einsum("qjk,fkc->fqjc", surface.shapes().slopes, body.points[surface.facets])
    areas = np.linalg.norm(np.cross(tangents[:, :, 0], tangents[:, :, 1]), axis=2) @ surface.shapes().weights
    shares = np.zeros(body.nodes)
    for node, factor in enumerate([-1 / 12] * 4 + [1 / 3] * 4):
        np.add.at(shares, surface.facets[:, node], factor * areas / areas.sum())
    return shares


def test_both_mean_the_same_material(tmp_path):
    material = Material(youngs_modulus=26e6, poisson_ratio=0.45)
    body = Body(block_mesh((2e-3, 1e-3, 1e-3), MeshOptions(along=2, across=1, through=1)), material)
    case = Case(body).fix("root", "x").fix("tip", "x", to=0.6e-3)
    case.fix(lambda p: p[:, 1] < 1e-9, "y").fix(lambda p: p[:, 2] < 1e-9, "z").watch("tip", "tip")
    theirs = solve(Deck(body, "C3D20", prescribed(case), case.watched["tip"]), tmp_path).reactions[-1, 0]
    ours = static(case).reaction("tip")[-1, 0]
    show("force at a stretch of 1.3, N", theirs, ours)
    # Saint Venant-Kirchhoff in uniaxial stress: S = E (l^2 - 1) / 2, P = l S.
    assert ours == pytest.approx(1e-6 * 1.3 * 26e6 * (1.3**2 - 1) / 2, rel=1e-7)
    assert theirs == pytest.approx(ours, rel=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("twist", [np.pi / 4, np.pi / 2])
def test_twisted_beam_under_a_large_load(tmp_path, twist):
    specimen = TwistedBeam(twist=twist)
    body = Body(beam_mesh(specimen, MeshOptions(along=16, across=4, through=2)), specimen.material)
    case = Case(body).fix("root").force("tip", (0.0, 0.3, 1.5))
    tip = case.select((specimen.length, 0.0, 0.0))
    deck = Deck(body, "C3D20R", prescribed(case), tip, np.outer(eight_node_shares(body, "tip"), (0.0, 0.3, 1.5)))
    theirs = solve(deck, tmp_path).displacements[int(tip[0])]
    run = static(case)
    ours = run.displacement(tip)[-1]
    for axis in range(3):
        show(f"tip displacement along {'xyz'[axis]}, mm", 1e3 * theirs[axis], 1e3 * ours[axis])
    assert np.linalg.norm(theirs) > 0.5 * specimen.length
    assert run.completed
    assert np.linalg.norm(ours - theirs) < 0.01 * np.linalg.norm(theirs)


@pytest.mark.slow
def test_pinched_tube(tmp_path):
    case = PinchedTube().case("hexahedra", 12, 20, 20e-3)
    assert len(case.parts[0].cells) == 240
    theirs = -solve(Deck(case.parts[0], "C3D20", prescribed(case), case.watched["stamp"]), tmp_path).reactions[-1, 2]
    run = static(case)
    ours = -run.reaction("stamp")[-1, 2]
    show("force at 20 mm, N", theirs, ours)
    assert run.completed
    assert ours == pytest.approx(theirs, rel=0.01)


@pytest.mark.slow
def test_pinched_tube_as_a_shell(tmp_path):
    tube = PinchedTube()
    solid, thin = (tube.case(kind, 12, 20, 20e-3) for kind in ("hexahedra", "shell"))
    assert isinstance(thin.parts[0], Shell)
    deck = Deck(solid.parts[0], "C3D20R", prescribed(solid), solid.watched["stamp"])
    theirs = -solve(deck, tmp_path).reactions[-1, 2]
    ours = -static(thin).reaction("stamp")[-1, 2]
    show("force at 20 mm, N", theirs, ours)
    assert ours == pytest.approx(theirs, rel=0.01)
