"""The command with matrices of another program: the same body as by our own mesh, all exports."""

import json
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_allclose

import carrierflex as cf
from carrierflex.fe.structural_model import with_equal_node_weights
from carrierflex.geometry.mesh_files import write_mesh
from carrierflex.geometry.parameters import GearData
from carrierflex.reduction.body_files import read_body, write_body
from carrierflex.reduction.craig_bampton import craig_bampton
from carrierflex.workflows.reduction import check_certificate, export_body, reduce_body
from carrierflex.workflows.reduction.reduce_matrices import MatrixFiles
from carrierflex.workflows.simulation.stage_bodies import stage_body_of_files

SUFFIX = {
    "op4": "op4",
    "dmig": "dmig",
    "mbdyn": "fem",
    "sid": "SID_FEM",
    "exudyn": "hdf5",
    "simscape": "mat",
}
PILOT = '[[pilots]]\nname = "{name}"\ntype = "distributing"\nnode_set = "{name}"\npoint = {point}\n'


@pytest.fixture(scope="module")
def files(tmp_path_factory, one_pin_mesh, pin_structure):
    """Stiffness, mass, deck and interfaces of the default pin."""
    folder = tmp_path_factory.mktemp("pin")
    sp.save_npz(folder / "k.npz", pin_structure.K)
    sp.save_npz(folder / "m.npz", pin_structure.M)
    write_mesh(one_pin_mesh, folder / "pin.inp")
    pilots = [PILOT.format(name=p.name, point=p.point.tolist()) for p in pin_structure.pilots]
    header = 'format = "carrierflex-interfaces"\nversion = 1\nname = "pin"\n'
    nodes = '[nodes]\nfile = "pin.inp"\n'
    (folder / "interfaces.toml").write_text(header + nodes + "".join(pilots))
    return {
        "stiffness": folder / "k.npz",
        "mass": folder / "m.npz",
        "interfaces": folder / "interfaces.toml",
    }


def test_the_punch_file_of_an_assembly_file_belongs_to_the_inputs(tmp_path):
    """What it says of the components makes another body, which no cache may take for the first."""
    header = 'format = "carrierflex-interfaces"\nversion = 1\nname = "a"\n'
    pilot = '[[pilots]]\nname = "a"\ntype = "nodes"\nnodes = [1]\n'
    (tmp_path / "a.toml").write_text(f'{header}[nodes]\nfile = "a.asm"\n{pilot}')
    for name in ("a.op4", "a.asm", "a.pch"):
        (tmp_path / name).write_text("1")
    files = MatrixFiles(tmp_path / "a.op4", tmp_path / "a.op4", tmp_path / "a.toml")
    before = files.digests()
    (tmp_path / "a.pch").write_text("2")
    assert files.digests() != before


MATERIAL = "[materials.STEEL]\nE = 2.1e11\nnu = 0.3\nrho = 7850.0\n"


@pytest.mark.parametrize("suffix", [".db", ".cas", ".stl"])
def test_a_mesh_of_a_kind_that_is_not_read_is_refused_by_its_suffix(suffix, tmp_path):
    (tmp_path / f"bar{suffix}").write_text("/PREP7\n")
    header = 'format = "carrierflex-interfaces"\nversion = 1\nname = "bar"\n'
    pilot = '[[pilots]]\nname = "a"\ntype = "nodes"\nnodes = [1]\n'
    (tmp_path / "bar.toml").write_text(header + MATERIAL + pilot)
    with pytest.raises(
        ValueError, match=rf"bar\{suffix}: suffix '\{suffix}'; expected a mesh, one of"
    ):
        reduce_body.main(
            mesh=tmp_path / f"bar{suffix}", interfaces=tmp_path / "bar.toml",
            out=tmp_path / "o.h5", modes=2, cache=False, quiet=True,
        )  # fmt: skip


@pytest.mark.long
def test_files_of_a_body_that_was_moved_are_looked_up_beside_it(files, tmp_path, monkeypatch):
    made, moved, other = (tmp_path / name for name in ("made", "moved", "other"))
    for folder in (made, other):
        folder.mkdir()
    for path in files["stiffness"].parent.iterdir():
        (made / path.name).write_bytes(path.read_bytes())
    monkeypatch.chdir(made)
    named = {role: Path(path.name) for role, path in files.items()}
    reduce_body.main(**named, out=Path("pin.h5"), modes=4, cache=False, quiet=True)
    made.rename(moved)
    monkeypatch.chdir(other)
    export_body.main(moved / "pin.h5", format="exudyn", out=other / "x.hdf5", quiet=True)
    # A body of files that were named with their folder.
    absolute = {role: moved / path for role, path in named.items()}
    reduce_body.main(**absolute, out=moved / "a.h5", modes=4, cache=False, quiet=True)
    moved.rename(made)
    export_body.main(made / "a.h5", format="exudyn", out=other / "y.hdf5", quiet=True)
    (made / "k.npz").unlink()
    with pytest.raises(
        FileNotFoundError, match=r"k\.npz: no such file, nor k\.npz in the folder of the body file"
    ):
        export_body.main(made / "a.h5", format="exudyn", out=other / "y.hdf5", quiet=True)
    (made / "k.npz").write_bytes((made / "m.npz").read_bytes())
    with pytest.raises(ValueError, match=r"k\.npz: changed since the body was made of it"):
        export_body.main(made / "a.h5", format="exudyn", out=other / "y.hdf5", quiet=True)


@pytest.fixture(scope="module")
def body(files, tmp_path_factory):
    out = tmp_path_factory.mktemp("body") / "pin.h5"
    reduce_body.main(out=out, modes=4, quiet=True, **files)
    return out


def test_the_body_is_that_of_our_own_mesh(body, pin_structure, one_pin_mesh):
    ours = craig_bampton(with_equal_node_weights(pin_structure, one_pin_mesh), 4).model
    given = read_body(body)
    assert given.labels == ours.labels
    for letter in "KMD":
        expected = getattr(ours, letter)
        scale = np.sqrt(np.outer(*2 * [np.abs(expected.diagonal()) + 1e-30]))
        assert (np.abs(getattr(given, letter) - expected) / np.maximum(scale, 1e-9)).max() < 1e-8
    for integral in ("N", "P", "Q"):
        expected = getattr(ours.ffrf, integral)
        assert_allclose(getattr(given.ffrf, integral), expected, atol=1e-9 * np.abs(expected).max())
    assert check_certificate.main(body).met
    record = json.loads(given.provenance["matrix_files"])
    assert set(record) == {"stiffness", "mass", "interfaces", "nodes"}


def test_the_same_body_in_python(body, files):
    given = cf.given_body(*files.values(), modes=4)
    assert_allclose(given.model.K, read_body(body).K, rtol=1e-12, atol=1e-6)
    assert given.certificate.met
    assert given.model.provenance["matrix_files"] == read_body(body).provenance["matrix_files"]


@pytest.mark.long
@pytest.mark.parametrize("format", SUFFIX)
def test_such_a_body_is_written_in_every_format(format, body, tmp_path):
    out = tmp_path / f"pin.{SUFFIX[format]}"
    result = export_body.main(body, format=format, out=out, quiet=True)
    assert all(file.stat().st_size > 100 for file in result.files)


def test_residual_vectors_and_a_free_interface_are_ours_too(files, tmp_path):
    model = reduce_body.main(
        out=tmp_path / "a.h5", modes=4, residual_vectors=True, quiet=True, **files
    )
    assert any(label.startswith("residual vector") for label in model.labels)
    reduce_body.main(out=tmp_path / "b.h5", modes=8, interface="free", quiet=True, **files)
    assert check_certificate.main(tmp_path / "b.h5").met


def test_a_changed_file_is_not_taken_for_the_recorded_one(files, tmp_path):
    copies = {role: tmp_path / path.name for role, path in files.items()}
    for role, path in files.items():
        copies[role].write_bytes(path.read_bytes())
    (tmp_path / "pin.inp").write_bytes((files["interfaces"].parent / "pin.inp").read_bytes())
    reduce_body.main(out=tmp_path / "a.h5", modes=2, quiet=True, **copies)
    copies["mass"].write_bytes(files["stiffness"].read_bytes())
    with pytest.raises(ValueError, match=r"m\.npz: changed since the body was made of it"):
        export_body.main(tmp_path / "a.h5", format="exudyn", out=tmp_path / "a.hdf5", quiet=True)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--body", "pin"], "--body is given together with --stiffness"),
        (["--mesh", "a.msh"], "--mesh is given together with --stiffness"),
        (["--coupling", "rbe2"], "--coupling is given together with --stiffness"),
    ],
)
def test_options_of_meshes_are_refused_beside_matrices(options, message, files, command, tmp_path):
    given = [word for role, path in files.items() for word in (f"--{role}", str(path))]
    refusal = command("reduce", *given, *options, "--out", str(tmp_path / "a.h5"))
    assert refusal.returncode == 2
    assert message in refusal.stderr
    assert list(tmp_path.iterdir()) == []


def test_a_missing_matrix_and_a_missing_body_are_told(files, command, tmp_path):
    alone = command("reduce", "--stiffness", str(files["stiffness"]), "--out", "a.h5")
    assert "--mass and --interfaces is missing" in alone.stderr
    nothing = command("reduce", "--out", "a.h5")
    assert nothing.returncode == 2
    assert "--body is missing; expected carrier, pin or main_shaft" in nothing.stderr


def test_unlikely_units_are_told_and_kept_with_the_body(files, tmp_path, capsys):
    text = files["interfaces"].read_text()
    (tmp_path / "pin.inp").write_bytes((files["interfaces"].parent / "pin.inp").read_bytes())
    units = "[units]\nlength = 0.001\n[nodes]"
    (tmp_path / "interfaces.toml").write_text(text.replace("[nodes]", units))
    given = {**files, "interfaces": tmp_path / "interfaces.toml"}
    model = reduce_body.main(out=tmp_path / "a.h5", modes=2, **given)
    assert "check the table [units]" in capsys.readouterr().err
    assert "check the table [units]" in model.provenance["warnings"]
    reduce_body.main(out=tmp_path / "b.h5", modes=2, **given)
    stderr = capsys.readouterr().err
    assert "taken from the cache" in stderr
    assert "note: pin: " in stderr
    assert "check the table [units]" in stderr


@pytest.mark.acceptance
def test_a_carrier_of_matrices_turns_in_the_stage_as_our_own(
    flexible_structure, flexible_mesh, carrier, tmp_path
):
    ours = with_equal_node_weights(flexible_structure, flexible_mesh)
    write_body(craig_bampton(ours, 8).model, tmp_path / "ours.h5")
    sp.save_npz(tmp_path / "k.npz", ours.K)
    sp.save_npz(tmp_path / "m.npz", ours.M)
    write_mesh(flexible_mesh, tmp_path / "carrier.inp")
    rim = np.unique(flexible_mesh.surface("rim_face"))
    positions = flexible_mesh.points[rim]
    sensors = []
    for degree in range(360):
        outward = np.array([0.0, -np.sin(np.radians(degree)), np.cos(np.radians(degree))])
        near = np.linalg.norm(positions - carrier.sensor_radius * outward, axis=1).argmin()
        for kind, direction in (("axial", [1.0, 0.0, 0.0]), ("radial", outward.tolist())):
            sensors.append(
                f'[[sensors]]\nname = "rim_{kind}_{degree:03d}"\nnodes = [{rim[near] + 1}]\n'
                f"direction = {direction}\n"
            )
    pilots = [PILOT.format(name=p.name, point=p.point.tolist()) for p in ours.pilots]
    text = 'format = "carrierflex-interfaces"\nversion = 1\nname = "flexible_carrier"\n'
    text += '[nodes]\nfile = "carrier.inp"\n' + "".join([*pilots, *sensors])
    (tmp_path / "i.toml").write_text(text)
    files = {"stiffness": "k.npz", "mass": "m.npz", "interfaces": "i.toml"}
    given = {role: tmp_path / name for role, name in files.items()}
    reduce_body.main(out=tmp_path / "given.h5", modes=8, quiet=True, **given)
    bodies = [
        stage_body_of_files({"carrier": tmp_path / name}, 1e7, 0.06, gear=GearData())
        for name in ("ours.h5", "given.h5")
    ]
    K, K_given = (body.model.K for body in bodies)
    scale = np.sqrt(np.outer(*2 * [K.diagonal()]))
    assert (np.abs(K_given - K) / scale).max() < 1e-7
    assert bodies[1].model.sensor_rows.shape == bodies[0].model.sensor_rows.shape


BRICKS = """*NODE
11,0,0,0
12,1000,0,0
13,1000,100,0
14,0,100,0
15,0,0,100
16,1000,0,100
17,1000,100,100
18,0,100,100
22,2000,0,0
23,2000,100,0
26,2000,0,100
27,2000,100,100
*ELEMENT,TYPE=C3D8,ELSET=iron
1,11,12,13,14,15,16,17,18
*ELEMENT,TYPE=C3D8,ELSET=alu
2,12,22,23,13,16,26,27,17
*NSET,NSET=start
11,14,15,18
*NSET,NSET=end
22,23,26,27
"""
OF_A_MESH = """format = "carrierflex-interfaces"
version = 1
name = "bricks"
[units]
length = 0.001
[materials.iron]
E = 2.1e11
nu = 0.3
rho = 7850.0
[materials.alu]
E = 7e10
nu = 0.33
rho = 2700.0
[[pilots]]
name = "start"
type = "distributing"
node_set = "start"
[[pilots]]
name = "end"
type = "rigid"
node_set = "end"
"""


def test_a_mesh_of_hexahedra_of_two_materials_is_a_body_like_any_other(tmp_path):
    (tmp_path / "bricks.inp").write_text(BRICKS)
    (tmp_path / "bricks.toml").write_text(OF_A_MESH)
    files = {"mesh": tmp_path / "bricks.inp", "interfaces": tmp_path / "bricks.toml"}
    out = tmp_path / "bricks.h5"
    body = reduce_body.main(out=out, modes=2, quiet=True, **files)
    # Ten and ten litres.
    assert_allclose(body.mass_properties.mass, 0.01 * (7850.0 + 2700.0), rtol=1e-12)
    assert "too stiff in bending" in body.provenance["warnings"]
    assert check_certificate.main(out).met
    export_body.main(out, format="mbdyn", out=tmp_path / "bricks.fem", quiet=True)


def test_a_mesh_without_materials_and_materials_without_a_mesh_are_refused(tmp_path):
    (tmp_path / "bricks.inp").write_text(BRICKS)
    toml = tmp_path / "bricks.toml"
    materials, pilots = (OF_A_MESH.index(mark) for mark in ("[materials.iron]", "[[pilots]]"))
    toml.write_text(OF_A_MESH[:materials] + OF_A_MESH[pilots:])
    with pytest.raises(ValueError, match=r"expected either \[nodes\], of matrices, or \[mater"):
        reduce_body.main(
            out=tmp_path / "a.h5", mesh=tmp_path / "bricks.inp", interfaces=toml, quiet=True
        )
    toml.write_text(OF_A_MESH)
    sp.save_npz(tmp_path / "k.npz", sp.eye_array(3).tocsr())
    with pytest.raises(ValueError, match=r"table \[materials\] together with matrices"):
        cf.given_body(tmp_path / "k.npz", tmp_path / "k.npz", toml)
    (tmp_path / "bricks.inp").write_text(BRICKS.replace("C3D8,ELSET=alu", "C3D15,ELSET=alu"))
    with pytest.raises(ValueError, match=r"bricks\.inp: "):
        reduce_body.main(
            out=tmp_path / "a.h5", mesh=tmp_path / "bricks.inp", interfaces=toml, quiet=True
        )
    assert not (tmp_path / "a.h5").exists()
