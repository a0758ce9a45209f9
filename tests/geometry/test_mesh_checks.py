"""Meshes from outside: read back as they were written.

Refused where they would give meaningless matrices.
"""

from dataclasses import replace

import meshio
import numpy as np
import pytest

from carrierflex.geometry.mesh_checks import check_mesh
from carrierflex.geometry.mesh_files import read_mesh, write_mesh
from carrierflex.geometry.quality import mesh_quality
from carrierflex.geometry.tet_mesh import TetMesh


def test_a_written_mesh_is_read_back_whole(tmp_path, stiff_mesh):
    write_mesh(stiff_mesh, tmp_path / "stiff.msh")
    back = read_mesh(tmp_path / "stiff.msh")
    assert (back.points == stiff_mesh.points).all()
    assert set(back.bodies) == set(stiff_mesh.bodies)
    for name, elements in stiff_mesh.bodies.items():
        assert (back.tets[back.bodies[name]] == stiff_mesh.tets[elements]).all(), name
    assert set(back.surfaces) == set(stiff_mesh.surfaces)
    for name, facets in stiff_mesh.surfaces.items():
        assert (back.surfaces[name] == facets).all(), name
    assert back.symmetry_order == 1


def test_facets_written_inside_out_come_back_outward(tmp_path, one_pin_mesh):
    turned = {name: facets[:, [1, 0, 2, 3, 5, 4]] for name, facets in one_pin_mesh.surfaces.items()}
    write_mesh(replace(one_pin_mesh, surfaces=turned), tmp_path / "pin.msh")
    for name, facets in read_mesh(tmp_path / "pin.msh").surfaces.items():
        assert (facets == one_pin_mesh.surfaces[name]).all()


def twins(mesh):
    """The mesh and a copy of it, 2 m away along x."""
    n, m = len(mesh.points), len(mesh.tets)
    return TetMesh(
        np.concatenate([mesh.points, mesh.points + np.array([2.0, 0.0, 0.0])]),
        np.concatenate([mesh.tets, mesh.tets + n]),
        mesh.surfaces,
        {"pins": np.arange(2 * m)},
    )


def test_good_meshes_are_measured(one_pin_mesh):
    assert check_mesh(one_pin_mesh, "pin") == mesh_quality(one_pin_mesh)


def test_detached_pieces_are_counted_and_located(one_pin_mesh):
    m = len(one_pin_mesh.tets)
    message = (
        rf"pin: .* into 2 detached pieces \({m} elements about \(0\.\d+, .*, 0\.307\) m; {m} "
        rf"elements about \(2\."
    )
    with pytest.raises(ValueError, match=message):
        check_mesh(twins(one_pin_mesh), "pin")


def test_pieces_that_touch_without_sharing_nodes_are_detached(one_pin_mesh):
    twin = twins(one_pin_mesh)
    with pytest.raises(ValueError, match="falls into 2 detached pieces"):
        check_mesh(replace(twin, points=np.concatenate([one_pin_mesh.points] * 2)), "pin")


def test_unused_nodes_are_numbered(one_pin_mesh):
    n = len(one_pin_mesh.points)
    more = replace(one_pin_mesh, points=np.concatenate([one_pin_mesh.points, np.zeros((5, 3))]))
    with pytest.raises(
        ValueError,
        match=rf"5 of {n + 5} nodes belong to no element \(numbers {n}, .*, \.\.\., from 0\)",
    ):
        check_mesh(more, "pin")


@pytest.mark.parametrize(
    ("factor", "message"),
    [(1e3, r"350 m across, as if millimetres were taken for metres"), (1e-3, r"0\.00035 m across")],
)
def test_other_units_than_metres_are_refused(one_pin_mesh, factor, message):
    with pytest.raises(ValueError, match=message):
        check_mesh(replace(one_pin_mesh, points=one_pin_mesh.points * factor), "pin")


def test_a_mesh_without_elements_is_refused():
    with pytest.raises(ValueError, match="nothing: no elements"):
        check_mesh(TetMesh(np.zeros((1, 3)), np.zeros((0, 10), dtype=np.int64), {}, {}), "nothing")


def written(path, points, cells, **options):
    meshio.write(path, meshio.Mesh(points, cells, **options), file_format="gmsh22")
    return path


@pytest.mark.long
def test_files_without_names_or_with_other_elements_are_refused(tmp_path, one_pin_mesh):
    points, tets = one_pin_mesh.points, one_pin_mesh.tets
    with pytest.raises(ValueError, match="elements without a physical volume's name"):
        read_mesh(written(tmp_path / "a.msh", points, [("tetra10", tets)]))
    with pytest.raises(
        ValueError, match=rf"{len(tets)} elements of type Pyramid 5; expected tetra, tetra10, hexa"
    ):
        read_mesh(written(tmp_path / "b.msh", points, [("pyramid", tets[:, :5])]))
    with pytest.raises(ValueError, match="no quadratic tetrahedra"):
        read_mesh(
            written(
                tmp_path / "c.msh", points, [("triangle6", one_pin_mesh.surface("pin_1_upwind"))]
            )
        )
    with pytest.raises(ValueError, match=r"suffix '\.vtu'; expected \.msh"):
        read_mesh(tmp_path / "a.vtu")
    with pytest.raises(FileNotFoundError, match=r"absent\.msh: no such file"):
        read_mesh(tmp_path / "absent.msh")


def test_a_surface_inside_the_body_is_refused(tmp_path, one_pin_mesh):
    inner = one_pin_mesh.tets[:, [0, 1, 2, 4, 5, 6]][:3]
    surfaces = {"pin_1_upwind": np.concatenate([one_pin_mesh.surface("pin_1_upwind"), inner])}
    write_mesh(replace(one_pin_mesh, surfaces=surfaces), tmp_path / "pin.msh")
    with pytest.raises(
        ValueError, match=r"surface 'pin_1_upwind': .* not all of them on the boundary of one body"
    ):
        read_mesh(tmp_path / "pin.msh")


@pytest.mark.parametrize("share", [0.001, 0.02, 0.3, 0.6, 0.9, 0.99, 0.9999])
def test_a_file_cut_short_anywhere_is_refused(tmp_path, one_pin_mesh, share):
    path = tmp_path / "pin.msh"
    write_mesh(one_pin_mesh, path)
    content = path.read_bytes()
    path.write_bytes(content[: int(share * len(content))])
    with pytest.raises(ValueError, match=r"pin\.msh: not a complete gmsh mesh \(.+\); expected"):
        read_mesh(path)
