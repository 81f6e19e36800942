"""A rubber bracket with a hole, meshed by gmsh with ten-node tetrahedra: hang a weight on it, then let it ring.

The mesh comes in as gmsh and meshio see it; a file of your own is read by ``meshes.read_mesh`` in the same way.
"""

import tempfile
from pathlib import Path

import gmsh

from fea import Body, Case, static, vibrations
from lab.materials import material
from meshes import read_mesh


def mesh_file(folder: Path) -> Path:
    """A plate 60 x 20 x 6 mm with a hole of 10 mm; surfaces named wall and lip."""
    gmsh.initialize(interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    shape = gmsh.model.occ
    shape.cut([(3, shape.addBox(0, 0, 0, 60, 20, 6))], [(3, shape.addCylinder(30, 10, 0, 0, 0, 6, 5))])
    shape.dilate([(3, 1)], 0, 0, 0, 1e-3, 1e-3, 1e-3)
    shape.synchronize()
    for tag, name, x in ((1, "wall", 0.0), (2, "lip", 0.06)):
        faces = gmsh.model.getEntitiesInBoundingBox(x - 1e-6, -1, -1, x + 1e-6, 1, 1, 2)
        gmsh.model.addPhysicalGroup(2, [face for _, face in faces], tag, name)
    gmsh.model.addPhysicalGroup(3, [1], 3, "bracket")
    gmsh.option.setNumber("Mesh.MeshSizeMax", 5e-3)
    gmsh.model.mesh.generate(3)
    gmsh.model.mesh.setOrder(2)
    gmsh.model.mesh.optimize("HighOrder")
    path = folder / "bracket.msh"
    gmsh.write(str(path))
    gmsh.finalize()
    return path


with tempfile.TemporaryDirectory() as folder:
    mesh = read_mesh(mesh_file(Path(folder)))

rubber = material("tpu-95a").model_copy(update={"law": "nearly-incompressible-neo-hookean", "poisson_ratio": 0.495})
bracket = Body(mesh, rubber)

case = Case(bracket).fix("wall").gravity((0.0, 0.0, -9.81)).watch("lip", "lip")
case.rigid("weight", "lip", mass=0.1)  # 100 g, glued to the lip

hung = static(case, [0.5, 1.0])
sag = 1e3 * hung.displacement("weight")[-1, 2]  # mm
held = hung.reaction("wall")[-1, 2]  # N
ringing = vibrations(case, 3, at=hung).frequencies  # Hz


if __name__ == "__main__":
    print(f"{len(bracket.cells)} tetrahedra, {3 * bracket.nodes} displacements")
    print(f"hangs {sag:.2f} mm down; the wall bears {held:.3f} N")
    print("rings at " + ", ".join(f"{f:.1f}" for f in ringing) + " Hz")
