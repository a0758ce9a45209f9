"""Bodies of tetrahedra, hexahedra and wedges: exact states, scikit-fem's own matrices, groups."""

import re

import gmsh
import numpy as np
import pytest
import skfem
from numpy.testing import assert_allclose

from carrierflex.fe.materials import STEEL
from carrierflex.fe.matrices import node_files
from carrierflex.fe.matrices.interface_files import read_interfaces
from carrierflex.fe.matrices.node_files import numbers_in_turn
from carrierflex.fe.scikit_fem_path import mass_form, stiffness_form
from carrierflex.fe.solids.given_solids import solid_body
from carrierflex.fe.solids.solid_matrices import inverted_elements, solid_matrices
from carrierflex.fe.surface_integrals import rigid_body_modes
from carrierflex.geometry import mesh_files
from carrierflex.geometry.given_meshes import foreign_files
from carrierflex.geometry.given_meshes.solid_files import SolidMesh, read_solid_mesh
from carrierflex.geometry.half_sector import quiet_geometry
from carrierflex.geometry.mesh_files import read_mesh

#: Two blocks of 1 x 0.5 x 0.5 on one another along x.
LENGTHS = (1.0, 0.5, 0.5)
SIZES = {
    "tetra": 1,
    "tetra10": 2,
    "hexahedron": 1,
    "hexahedron20": 2,
    "hexahedron27": 2,
    "wedge": 1,
}
FORMATS = (".msh", ".unv", ".med", ".inp", ".bdf")
INTERFACES = """format = "carrierflex-interfaces"
version = 1
name = "blocks"
[materials.{first}]
E = 2.1e11
nu = 0.3
rho = 7850.0
[materials.{second}]
E = 7e10
nu = 0.33
rho = 2700.0
[[pilots]]
name = "start"
type = "distributing"
{start}
[[pilots]]
name = "end"
type = "distributing"
{end}
"""


def blocks(kind, path, *, warp=0.0):
    """Write two joined blocks of elements of a kind, groups left, right, start and end."""
    with quiet_geometry():
        geo = gmsh.model.geo
        corners = [geo.addPoint(0.0, y, z) for y, z in ((0, 0), (0.5, 0), (0.5, 0.5), (0, 0.5))]
        lines = [geo.addLine(corners[i], corners[(i + 1) % 4]) for i in range(4)]
        face = geo.addPlaneSurface([geo.addCurveLoop(lines)])
        is_wedge, is_hex = kind == "wedge", kind.startswith("hexa")
        for line in lines:
            geo.mesh.setTransfiniteCurve(line, 3)
        geo.mesh.setTransfiniteSurface(face)
        if is_hex:
            geo.mesh.setRecombine(2, face)
        layers = {"numElements": [2], "recombine": is_hex or is_wedge}
        left = geo.extrude([(2, face)], LENGTHS[0], 0.0, 0.0, **layers)
        right = geo.extrude([left[0]], LENGTHS[0], 0.0, 0.0, **layers)
        geo.synchronize()
        for dimension, tag, name in (
            (3, left[1][1], "left"), (3, right[1][1], "right"), (2, face, "start"),
            (2, right[0][1], "end"),
        ):  # fmt: skip
            gmsh.model.addPhysicalGroup(dimension, [tag], name=name)
        gmsh.option.setNumber("Mesh.SecondOrderIncomplete", float(kind == "hexahedron20"))
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.setOrder(SIZES[kind])
        if warp:
            for tag in gmsh.model.mesh.getNodes()[0]:
                x, y, z = gmsh.model.mesh.getNode(tag)[0]
                moved = [x + warp * y * z, y + warp * x * x, z - warp * x * y]
                gmsh.model.mesh.setNode(tag, moved, [])
        gmsh.option.setNumber("Mesh.SaveGroupsOfNodes", 1)
        gmsh.option.setNumber("Mesh.SaveGroupsOfElements", 1)
        gmsh.write(str(path))
    return path


def read(path):
    return read_solid_mesh(path, numbers_in_turn)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("solids")


@pytest.fixture
def read_here(monkeypatch):
    """Meshes are read in this process: a Python of its own for each costs seconds."""
    for module in (foreign_files, mesh_files, node_files):
        monkeypatch.setattr(
            module, "in_child", lambda function, *arguments, about, what: function(*arguments)
        )


@pytest.fixture(params=SIZES)
def kind(request):
    return request.param


def test_matrices_know_rigid_motions_constant_strain_and_mass(kind, folder):
    mesh = read(blocks(kind, folder / f"{kind}_warped.msh", warp=0.1 * (SIZES[kind] == 1)))
    assert {name for name, _, _ in mesh.blocks} == {kind}
    K, M = solid_matrices(mesh, {"left": STEEL, "right": STEEL})
    R = rigid_body_modes(mesh.points, np.zeros((0, 3)), np.zeros(3))
    assert np.abs(K @ R).max() < 1e-12 * abs(K).max() * 2.0
    # Energy of a constant strain: volume times its density.
    volume = float(R[:, 0] @ M @ R[:, 0]) / STEEL.rho
    strain = np.array([[1.0, 0.3, -0.2], [0.3, -0.5, 0.1], [-0.2, 0.1, 0.4]]) * 1e-3
    u = (mesh.points @ strain).ravel()
    lam, mu = STEEL.lame
    density = 0.5 * lam * np.trace(strain) ** 2 + mu * (strain**2).sum()
    assert_allclose(0.5 * u @ K @ u, density * volume, rtol=1e-10)
    if SIZES[kind] == 2:
        assert_allclose(volume, 0.5, rtol=1e-12)


# scikit-fem's rule of a wedge sums to half the volume; exact states are above.
@pytest.mark.parametrize("kind", [name for name in SIZES if name != "wedge"], indirect=True)
def test_matrices_are_scikit_fems(kind, folder):
    mesh = read(blocks(kind, folder / f"{kind}_peer.msh"))
    element = {
        "tetra": (skfem.MeshTet1, skfem.ElementTetP1),
        "tetra10": (skfem.MeshTet1, skfem.ElementTetP2),
        "hexahedron": (skfem.MeshHex1, skfem.ElementHex1),
        "hexahedron20": (skfem.MeshHex1, skfem.ElementHexS2),
        "hexahedron27": (skfem.MeshHex1, skfem.ElementHex2),
    }[kind]  # fmt: skip
    corners = np.concatenate([nodes for _, _, nodes in mesh.blocks])
    corners = corners[:, : 4 if kind.startswith("tetra") else 8]
    used, rows = np.unique(corners, return_inverse=True)
    rows = rows.reshape(corners.shape)
    if kind.startswith("hexa"):
        # scikit-fem numbers corners by its own places.
        theirs = np.asarray(skfem.ElementHex1.doflocs)
        ours = np.array([(x, y, z) for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))])
        rows = rows[:, [int(np.argmin(np.abs(ours - corner).sum(axis=1))) for corner in theirs]]
    basis = skfem.Basis(
        element[0](mesh.points[used].T, rows.T), skfem.ElementVector(element[1]()), intorder=6
    )
    expected_K = stiffness_form(*STEEL.lame).assemble(basis).tocsr()
    expected_M = mass_form(STEEL.rho).assemble(basis).tocsr()
    K, M = solid_matrices(mesh, {"left": STEEL, "right": STEEL})
    # The same degrees of freedom by their places.
    positions = basis.doflocs.T
    node = np.array([np.linalg.norm(mesh.points - p, axis=1).argmin() for p in positions])
    axis = np.zeros(len(node), dtype=int)
    for a in range(3):
        for group in (basis.nodal_dofs, basis.edge_dofs, basis.facet_dofs, basis.interior_dofs):
            if len(group):
                axis[group[a::3].ravel()] = a
    order = 3 * node + axis
    for result, expected in ((K, expected_K), (M, expected_M)):
        # Mid-side nodes of the file are rounded; scikit-fem's elements are straight.
        assert abs(result[order][:, order] - expected).max() < 1e-11 * abs(expected).max()


@pytest.mark.parametrize("suffix", FORMATS)
def test_groups_and_materials_survive_every_format(suffix, folder):
    mesh = read(blocks("hexahedron", folder / f"groups{suffix}"))
    counts = {}
    for _, group, nodes in mesh.blocks:
        counts[group] = counts.get(group, 0) + len(nodes)
    names = ["1", "2"] if suffix == ".bdf" else ["left", "right"]
    assert sorted(name.lower() for name in counts) == names
    assert list(counts.values()) == [8, 8]
    if suffix in (".msh", ".unv", ".med"):
        for name, x in (("start", 0.0), ("end", 2.0)):
            assert_allclose(mesh.points[mesh.node_sets[name], 0], x, atol=1e-12)
            assert len(mesh.node_sets[name]) == 9


@pytest.mark.parametrize("suffix", [".msh", ".inp"])
def test_two_bodies_of_two_materials_are_one_body(suffix, folder):
    path = blocks("hexahedron20", folder / f"two{suffix}")
    text = INTERFACES.format(
        first="left", second="right", start='node_set = "start"', end='node_set = "end"'
    )
    toml = folder / f"two{suffix}.toml"
    toml.write_text(text)
    body = solid_body(path, read_interfaces(toml))
    R = body.structure.rigid_modes
    assert_allclose(R[:, 0] @ body.structure.M @ R[:, 0], 0.25 * (7850.0 + 2700.0), rtol=1e-12)
    assert body.warnings == ()
    millimetres = text.replace("[materials.left]", "[units]\nlength = 0.001\n[materials.left]")
    toml.write_text(millimetres)
    with_warning = solid_body(path, read_interfaces(toml))
    assert_allclose(abs(with_warning.structure.K).max(), abs(body.structure.K).max() * 1e-3)


def test_what_cannot_be_computed_with_is_refused_with_kind_and_count(folder):
    with quiet_geometry():
        points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 0.5, 1.0)]
        volume = gmsh.model.addDiscreteEntity(3)
        gmsh.model.mesh.addNodes(3, volume, range(1, 6), np.ravel(points).astype(float))
        gmsh.model.mesh.addElementsByType(volume, 7, [1], [1, 2, 3, 4, 5])
        gmsh.write(str(folder / "pyramid.msh"))
    with pytest.raises(ValueError, match=r"pyramid.msh: 1 elements of type Pyramid 5; expected "):
        read(folder / "pyramid.msh")
    path = blocks("tetra", folder / "linear.msh")
    toml = folder / "linear.toml"
    text = INTERFACES.format(
        first="left", second="other", start='node_set = "start"', end='node_set = "end"'
    )
    toml.write_text(text)
    with pytest.raises(ValueError, match=r"groups of elements 'left', 'right', materials for left"):
        solid_body(path, read_interfaces(toml))
    toml.write_text(text.replace("other", "right"))
    warnings = solid_body(path, read_interfaces(toml)).warnings
    assert any("too stiff in bending" in line for line in warnings)


def test_inverted_elements_are_refused(folder):
    mesh = read(blocks("hexahedron", folder / "inverted.msh"))
    turned = SolidMesh(mesh.points * [1.0, 1.0, -1.0], mesh.numbers, mesh.blocks)
    assert sum(count for _, _, count in inverted_elements(turned)) == 16
    assert not list(inverted_elements(mesh))


@pytest.mark.parametrize(
    ("scale", "length", "warning"),
    [
        (1.0, 0.001, "0.002 m across, by [units] length = 0.001; .* in metres, write length = 1$"),
        (1000.0, 1.0, "2e+03 m across, .* in millimetres, write length = 0.001$"),
        (0.1, 0.0254, "0.00508 m across, .* in metres, write length = 1$"),
        (1000.0, 0.001, None),
        (1.0, 1.0, None),
    ],
)
def test_a_body_of_unlikely_size_is_named_with_the_likely_unit(
    scale, length, warning, folder, read_here
):
    def scaled(nodes):
        rows = np.array([line.split(",") for line in nodes[0].splitlines()], dtype=float)
        return "".join(f"{int(n)}, {x}, {y}, {z}\n" for n, x, y, z in rows * [1, *[scale] * 3])

    deck = blocks("hexahedron", folder / "sized.inp").read_text()
    (folder / "sized.inp").write_text(re.sub(r"(?<=\*NODE\n)[^*]+", scaled, deck))
    toml = folder / "sized.toml"
    text = INTERFACES.format(
        first="left", second="right", start='node_set = "start"', end='node_set = "end"'
    )
    units = f"[units]\nlength = {length}\n[materials.left]"
    toml.write_text(text.replace("[materials.left]", units))
    warnings = solid_body(folder / "sized.inp", read_interfaces(toml)).warnings
    named = [line for line in warnings if "m across" in line]
    assert len(named) == (warning is not None)
    if warning is not None:
        assert re.search(warning.replace("[units]", r"\[units\]").replace("+", r"\+"), named[0])


def test_directions_of_nodes_are_no_concern_of_a_mesh(folder, read_here):
    path = blocks("hexahedron", folder / "turned.inp")
    turned = "*TRANSFORM, NSET=start, TYPE=C\n0., 0., 0., 0., 0., 1.\n"
    path.write_text(path.read_text() + turned)
    toml = folder / "turned.toml"
    toml.write_text(
        INTERFACES.format(
            first="left", second="right", start='node_set = "start"', end='node_set = "end"'
        )
    )
    assert solid_body(path, read_interfaces(toml)).structure.K.shape[0] > 0


@pytest.mark.parametrize(("x", "far"), [(0.1, False), (100.0, True), (-30.0, True)])
def test_a_pilot_far_from_its_nodes_is_named(x, far, folder, read_here):
    path = blocks("hexahedron", folder / "far.inp")
    text = INTERFACES.format(
        first="left",
        second="right",
        start=f'node_set = "start"\npoint = [{x}, 0.0, 0.0]',
        end='node_set = "end"',
    )
    (folder / "far.toml").write_text(text)
    warnings = solid_body(path, read_interfaces(folder / "far.toml")).warnings
    assert far == any("from the middle of its nodes" in line for line in warnings)


@pytest.mark.parametrize("reader", [read, read_mesh])
def test_groups_that_a_file_lost_are_named(reader, folder, read_here):
    text = blocks("tetra10", folder / "whole.msh").read_text()
    lost = re.sub(r"\$Entities.*?\$EndEntities\n", "", text, flags=re.S)
    (folder / "lost.msh").write_text(lost)
    with pytest.raises(ValueError, match=r"lost\.msh: .*no section \$Entities"):
        reader(folder / "lost.msh")
    # Without names there is nothing to lose.
    bare = re.sub(r"\$PhysicalNames.*?\$EndPhysicalNames\n", "", lost, flags=re.S)
    (folder / "bare.msh").write_text(bare)
    assert len(read(folder / "bare.msh").blocks) == 2


@pytest.mark.long
def test_links_of_a_nastran_mesh_are_its_pilots(folder):
    path = blocks("hexahedron", folder / "links.bdf")
    mesh = read_solid_mesh(path)
    x = mesh.points[:, 0]
    start, end = (mesh.numbers[np.isclose(x, at)].tolist() for at in (x.min(), x.max()))
    # Nine nodes of an end take a continuation line.
    cards = (
        f"GRID,9001,,{x.min():.9f},.25,.25\nGRID,9002,,{x.max():.9f},.25,.25\n"
        f"RBE3,1,,9001,123456,1.0,123,{start[0]},{start[1]}\n"
        f"+,{','.join(map(str, start[2:]))}\n"
        f"RBE2,2,9002,123456,{','.join(map(str, end[:5]))}\n+,{','.join(map(str, end[5:]))}\n"
    )
    deck = path.read_text()
    assert "ENDDATA" in deck
    path.write_text(deck.replace("ENDDATA", cards + "ENDDATA"))
    text = INTERFACES.format(
        first="1", second="2", start=f"nodes = {start}", end=f"nodes = {end}"
    ).replace('"end"\ntype = "distributing"', '"end"\ntype = "rigid"')
    head, _, _ = text.partition("[[pilots]]")
    (folder / "stated.toml").write_text(text)
    (folder / "links.toml").write_text(head.replace("[materials", "links = true\n[materials", 1))
    bodies = [
        solid_body(path, read_interfaces(folder / f"{name}.toml")) for name in ("stated", "links")
    ]
    assert "replace links" in " ".join(bodies[0].warnings)
    assert "replace links" not in " ".join(bodies[1].warnings)
    stated, linked = (body.structure for body in bodies)
    assert [pilot.name for pilot in linked.pilots] == ["rbe3_1", "rbe2_2"]
    for first, second in zip(stated.pilots, linked.pilots, strict=True):
        assert_allclose(second.point, first.point, atol=1e-9)
        assert_allclose(second.G.toarray(), first.G.toarray(), atol=1e-9)
    assert abs(linked.K - stated.K).max() < 1e-8 * abs(stated.K).max()
    path.write_text(deck)
    with pytest.raises(ValueError, match=r"links\.bdf: no RBE2 or RBE3; expected one at least"):
        solid_body(path, read_interfaces(folder / "links.toml"))
