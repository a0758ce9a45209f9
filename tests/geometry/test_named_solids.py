"""Carriers of hexahedra and wedges: boundaries, named surfaces, what is refused."""

import meshio
import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.fe.solids.solid_matrices import refuse_inverted
from carrierflex.fe.surface_integrals import surface_area, surface_moments
from carrierflex.geometry import mesh_files
from carrierflex.geometry.cad_surface_files import CadFrame, CadStatements
from carrierflex.geometry.given_meshes import foreign_files
from carrierflex.geometry.given_meshes.named_solids import NamedSolids, named_solids
from carrierflex.geometry.given_meshes.solid_files import read_solid_mesh
from carrierflex.geometry.mesh_files import read_mesh
from carrierflex.geometry.tet_mesh import (
    FACET_CORNERS,
    corner_triangles,
    surface_of_facets,
)
from tests.fe.solids.test_solids import FORMATS, LENGTHS, SIZES, blocks
from tests.forked_readers import read_in_forks

BODIES = {"left": "carrier", "right": "pins"}


@pytest.fixture(autouse=True)
def in_forks(monkeypatch):
    """Files are read in forks."""
    read_in_forks(monkeypatch, foreign_files, mesh_files)


def carrier_of(kind, folder, **options):
    """The two blocks as carrier and pins."""
    mesh = read_solid_mesh(blocks(kind, folder / f"{kind}.msh", **options))
    return named_solids(mesh, BODIES, kind)


@pytest.fixture(params=SIZES)
def mesh(request, tmp_path):
    return carrier_of(request.param, tmp_path)


def test_the_boundary_has_the_area_of_the_box_and_looks_out_of_it(mesh):
    length, width, height = 2.0 * LENGTHS[0], *LENGTHS[1:]
    facets = mesh.boundary()
    area = 2.0 * (width * height + length * (width + height))
    assert_allclose(surface_area(mesh, facets), area, rtol=1e-12)
    triangles, facet_of = corner_triangles(facets)
    a, b, c = (mesh.points[triangles[:, i]] for i in range(3))
    # The volume by the divergence theorem, V = 1/3 \u222e x \u00b7 n dA.
    volume = np.einsum("ka,ka->", (a + b + c) / 3.0, np.cross(b - a, c - a) / 2.0) / 3.0
    assert_allclose(volume, length * width * height, rtol=1e-12)
    assert set(facet_of) == set(range(len(facets)))


def test_bodies_that_share_a_face_bound_each_other_there(mesh):
    outer, by_body = mesh.boundary(), [mesh.boundary(body) for body in ("carrier", "pins")]
    shared = (sum(len(facets) for facets in by_body) - len(outer)) // 2
    between = [
        {frozenset(facet) for facet in facets[:, : FACET_CORNERS[facets.shape[1]]].tolist()}
        for facets in by_body
    ]
    assert len(between[0] & between[1]) == shared > 0


def test_named_surfaces_are_the_facets_of_their_nodes_and_weigh_by_area(mesh):
    for name, x in (("start", 0.0), ("end", 2.0 * LENGTHS[0])):
        facets = mesh.surface(name)
        assert_allclose(mesh.points[facets, 0], x, atol=1e-12)
        centre = np.array([x, LENGTHS[1] / 2.0, LENGTHS[2] / 2.0])
        B, Z = surface_moments(mesh, facets, centre)
        area, about = LENGTHS[1] * LENGTHS[2], LENGTHS[1] ** 4 / 12.0
        expected = np.diag([area, area, area, 2.0 * about, about, about])
        assert_allclose(Z, expected, atol=1e-14)
        # The nodes' shares make the same of a linear displacement.
        assert_allclose(np.einsum("ina,na->i", B, mesh.points)[0], area * x, atol=1e-14)
    drawn = surface_of_facets(mesh.boundary(), mesh.surfaces)
    assert [(drawn == number).sum() for number in range(len(mesh.surfaces))] == [
        len(facets) for facets in mesh.surfaces.values()
    ]
    with pytest.raises(KeyError, match="the mesh has no surface 'side'; it has end, start"):
        mesh.surface("side")


def test_quadratic_facets_follow_a_cylinder_and_linear_ones_its_chords(tmp_path):
    """A face bent to an arc of 2 w of radius r: its chords cut off w^2 / 6 of its length."""
    r, n = 1.5, 4.0
    areas = {}
    for kind in ("hexahedron", "hexahedron20", "hexahedron27"):
        mesh = carrier_of(kind, tmp_path)
        x, y, z = mesh.points.T
        bent = np.column_stack([(r + y) * np.sin(x / r), (r + y) * np.cos(x / r), z])
        bottom = mesh.boundary()
        bottom = bottom[(mesh.points[bottom, 1] < 1e-9).all(axis=1)]
        areas[kind] = surface_area(NamedSolids(bent, mesh.numbers, mesh.blocks), bottom)
    exact = 2.0 * LENGTHS[0] * LENGTHS[2]
    half = 2.0 * LENGTHS[0] / r / n / 2.0
    assert_allclose(areas["hexahedron"] / exact, np.sin(half) / half, rtol=1e-12)
    for kind in ("hexahedron20", "hexahedron27"):
        # A parabola through an arc's middle: (2 w)^4 / 2880 of its length and some, of both signs.
        assert abs(areas[kind] / exact - 1.0) < (2.0 * half) ** 4 / 500.0


@pytest.mark.parametrize("suffix", FORMATS)
def test_every_format_gives_bodies_and_surfaces(suffix, tmp_path):
    path = blocks("hexahedron20", tmp_path / f"blocks{suffix}")
    names = ("1", "2") if suffix == ".bdf" else ("left", "right")
    statements = CadStatements(
        (), CadFrame.of_the_file(), 1e-6, 0.1, None,
        dict(zip(names, BODIES.values(), strict=True)), 1.0, {},
    )  # fmt: skip
    mesh = read_mesh(path, statements=statements)
    assert sorted(mesh.bodies) == ["carrier", "pins"]
    assert len(mesh.boundary("carrier")) == len(mesh.boundary("pins")) == 2 * (4 + 4 + 4)
    # Nastran's files have numbers in place of groups of faces.
    surfaces = {} if suffix == ".bdf" else {"start": 0.0, "end": 2.0 * LENGTHS[0]}
    for name, x in surfaces.items():
        assert mesh.surface(name).shape == (4, 8)
        assert_allclose(mesh.points[mesh.surface(name), 0], x, atol=1e-9)


def test_quadratic_elements_of_two_kinds_are_refused(tmp_path):
    mesh = read_solid_mesh(blocks("hexahedron20", tmp_path / "a.msh"))
    other = read_solid_mesh(blocks("tetra10", tmp_path / "b.msh"))
    mixed = type(mesh)(mesh.points, mesh.numbers, [mesh.blocks[0], other.blocks[1]])
    with pytest.raises(ValueError, match=r"a\.msh: elements of types hexahedron20, tetra10 in one"):
        named_solids(mixed, BODIES, "a.msh")


def test_files_are_refused_in_one_line(tmp_path):
    path = blocks("hexahedron", tmp_path / "a.msh")
    with pytest.raises(
        ValueError, match=r"a\.msh: groups of elements 'left', 'right'; expected 'c"
    ):
        read_mesh(path)
    points = np.array([(x, y, z) for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))])
    apart = np.concatenate([points, points + np.array([3.0, 0.0, 0.0])]) * 0.1
    elements = np.arange(16).reshape(2, 8)
    meshio.write_points_cells(tmp_path / "two.inp", apart, [("hexahedron", elements)])
    with pytest.raises(ValueError, match=r"two\.inp: the mesh falls into 2 detached pieces"):
        read_mesh(tmp_path / "two.inp")
    meshio.write_points_cells(tmp_path / "mm.inp", 1e3 * points, [("hexahedron", elements[:1])])
    with pytest.raises(ValueError, match=r"mm\.inp: 1000 m across, as if millimetres"):
        read_mesh(tmp_path / "mm.inp")
    inside_out = points[[4, 5, 6, 7, 0, 1, 2, 3]]
    meshio.write_points_cells(tmp_path / "out.inp", inside_out, [("hexahedron", elements[:1])])
    with pytest.raises(ValueError, match="1 elements of type hexahedron in group 'carrier' are"):
        refuse_inverted(read_mesh(tmp_path / "out.inp"), "out.inp")
