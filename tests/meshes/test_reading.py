"""Mesh files of users: node orders proven by geometry, groups, and what is refused."""

import meshio
import numpy as np
import pytest
from skfem import Basis, ElementHex2, ElementTetP2, FacetBasis

from meshes import MeshError, from_meshio, read_mesh, solid_mesh
from meshes.gathering import HEXAHEDRON, TETRAHEDRON, element_places, jacobians

RADIUS, LENGTH = 0.02, 0.03


@pytest.fixture
def gmsh():
    import gmsh

    gmsh.initialize(["-noenv"], readConfigFiles=False, interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    yield gmsh
    gmsh.finalize()


def write_cylinder(gmsh, path, size=0.008, **options):
    """Solid cylinder about z with the groups foot, mantle and body."""
    gmsh.model.occ.addCylinder(0, 0, 0, 0, 0, LENGTH, RADIUS)
    gmsh.model.occ.synchronize()
    mantle, top, foot = (tag for _, tag in gmsh.model.getEntities(2))
    for dim, tag, name in ((2, foot, "foot"), (2, mantle, "mantle"), (2, top, "head"), (3, 1, "body")):
        gmsh.model.addPhysicalGroup(dim, [tag], name=name)
    mesh(gmsh, path, 3, size, **options)


def write_panels(gmsh, path, turned=False, **options):
    """Quarter of a cylinder wall about z in two surfaces, one perhaps inside out, with the edges foot and seam."""
    geo = gmsh.model.geo
    centre, start = geo.addPoint(0, 0, 0), geo.addPoint(RADIUS, 0, 0)
    middle = geo.addPoint(RADIUS * np.cos(0.6), RADIUS * np.sin(0.6), 0)
    end = geo.addPoint(0, RADIUS, 0)
    ends = (end, middle) if turned else (middle, end)
    arcs = [geo.addCircleArc(start, centre, middle), geo.addCircleArc(ends[0], centre, ends[1])]
    walls = [geo.extrude([(1, arc)], 0, 0, LENGTH, [3], recombine=True)[1][1] for arc in arcs]
    geo.removeAllDuplicates()
    geo.synchronize()
    gmsh.model.addPhysicalGroup(1, arcs, name="foot")
    gmsh.model.addPhysicalGroup(2, [walls[0]], name="first")
    gmsh.model.addPhysicalGroup(2, [walls[1]], name="second")
    mesh(gmsh, path, 2, 0.006, **options)


def mesh(gmsh, path, dimension, size, order=2, incomplete=0):
    gmsh.option.setNumber("Mesh.MeshSizeMax", size)
    gmsh.option.setNumber("Mesh.SecondOrderIncomplete", incomplete)
    gmsh.option.setNumber("Mesh.RecombineAll", int(dimension == 2))
    gmsh.model.mesh.generate(dimension)
    gmsh.model.mesh.setOrder(order)
    gmsh.write(str(path))


def test_tetrahedra(gmsh, tmp_path):
    write_cylinder(gmsh, tmp_path / "c.msh")
    found = read_mesh(tmp_path / "c.msh")
    assert type(found).__name__ == "MeshTet2"
    places = element_places(found)
    assert jacobians(TETRAHEDRON, places).min() > 0
    exact = np.pi * RADIUS**2 * LENGTH
    assert Basis(found, ElementTetP2(), intorder=4).dx.sum() == pytest.approx(exact, rel=2e-3)
    # The edges' nodes are on the circle: straight edges would miss more of the volume.
    straight = np.linalg.det(places[:, 1:4] - places[:, :1]).sum() / 6
    assert straight < 0.99 * exact
    areas = {"foot": np.pi * RADIUS**2, "head": np.pi * RADIUS**2, "mantle": 2 * np.pi * RADIUS * LENGTH}
    for name, area in areas.items():
        face = FacetBasis(found, ElementTetP2(), facets=found.boundaries[name], intorder=4)
        assert face.dx.sum() == pytest.approx(area, rel=3e-3)
    assert len(found.subdomains["body"]) == found.t.shape[1]


@pytest.mark.parametrize("turned", [False, True])
def test_quadrilaterals(gmsh, tmp_path, turned):
    write_panels(gmsh, tmp_path / "p.msh", turned)
    found = read_mesh(tmp_path / "p.msh")
    assert type(found).__name__ == "MeshQuad2"
    places = element_places(found)
    np.testing.assert_allclose(np.linalg.norm(found.doflocs[:2], axis=0), RADIUS, rtol=1e-6)
    # Corner, middle of the first edge, corner: in this order along the arc or along the axis.
    middles = (places[:, [0, 1, 2, 3]] + places[:, [1, 2, 3, 0]]) / 2
    sizes = np.linalg.norm(places[:, 0] - places[:, 2], axis=1)
    assert (np.abs(places[:, 4:8] - middles).max(axis=(1, 2)) < 0.1 * sizes).all()
    np.testing.assert_allclose(places[:, 8], places[:, :4].mean(axis=1), atol=0.1 * sizes.max())
    along, across = places[:, 1] - places[:, 0], places[:, 3] - places[:, 0]
    outward = np.einsum("ec,ec->e", np.cross(along, across), places[:, 8] * [1, 1, 0])
    assert (outward > 0).all() or (outward < 0).all()
    ends = found.facets[:, found.boundaries["foot"]]
    np.testing.assert_allclose(found.doflocs[2, ends], 0.0, atol=1e-12)
    assert len(found.subdomains["first"]) + len(found.subdomains["second"]) == found.t.shape[1]


def test_one_group_is_a_part(gmsh, tmp_path):
    write_panels(gmsh, tmp_path / "p.msh")
    whole, part = read_mesh(tmp_path / "p.msh"), read_mesh(tmp_path / "p.msh", group="second")
    assert part.t.shape[1] == len(whole.subdomains["second"])
    angle = np.arctan2(part.doflocs[1], part.doflocs[0])
    assert angle.min() == pytest.approx(0.6)
    assert angle.max() == pytest.approx(np.pi / 2)
    assert 0 < len(part.boundaries["foot"]) < len(whole.boundaries["foot"])
    with pytest.raises(MeshError, match="no group 'third'.*first, second"):
        read_mesh(tmp_path / "p.msh", group="third")


@pytest.mark.parametrize(("order", "incomplete", "name"), [(1, 0, "quad"), (2, 1, "quad8")])
def test_poorer_quadrilaterals(gmsh, tmp_path, order, incomplete, name):
    write_panels(gmsh, tmp_path / "p.msh", order=order, incomplete=incomplete)
    with pytest.raises(MeshError, match=f"p.msh: the mesh holds {name} cells.*SecondOrderIncomplete = 0.*promote=True"):
        read_mesh(tmp_path / "p.msh")
    radii = np.linalg.norm(read_mesh(tmp_path / "p.msh", promote=True).doflocs[:2], axis=0)
    assert radii.max() == pytest.approx(RADIUS)
    # Straight edges cut the corner of the arc, curved ones do not.
    assert (radii.min() / RADIUS > 0.9999) == (order == 2)


def distorted_hexahedra():
    """Two cells whose shape is within reach of a serendipity cell."""

    def place(a, b, c):
        return np.column_stack([a + 0.1 * b**2, b + 0.2 * a * c, c + 0.1 * a**2 - 0.1 * a * b])

    return solid_mesh((2, 1, 1), place)


@pytest.mark.parametrize(("name", "nodes"), [("hexahedron27", 27), ("hexahedron20", 20)])
def test_hexahedra_from_meshio(name, nodes):
    from meshes.node_order import skfem_to_vtk

    mine = distorted_hexahedra()
    rows = mine.dofs.element_dofs.T[:, skfem_to_vtk()][:, :nodes]
    root = mine.facets[:, mine.boundaries["a0"]].T
    data = meshio.Mesh(
        mine.doflocs.T, [(name, rows[:1]), ("quad", root), (name, rows[1:])],
        cell_sets={"foot": [[], [0], []], "far": [[], [], [0]]},
        point_sets={"side": np.arange(mine.doflocs.shape[1])},
    )  # fmt: skip
    found = from_meshio(data, promote=True)
    assert found.doflocs.shape == mine.doflocs.shape
    np.testing.assert_allclose(element_places(found), element_places(mine), atol=1e-14)
    assert jacobians(HEXAHEDRON, element_places(found)).min() > 0
    assert Basis(found, ElementHex2(), intorder=5).dx.sum() == pytest.approx(
        Basis(mine, ElementHex2(), intorder=5).dx.sum(), rel=1e-13
    )
    (facet,) = found.boundaries["foot"]
    assert found.doflocs[0, found.facets[:, facet]].max() < 0.11
    np.testing.assert_array_equal(found.subdomains["far"], [1])
    np.testing.assert_array_equal(found.boundaries["side"], found.boundary_facets())


def test_linear_cells_are_promoted_exactly():
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]], float)
    data = meshio.Mesh(corners, [("tetra", np.array([[0, 1, 2, 3], [1, 2, 3, 4]]))])
    found = from_meshio(data, promote=True)
    assert found.doflocs.shape == (3, 5 + 9)
    assert Basis(found, ElementTetP2(), intorder=2).dx.sum() == pytest.approx(1 / 6 + 1 / 3)
    cube = np.array([[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], float)
    found = from_meshio(meshio.Mesh(cube, [("hexahedron", np.arange(8)[None])]), promote=True)
    assert Basis(found, ElementHex2(), intorder=5).dx.sum() == pytest.approx(1.5)


TETRA = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float)


@pytest.mark.parametrize(
    ("cells", "said"),
    [
        ([("tetra", [[0, 1, 2, 3]])], "the mesh holds tetra cells.*Mesh.ElementOrder = 2"),
        ([("triangle", [[0, 1, 2]])], "triangle cells.*RecombineAll"),
        ([("tetra", [[0, 1, 2, 3]]), ("hexahedron", [[0, 1, 2, 3, 0, 1, 2, 3]])], "mixes hexahedron, tetra"),
        ([("line", [[0, 1]])], "the mesh holds line; 27-node hexahedra"),
        ([("wedge", [[0, 1, 2, 3, 3, 3]])], "wedge cells, for which there is no element.*mesh the body anew"),
    ],
)
def test_refused_kinds(cells, said):
    data = meshio.Mesh(TETRA, [(name, np.array(rows)) for name, rows in cells])
    with pytest.raises(MeshError, match=said):
        from_meshio(data)


def test_refused_shapes():
    inverted = meshio.Mesh(TETRA, [("tetra", np.array([[0, 2, 1, 3]]))])
    with pytest.raises(MeshError, match=r"1 of 1 elements are inverted or folded.*element 0 .* about \(0.25, 0.25"):
        from_meshio(inverted, promote=True)
    nowhere = meshio.Mesh(TETRA * np.nan, [("tetra", np.array([[0, 1, 2, 3]]))])
    with pytest.raises(MeshError, match="element 0 has a node that is nowhere"):
        from_meshio(nowhere, promote=True)
    fan = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0, 0, 1], [1, 0, 1], [0, -1, 0], [1, -1, 0]], float)
    sheets = meshio.Mesh(fan, [("quad", np.array([[0, 1, 3, 2], [0, 1, 5, 4], [0, 1, 7, 6]]))])
    with pytest.raises(MeshError, match="more than two surface elements meet at an edge"):
        from_meshio(sheets, promote=True)


def test_a_strip_with_one_side_is_refused():
    turn = 2 * np.pi * np.arange(6) / 6
    half = 0.3 * np.column_stack([np.cos(turn / 2) * np.cos(turn), np.cos(turn / 2) * np.sin(turn), np.sin(turn / 2)])
    middle = np.column_stack([np.cos(turn), np.sin(turn), 0 * turn])
    points = np.vstack([middle + half, middle - half])
    quads = [[i, i + 1, i + 7, i + 6] for i in range(5)] + [[5, 6, 0, 11]]
    with pytest.raises(MeshError, match="one side only"):
        from_meshio(meshio.Mesh(points, [("quad", np.array(quads))]), promote=True)
