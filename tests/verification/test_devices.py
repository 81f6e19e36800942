"""Shells against solids on the devices of the project, each converged on its own mesh.

A shell leaves out what happens within about one thickness of a clamped face (there the solid cannot grow
thicker or thinner, which a plane state of stress does not know): with Poisson's ratio 0.45 this is worth 1 %
of a stiffness of the beam, which is 17 times as long as thick and held at both ends.
"""

import numpy as np
import pytest
from scipy.sparse.linalg import eigsh

from fea import FeaModel, perform
from fea.body import Body
from fea.case import Case
from fea.dynamics import axes_of
from fea.newton import Options
from fea.ring_down import Carrier
from fea.setting_up import make_part
from fea.shell import Shell
from fea.statics import Steer, static
from lab.experiments import RingDown, StaticStiffness
from lab.materials import Material
from lab.specimens import TwistedBeam
from meshes import MeshOptions, from_meshio, solid_mesh, surface_mesh, thickened
from meshes.block import beam_mesh, beam_surface

#: The default solid refined by half in every direction: within 0.4 % of the next refinement.
FINE = MeshOptions(along=24, across=6, through=3)
TWISTS = [0, 45, 90]


def compare(names, solid, shell, scale=None, tolerance=0.01):
    """Print reference, ours and error, and hold the error below the tolerance."""
    solid, shell = np.atleast_1d(solid), np.atleast_1d(shell)
    errors = (shell - solid) / (solid if scale is None else scale)
    for name, one, other, error in zip(names, solid, shell, errors, strict=True):
        print(f"{name}: solid {one:.6g}, shell {other:.6g}, error {100 * error:+.2f} %")
    assert np.abs(errors).max() < tolerance


def beam(degrees):
    return TwistedBeam(twist=np.deg2rad(degrees), mass=5.17e-3)


def parts(specimen, motion=True):
    """The beam in fine hexahedra, and in the shells that the experiments get by default."""
    model = FeaModel(element="shell")
    options = model.motion_mesh if motion else model.mesh
    return (
        make_part(specimen, FeaModel(), beam_mesh(specimen, FINE)),
        make_part(specimen, model, beam_surface(specimen, options)),
    )


def frequencies(part, count=3):
    free = np.setdiff1d(np.arange(3 * part.nodes), axes_of(part.boundary("root")))
    pattern, taken = part.pattern.restrict(free)
    stiffness = pattern.full(part.tangent(np.zeros((part.nodes, 3)))[1][taken])
    squares = eigsh(
        stiffness.tocsc(), count, pattern.full(part.mass()[taken]).tocsc(), sigma=0.0, return_eigenvectors=False
    )
    return np.sqrt(np.sort(squares)) / (2 * np.pi)


@pytest.mark.parametrize("degrees", TWISTS)
def test_frequencies_of_the_beam(degrees):
    compare(["f1 [Hz]", "f2 [Hz]", "f3 [Hz]"], *map(frequencies, parts(beam(degrees))))


def hanging(part, direction):
    """Displacement of the tip's centre under the load of the ring-down (3,), m."""
    experiment = RingDown(direction=direction)
    run = static(Case(part).fix("root").force("tip", experiment.load))
    return Carrier(part, np.array(experiment.markers)).read(run.field())[1]


@pytest.mark.slow
@pytest.mark.parametrize("direction", [0.0, np.pi / 2])
@pytest.mark.parametrize("degrees", TWISTS)
def test_hanging_load(degrees, direction):
    solid, shell = (hanging(part, direction) for part in parts(beam(degrees)))
    compare(["x [m]", "y [m]", "z [m]"], solid, shell, np.linalg.norm(solid))


@pytest.mark.slow
@pytest.mark.parametrize("degrees", [0, 45, 90])
def test_static_stiffness(degrees):
    """Entries relative to the size of their block, which does not change when the axes are turned."""
    specimen, experiment = beam(degrees), StaticStiffness(increments=3)
    shells = FeaModel(element="shell", tolerance=1e-6)
    solid, shell = (
        experiment.reduce(perform(specimen, experiment, model, mesh))
        for model, mesh in (
            (FeaModel(tolerance=1e-6), beam_mesh(specimen, FINE)),
            (shells, beam_surface(specimen, shells.mesh)),
        )
    )
    names = ["k_yy", "k_yz", "k_zy", "k_zz"]
    one, other = (np.array([record[name].value for name in names]) for record in (solid, shell))
    compare(names, one, other, np.linalg.norm(one))
    compare(["n_xx"], solid["n_xx"].value, shell["n_xx"].value)


# ---- the pinched tube: one eighth of a tube with clamped ends ----

RADIUS, LENGTH, WALL, SPREAD = 24.5e-3, 100e-3, 1e-3, 5e-3
EDGES = ("middle", "end", "crest", "side")


def tube(along, around):
    """Eighth of the tube's middle surface (n, 3), m; elements crowd to the pinched spot (0, RADIUS, 0)."""
    angle = np.pi / 2 * np.sign(around) * np.abs(around) ** 1.3
    return np.column_stack(
        [RADIUS * np.sin(angle), RADIUS * np.cos(angle), LENGTH / 2 * np.sign(along) * np.abs(along) ** 1.3]
    )


def pinching_force(part, travel=12.5e-3, levels=(0.25, 0.5, 0.75, 1.0)):
    """Force (levels,), N, whose bell-shaped spread of 5 mm moves the spot by shares of half the radius."""
    case = Case(part).fix("end").symmetry("middle", "z").symmetry("crest", "x").symmetry("side", "y")
    x, y, z = part.points.T
    bell = np.exp(-((np.arctan2(x, y) * RADIUS) ** 2 + z**2) / (2 * SPREAD**2))
    weights = bell * (part.surface("top").areas(part.points) + part.surface("bottom").areas(part.points))
    weights /= weights.sum()
    for node in np.flatnonzero(weights > 1e-6):
        case.force(np.array([node]), (0.0, -weights[node], 0.0))
    # A shell's normals at the edge of its mesh are out of the plane of symmetry by micrometres.
    case.watch("spot", np.flatnonzero((np.abs(x) < 0.02 * WALL) & (z < 0.02 * WALL) & (y > 0)))
    run = static(case, levels, Steer("spot", "y", -travel), options=Options(tolerance=1e-6))
    assert run.completed, run.reason
    return 4 * run.t[1:]


@pytest.mark.slow
def test_pinched_tube():
    shell = Shell(surface_mesh((12, 12), tube, EDGES), WALL, Material())
    solid = Body(solid_mesh((24, 24, 1), thickened(tube, WALL), (*EDGES, "bottom", "top")), Material())
    names = [f"force [N] at {share} of 12.5 mm" for share in (0.25, 0.5, 0.75, 1.0)]
    compare(names, pinching_force(solid), pinching_force(shell))


# ---- fin on a tube: a cylinder and its mirror image meet in a plane crease ----

CREASE, ARC, TILT, SHEET = 25e-3, np.deg2rad(40), np.deg2rad(30), 1.5e-3


def finned(along, around):
    """Half of a cylindrical panel up to the crease, and of the fin beyond it (n, 3), m; folded by 60 degrees."""
    x, y = 25e-3 * np.sin(ARC * around), 25e-3 * (np.cos(ARC * around) - 1)
    crease = CREASE - np.tan(TILT) * y
    fin = along > 0.5
    panel = np.column_stack([x, y, np.where(fin, crease - 25e-3 * (2 * along - 1), crease * 2 * along)])
    normal = np.array([0.0, np.sin(TILT), np.cos(TILT)])
    image = panel - 2 * ((panel - [0, 0, CREASE]) @ normal)[:, None] * normal
    return np.where(fin[:, None], image, panel)


def fin_shell(along, around):
    return Shell(surface_mesh((along, around), finned, ("root", "end", "middle", "free")), SHEET, Material())


def in_hexahedra(shell):
    """The body of a shell, mitre included, in one layer of 27-node hexahedra."""
    import meshio

    points, cells, _, carry = shell.picture()
    sets = {}
    for name in shell.mesh.boundaries:
        mark = np.zeros((shell.nodes, 3))
        mark[shell.boundary(name)] = 1.0
        sets[name] = np.flatnonzero(carry(mark)[:, 0] == 1.0)
    return Body(from_meshio(meshio.Mesh(points, [("hexahedron27", cells)], point_sets=sets)), shell.material)


def fin_force(part, levels=(0.25, 0.5, 0.75, 1.0)):
    """Force (levels,), N, on the fin's end that moves it by shares of 10 mm."""
    case = Case(part).fix("root").symmetry("middle", "x").force("end", (0.0, 1.0, 0.0)).watch("end", "end")
    run = static(case, levels, Steer("end", "y", 10e-3), options=Options(tolerance=1e-6))
    assert run.completed, run.reason
    return 2 * run.t[1:]


def test_fin_on_a_crease():
    solid, shell = fin_force(in_hexahedra(fin_shell(36, 12))), fin_force(fin_shell(16, 6))
    names = [f"force [N] at {share} of 10 mm" for share in (0.25, 0.5, 0.75, 1.0)]
    compare(names, solid, shell, solid[-1])
