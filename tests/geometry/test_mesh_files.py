"""Every mesh file is read back.

Nodes, elements, bodies and surfaces come home; gmsh itself finds no element inverted.
"""

from dataclasses import replace

import gmsh
import meshio
import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.geometry.half_sector import quiet_geometry
from carrierflex.geometry.mesh_files import check_mesh_path, write_mesh
from carrierflex.geometry.quality import mesh_quality


@pytest.fixture(scope="module", params=[".msh", ".vtu", ".inp"])
def round_trip(request, tmp_path_factory, stiff_half):
    path = tmp_path_factory.mktemp("meshes") / f"half{request.param}"
    write_mesh(stiff_half, path)
    assert [file.name for file in path.parent.iterdir()] == [path.name]
    return request.param, meshio.read(path), path


def test_nodes_and_elements_come_back(round_trip, stiff_half):
    _, result, _ = round_trip
    # .inp is text: seventeen decimals.
    assert_allclose(result.points, stiff_half.points, rtol=0.0, atol=1e-15)
    tets = np.concatenate([block.data for block in result.cells if block.type == "tetra10"])
    assert (tets == stiff_half.tets).all()


def test_bodies_come_back(round_trip, stiff_half):
    suffix, result, _ = round_trip
    for number, (name, elements) in enumerate(stiff_half.bodies.items(), start=1):
        if suffix == ".inp":
            back = result.cell_sets[name][0]
        else:
            blocks = [i for i, block in enumerate(result.cells) if block.type == "tetra10"]
            key = "gmsh:physical" if suffix == ".msh" else "body"
            back = np.flatnonzero(
                np.concatenate([result.cell_data[key][i] for i in blocks]) == number
            )
        assert (np.sort(back) == elements).all()


def test_surfaces_come_back(round_trip, stiff_half):
    suffix, result, _ = round_trip
    for name, facets in stiff_half.surfaces.items():
        if suffix == ".inp":
            back = result.point_sets[name]
        elif suffix == ".vtu":
            back = np.flatnonzero(result.point_data[f"surface: {name}"])
        else:
            number, dimension = result.field_data[name]
            assert dimension == 2
            blocks = zip(result.cells, result.cell_data["gmsh:physical"], strict=True)
            back = np.concatenate(
                [block.data[tags == number] for block, tags in blocks if block.type == "triangle6"]
            )
            assert (back == facets).all()
        assert set(np.ravel(back)) == set(facets.ravel())


def test_abaqus_elements_are_plain_quadratic_tetrahedra(tmp_path, stiff_half):
    write_mesh(stiff_half, tmp_path / "half.inp")
    text = (tmp_path / "half.inp").read_text()
    assert "TYPE=C3D10\n" in text
    assert "C3D10M" not in text
    assert text.upper().count("*ELEMENT,") == 1


def test_gmsh_finds_the_same_volume_and_no_inverted_element(tmp_path, one_pin_mesh):
    # A reader of its own: a wrong node order would fold the curved elements.
    write_mesh(one_pin_mesh, tmp_path / "pin.msh")
    with quiet_geometry():
        gmsh.open(str(tmp_path / "pin.msh"))
        tags = np.concatenate([tags for tags in gmsh.model.mesh.getElements(3)[1]])
        determinants = gmsh.model.mesh.getElementQualities(tags, "minDetJac")
        points, weights = gmsh.model.mesh.getIntegrationPoints(11, "Gauss4")
        _, jacobians, _ = gmsh.model.mesh.getJacobians(11, points)
    assert determinants.min() > 0.0
    volume = float((jacobians.reshape(-1, len(weights)) @ weights).sum())
    # Both rules are exact to second degree; curved elements' determinants are of third.
    assert_allclose(volume, mesh_quality(one_pin_mesh).volume, rtol=1e-5)


def test_an_unknown_suffix_is_refused(tmp_path, one_pin_mesh):
    with pytest.raises(
        ValueError, match=r"pin\.stl: suffix '\.stl'; expected one of \.msh, \.vtu, \.inp"
    ):
        write_mesh(one_pin_mesh, tmp_path / "pin.stl")
    with pytest.raises(ValueError, match="suffix ''"):
        check_mesh_path(tmp_path / "pin")


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path, one_pin_mesh, monkeypatch):
    path = tmp_path / "pin.inp"
    path.write_text("old")

    def fail(temporary, *_, **__):
        temporary.write_text("half")
        raise OSError("disk full")

    monkeypatch.setattr(meshio, "write", fail)
    with pytest.raises(OSError, match="disk full"):
        write_mesh(one_pin_mesh, path)
    assert [(file.name, file.read_text()) for file in tmp_path.iterdir()] == [("pin.inp", "old")]


def test_a_missing_folder_is_an_error_of_the_system(tmp_path, one_pin_mesh):
    with pytest.raises(OSError, match="absent"):
        write_mesh(one_pin_mesh, tmp_path / "absent" / "pin.vtu")


@pytest.mark.parametrize("offset", [0.0, -20.0, 3000.0])
def test_numbers_of_abaqus_files_are_narrow_enough_to_be_read(tmp_path, one_pin_mesh, offset):
    # Abaqus and CalculiX take at most twenty characters a number; CalculiX stops at more.
    moved = replace(one_pin_mesh, points=one_pin_mesh.points + offset)
    write_mesh(moved, tmp_path / "pin.inp")
    text = (tmp_path / "pin.inp").read_text()
    lines = text[text.index("*NODE") : text.index("*ELEMENT")].splitlines()[1:]
    numbers = [field.strip() for line in lines for field in line.split(",")[1:]]
    assert len(numbers) == 3 * len(moved.points)
    assert max(map(len, numbers)) <= 20
    read = np.array(numbers, dtype=float).reshape(-1, 3)
    assert_allclose(
        read, moved.points, rtol=0.0, atol=1e-17 * max(1.0, 10.0 ** len(str(int(abs(offset)))))
    )
