"""The deliberate-fault suite.

Broken input ends with one plain line and exit code 2, and leaves nothing behind.

Each fault goes through the command line where a user can reach it, and through the library where
only a program can.
"""

import sys
from dataclasses import replace

import h5py
import numpy as np
import pytest

from carrierflex.fe.couplings import distributing_pilot
from carrierflex.fe.materials import CAST_IRON, Material
from carrierflex.fe.structural_model import structural_model
from carrierflex.geometry.cad_export import write_step
from carrierflex.geometry.cad_surface_files import write_cad_statements
from carrierflex.geometry.mesh_files import write_mesh
from carrierflex.geometry.tet_mesh import TetMesh
from carrierflex.reduction.body_files import write_body
from carrierflex.workflows import command_line


@pytest.fixture
def refused(monkeypatch, capfd, tmp_path):
    """Function that runs the command in an empty folder and gives its one line of refusal."""
    monkeypatch.chdir(tmp_path)

    def line(*arguments):
        before = sorted(tmp_path.rglob("*"))
        monkeypatch.setattr(sys, "argv", ["carrierflex", *map(str, arguments)])
        with pytest.raises(SystemExit) as end:
            command_line.main()
        out, err = capfd.readouterr()
        assert (end.value.code, out) == (2, ""), err
        assert err.startswith("carrierflex: ")
        assert err.count("\n") == 1, err
        assert sorted(tmp_path.rglob("*")) == before, "something was left behind"
        return err

    return line


def twins(mesh):
    n, m = len(mesh.points), len(mesh.tets)
    points = np.concatenate([mesh.points, mesh.points + np.array([0.0, 2.0, 0.0])])
    return TetMesh(
        points,
        np.concatenate([mesh.tets, mesh.tets + n]),
        mesh.surfaces,
        {"carrier": np.arange(2 * m)},
    )


def with_unused_nodes(mesh):
    return replace(mesh, points=np.concatenate([mesh.points, [[0.0, 0.0, 0.1], [0.0, 0.0, 0.2]]]))


def with_inverted_elements(mesh):
    tets = mesh.tets.copy()
    tets[:3] = tets[:3][:, [1, 0, 2, 3, 4, 6, 5, 8, 7, 9]]
    return replace(mesh, tets=tets)


def in_millimetres(mesh):
    return replace(mesh, points=1e3 * mesh.points)


def with_a_lost_node(mesh):
    points = mesh.points.copy()
    points[7] = np.nan
    # Written past the check that a mesh in memory has to pass.
    lost = replace(mesh)
    object.__setattr__(lost, "points", points)
    return lost


def without_bore(mesh):
    return replace(
        mesh,
        surfaces={name: facets for name, facets in mesh.surfaces.items() if name != "pin_2_upwind"},
    )


def with_overlapping_pilots(mesh):
    return replace(mesh, surfaces={**mesh.surfaces, "upwind_seat": mesh.surface("shaft_face")})


def with_an_empty_surface(mesh):
    return replace(mesh, surfaces={**mesh.surfaces, "upwind_seat": mesh.surface("upwind_seat")[:0]})


def with_a_body_of_another_name(mesh):
    return replace(mesh, bodies={"housing": mesh.bodies["carrier"]})


MESHES = [
    (twins, "the mesh falls into 2 detached pieces (5856 elements about (0.1"),
    (with_unused_nodes, "2 of 11480 nodes belong to no element (numbers 11478, 11479, from 0)"),
    (with_inverted_elements, "3 of 5856 elements are inverted, the worst near ("),
    (in_millimetres, "870 m across, as if millimetres were taken for metres"),
    (with_a_lost_node, "every coordinate finite"),
    (without_bore, "the mesh has no surface 'pin_2_upwind'; it has downwind_seat"),
    (with_overlapping_pilots, "'shaft_face' and 'upwind_seat' share"),
    (with_a_body_of_another_name, "groups of elements 'housing'; expected 'carrier' and 'pins'"),
]


@pytest.mark.parametrize(
    ("broken", "message"), MESHES, ids=[broken.__name__ for broken, _ in MESHES]
)
def test_a_broken_mesh_is_refused(refused, tmp_path, flexible_mesh, broken, message):
    write_mesh(broken(flexible_mesh), tmp_path / "carrier.msh")
    line = refused("reduce", "--body", "carrier", "--mesh", "carrier.msh", "--out", "body.h5")
    assert message in line


def test_the_same_faults_are_refused_by_the_curves(refused, tmp_path, flexible_mesh):
    write_mesh(in_millimetres(flexible_mesh), tmp_path / "a.msh")
    line = refused(
        "curves", "--flexible-mesh", "a.msh", "--stiff-mesh", "a.msh", "--out", ".", "--no-cache"
    )
    assert "870 m across" in line


def test_a_truncated_mesh_is_refused(refused, tmp_path, flexible_mesh):
    path = tmp_path / "carrier.msh"
    write_mesh(flexible_mesh, path)
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    assert "carrier.msh: not a complete gmsh mesh" in refused(
        "reduce", "--body", "carrier", "--mesh", path, "--out", "b.h5"
    )


def test_a_mesh_of_the_other_variant_is_refused(refused, tmp_path, flexible_mesh):
    write_mesh(flexible_mesh, tmp_path / "carrier.msh")
    line = refused(
        "reduce",
        "--body",
        "carrier",
        "--variant",
        "stiff",
        "--mesh",
        "carrier.msh",
        "--out",
        "b.h5",
    )
    assert "has no body 'pins', a flexible carrier; expected the stiff one" in line
    line = refused("reduce", "--body", "pin", "--mesh", "carrier.msh", "--out", "b.h5")
    assert "--body is pin, a STEP or mesh file is given; expected --body carrier" in line
    line = refused("reduce", "--body", "carrier", "--mesh", "absent.msh", "--out", "b.h5")
    assert "absent.msh: no such file" in line


def changed(folder, old, new, count=-1):
    path = folder / "surfaces.toml"
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, count), encoding="utf-8")


@pytest.fixture
def cad(tmp_path, carrier, pin):
    write_step(carrier, tmp_path / "carrier.step")
    write_cad_statements(tmp_path / "surfaces.toml", carrier, pin)
    return tmp_path


CAD = ("mesh", "--step", "carrier.step", "--surfaces", "surfaces.toml", "--out", "carrier.msh")


def test_a_cad_model_in_millimetres_that_says_metres_is_refused(refused, cad):
    path = cad / "carrier.step"
    path.write_text(path.read_text().replace("SI_UNIT(.MILLI.,.METRE.)", "SI_UNIT($,.METRE.)"))
    assert (
        "carrier.step (declared unit: metre): 870 m across, as if millimetres were taken for metres"
        in refused(*CAD)
    )


@pytest.mark.long
def test_a_truncated_cad_model_is_refused(refused, cad):
    text = (cad / "carrier.step").read_text()
    (cad / "carrier.step").write_text(text[: len(text) // 2])
    assert "carrier.step: cut short, the line END-ISO-10303-21 is missing" in refused(*CAD)
    (cad / "carrier.step").write_text(
        text[: len(text) // 2]
        + "\nENDSEC;\nEND-ISO-10303-21;\n"
        + "LENGTH_UNIT SI_UNIT(.MILLI.,.METRE.)"
    )
    assert "carrier.step: " in refused(*CAD)
    (cad / "carrier.step").write_text("solid carrier\n")
    assert "not a STEP file; expected one that begins with ISO-10303-21" in refused(*CAD)


def test_a_pilot_on_a_surface_that_the_cad_model_lacks_is_refused(refused, cad):
    changed(cad, "radius = 0.2\n", "radius = 0.21\n")
    line = refused(*CAD)
    assert "surface 'downwind_seat': the CAD model has no cylinder of radius 0.21 m" in line
    assert (
        "candidates: [1] cylinder, axis (1, 0, 0) through (0, 0, 0), radius 0.2 m, stations 0.35 "
        "to 0.41 m, area" in line
    )


@pytest.mark.long
def test_a_surface_with_several_matches_is_refused(refused, cad):
    changed(cad, "axial_range = [0.0, 0.065]\n", "", 1)
    assert (
        "surface 'pin_1_upwind': 2 separate surfaces match the cylinder of radius 0.08 m"
        in refused(*CAD)
    )


def test_a_cad_model_without_statements_is_refused(refused, cad):
    line = refused("curves", "--step", "carrier.step", "--out", ".", "--no-cache")
    assert "--step is given without --surfaces" in line
    assert "no such file" in refused(
        "mesh", "--step", "carrier.step", "--surfaces", "absent.toml", "--out", "a.msh"
    )
    changed(cad, "version = 1", "version = 2")
    assert "key 'version' is 2, written by a newer version" in refused(*CAD)


@pytest.fixture
def body(tmp_path, pin_reduction):
    write_body(pin_reduction.model, tmp_path / "pin.h5")
    return tmp_path / "pin.h5"


def test_a_body_file_of_a_newer_version_is_refused(refused, body):
    with h5py.File(body, "a") as file:
        file.attrs["version"] = 99
    line = refused("certificate", "pin.h5")
    assert "written by a newer version (file version 99" in line
    assert "update carrierflex" in line
    assert "newer version" in refused("export", "pin.h5", "--format", "op4", "--out", "pin.op4")


@pytest.mark.parametrize("share", [0.0, 0.01, 0.5, 0.99])
def test_a_truncated_body_file_is_refused(refused, body, share):
    content = body.read_bytes()
    body.write_bytes(content[: int(share * len(content))])
    assert "pin.h5: not a complete body file" in refused("certificate", "pin.h5")


def test_negative_density_is_refused():
    with pytest.raises(
        ValueError, match=r"material cast: rho is -7200\.0 kg/m\^3; expected a positive density"
    ):
        Material("cast", E=CAST_IRON.E, nu=CAST_IRON.nu, rho=-CAST_IRON.rho)


def test_a_pilot_on_an_empty_surface_is_refused_by_name(flexible_mesh):
    with pytest.raises(ValueError, match="surface 'upwind_seat' with no nodes"):
        distributing_pilot(with_an_empty_surface(flexible_mesh), "upwind_seat", np.zeros(3))


def test_overlapping_pilots_are_refused_with_the_nodes_they_share(flexible_mesh, carrier):
    with pytest.raises(
        ValueError,
        match=(
            r"cannot move independently: .* rank 6; 'shaft_face' and 'upwind_seat' share \d+ "
            r"nodes \("
        ),
    ):
        structural_model(
            "carrier",
            with_overlapping_pilots(flexible_mesh),
            carrier,
            ("shaft_face", "upwind_seat"),
        )
