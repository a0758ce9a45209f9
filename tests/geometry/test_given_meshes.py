"""Meshes of other programs: groups survive, units and frames are those stated."""

from dataclasses import replace

import gmsh
import meshio
import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.geometry import mesh_files
from carrierflex.geometry.cad_surface_files import read_cad_statements, write_cad_statements
from carrierflex.geometry.given_meshes import foreign_files
from carrierflex.geometry.half_sector import quiet_geometry
from carrierflex.geometry.mesh_files import quadratic_tetrahedra, read_mesh, write_mesh
from carrierflex.geometry.quality import mesh_quality
from tests.forked_readers import read_in_forks

#: Formats that gmsh writes from a .msh with all groups by name.
BY_GMSH = (".unv", ".med")


@pytest.fixture(scope="module")
def folder(tmp_path_factory, stiff_mesh):
    """The stiff carrier as .msh and .inp of this program, and converted by gmsh."""
    folder = tmp_path_factory.mktemp("meshes")
    for suffix in (".msh", ".inp"):
        write_mesh(stiff_mesh, folder / f"stiff{suffix}")
    with quiet_geometry():
        gmsh.merge(str(folder / "stiff.msh"))
        for suffix in (*BY_GMSH, ".bdf"):
            gmsh.write(str(folder / f"stiff{suffix}"))
    return folder


@pytest.mark.parametrize("suffix", [".inp", *BY_GMSH])
def test_groups_of_elements_and_surfaces_survive(folder, stiff_mesh, suffix):
    mesh = read_mesh(folder / f"stiff{suffix}")
    assert mesh_quality(mesh).volume == pytest.approx(mesh_quality(stiff_mesh).volume, rel=1e-9)
    for name, elements in stiff_mesh.bodies.items():
        assert len(mesh.bodies[name]) == len(elements), name
    for name, facets in stiff_mesh.surfaces.items():
        expected = np.unique(stiff_mesh.points[np.unique(facets)].round(6), axis=0)
        result = np.unique(mesh.points[np.unique(mesh.surface(name))].round(6), axis=0)
        assert_allclose(result, expected, atol=2e-6, err_msg=name)
        assert len(mesh.surface(name)) == len(facets), name


@pytest.fixture(autouse=True)
def in_forks(monkeypatch):
    """Files are read in forks."""
    read_in_forks(monkeypatch, foreign_files, mesh_files)


@pytest.mark.long
def test_a_nastran_mesh_has_numbers_that_the_surfaces_file_gives_names(
    folder, stiff_mesh, carrier, pin
):
    with pytest.raises(ValueError, match=r"groups of elements '1', '2'; expected 'carrier' and"):
        read_mesh(folder / "stiff.bdf")
    surfaces = folder / "surfaces.toml"
    write_cad_statements(surfaces, carrier, pin)
    text = surfaces.read_text()
    heading = '[mesh.bodies]\ncarrier = ["1"]\npins = ["2"]\n\n[pin]'
    surfaces.write_text(
        text.replace("[pin]", heading).replace("tolerance = 1e-05", "tolerance = 1e-4")
    )
    mesh = read_mesh(folder / "stiff.bdf", statements=read_cad_statements(surfaces))
    assert {name: len(elements) for name, elements in mesh.bodies.items()} == {
        name: len(elements) for name, elements in stiff_mesh.bodies.items()
    }
    for name in ("rim_face", "shaft_face", "upwind_seat", "pin_2_downwind"):
        assert len(mesh.surface(name)) == len(stiff_mesh.surface(name)), name


def test_a_linear_mesh_in_millimetres_and_another_frame_is_brought_into_its_own(
    tmp_path, flexible_mesh, carrier, pin
):
    # Axis along z, pin 1 along -x, the rim's face at (0.1, 0.2, 0.3) m.
    R = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
    points = 1e3 * (flexible_mesh.points @ R.T + [0.1, 0.2, 0.3])
    corners = flexible_mesh.tets[:, :4]
    used, compact = np.unique(corners, return_inverse=True)
    meshio.write_points_cells(
        tmp_path / "linear.inp", points[used], [("tetra", compact.reshape(corners.shape))]
    )
    surfaces = tmp_path / "surfaces.toml"
    write_cad_statements(surfaces, carrier, pin)
    statements = read_cad_statements(surfaces)
    frame = replace(
        statements.frame,
        origin=np.array([0.1, 0.2, 0.3]),
        axis=np.array([0.0, 0.0, 1.0]),
        pin_1=np.array([-1.0, 0.0, 0.0]),
    )
    statements = replace(statements, frame=frame)
    with pytest.raises(ValueError, match=r"linear\.inp: .* as if millimetres were taken for met"):
        read_mesh(tmp_path / "linear.inp", statements=statements)
    mesh = read_mesh(tmp_path / "linear.inp", metres=1e-3, statements=statements)
    assert mesh.tets.shape == flexible_mesh.tets.shape
    assert_allclose(mesh.points[: len(used)], flexible_mesh.points[used], atol=1e-7)
    # Straight edges cut the bores' curvature off.
    assert mesh_quality(mesh).volume == pytest.approx(mesh_quality(flexible_mesh).volume, rel=0.02)
    assert set(mesh.surfaces) == set(flexible_mesh.surfaces)


def test_linear_tetrahedra_share_the_middles_of_their_edges():
    points = np.array([[0.0, 0, 0], [1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0], [1.0, 1.0, 1.0]])
    tets = np.array([[0, 1, 2, 3], [1, 2, 3, 4]])
    more, quadratic = quadratic_tetrahedra(points, tets)
    assert len(more) == 5 + 9
    for tet in quadratic:
        for (a, b), middle in zip(
            ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)), tet[4:], strict=True
        ):
            assert_allclose(more[middle], more[tet[[a, b]]].mean(axis=0), atol=1e-15)


def test_files_that_hold_no_tetrahedra_or_are_damaged_are_refused_by_name(tmp_path, folder):
    hexahedron = np.array(
        [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1.0]]
    )
    path = tmp_path / "hex.inp"
    meshio.write_points_cells(path, hexahedron, [("hexahedron", np.arange(8)[None])])
    assert read_mesh(path).bodies == ("carrier",)
    nodes = ", ".join(map(str, [*range(1, 9), *range(1, 8)]))
    deck = path.read_text().split("*ELEMENT")[0]
    path.write_text(f"{deck}*ELEMENT, TYPE=C3D15\n1, {nodes}\n")
    with pytest.raises(
        ValueError, match=r"hex\.inp: 1 elements of type wedge15 .*; expected tetra"
    ):
        read_mesh(path)
    content = (folder / "stiff.unv").read_bytes()
    for number, share in enumerate((0.0, 0.2, 0.7)):
        damaged = tmp_path / f"cut_{number}.unv"
        damaged.write_bytes(content[: int(share * len(content))])
        with pytest.raises(ValueError, match=rf"cut_{number}\.unv: "):
            read_mesh(damaged)
