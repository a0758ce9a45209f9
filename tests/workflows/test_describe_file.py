"""`carrierflex info`: each kind of file is named with figures that can be checked."""

import json
import struct
import zipfile

import meshio
import numpy as np
import pytest
import scipy.sparse as sp

from carrierflex.fe.curve_files import write_curves
from carrierflex.identification.campaign.campaign_files import write_campaign
from carrierflex.reduction.body_files import write_body
from carrierflex.reduction.craig_bampton import craig_bampton
from carrierflex.reduction.exports.exudyn_files import write_exudyn
from carrierflex.simulation.carrier.case_files import shipped_case
from carrierflex.workflows import describe_file
from carrierflex.workflows.describe_file import main
from carrierflex.workflows.shell.commands import COMMANDS, command_in
from tests.identification.synthetic_campaigns import carrier_campaign, run_case
from tests.reduction.imports.sid_sample import sample
from tests.reduction.small_bar import bar
from tests.simulation.rexs.public_sample import public_stage
from tests.simulation.synthetic_curves import flexible_curve, stiff_curve


def written_curves(path):
    curves = {name: stiff_curve() for name in ("delta_s", "g_s")}
    curves |= {name: flexible_curve() for name in ("delta_f", "g_f")}
    write_curves(path, curves)
    return curves


def test_a_campaign_is_told_by_its_runs_and_channels(tmp_path):
    runs = [run_case("LC1", duration=6.0), run_case("LC2", duration=6.0)]
    campaign = carrier_campaign(runs)
    write_campaign(campaign, tmp_path / "c")
    description = main(tmp_path / "c")
    assert description.figures["runs"] == "2: LC1, LC2"
    assert description.figures["channels"].startswith(f"{len(campaign.channels)}: ")
    assert description.figures["kind"] == "carrier"
    assert f"carrierflex check {tmp_path / 'c'}" in description.commands
    (tmp_path / "c" / "LC2.csv").unlink()
    assert main(tmp_path / "c" / "campaign.toml").figures["missing run files"] == "1: LC2.csv"


def test_a_run_file_is_that_of_a_logger_and_curves_are_none(tmp_path):
    write_campaign(carrier_campaign([run_case("LC1", duration=6.0)]), tmp_path / "c")
    log = main(tmp_path / "c" / "LC1.csv")
    rows = (tmp_path / "c" / "LC1.csv").read_text().count("\n") - 1
    assert log.kind == "file of a logger"
    assert log.figures["rows"] == str(rows)
    curves = written_curves(tmp_path / "curves.csv")
    description = main(tmp_path / "curves.csv")
    assert description.kind == "deflection curves of a rim"
    largest = abs(curves["delta_f"].axial).max()
    assert description.figures["delta_f"].startswith(f"{largest:.3g} m")


def test_a_gearbox_in_rexs_is_told_by_its_stages(tmp_path):
    file = public_stage().write_archive(tmp_path / "gearbox.rexsz")
    description = main(file)
    assert description.kind == "gearbox in REXS"
    assert description.software == "FVA Workbench 5.5"
    assert description.figures["planetary stages"] == "1: 9"
    assert description.commands == (f"carrierflex cases --rexs {file} --out STAGE",)


def test_a_body_is_told_by_mass_pilots_and_certificate(tmp_path, pin_reduction):
    reduced_pin = pin_reduction.model
    write_body(reduced_pin, tmp_path / "pin.h5")
    description = main(tmp_path / "pin.h5")
    assert description.kind == "reduced body"
    assert description.figures["mass"] == f"{reduced_pin.mass_properties.mass:.4g} kg"
    assert description.figures["pilots"].startswith(f"{len(reduced_pin.pilots)}: ")
    assert description.figures["certificate"] == "none"
    assert not any(" view " in line for line in description.commands)


def test_a_mesh_a_matrix_and_a_picture(tmp_path):
    points = np.array([[0.0, 0, 0], [2, 0, 0], [0, 3, 0], [0, 0, 4]])
    meshio.write(tmp_path / "one.inp", meshio.Mesh(points, [("tetra", np.array([[0, 1, 2, 3]]))]))
    mesh = main(tmp_path / "one.inp")
    assert mesh.figures["elements"] == "1 tetra"
    assert mesh.figures["extent in the file's unit"] == "2 x 3 x 4"
    sp.save_npz(tmp_path / "k.npz", sp.csr_matrix(np.diag([1.0, 2.0, 3.0])))
    assert main(tmp_path / "k.npz").figures["as stiffness"] == "3 rows, 3 entries"
    head = b"\x89PNG\r\n\x1a\n" + struct.pack(">I4sII", 13, b"IHDR", 640, 480)
    (tmp_path / "a.png").write_bytes(head)
    assert main(tmp_path / "a.png").figures["size"] == "640 x 480 pixels"


def test_results_state_who_wrote_them(tmp_path):
    pin_fit = {"worst": 0.5, "inputs": {"size": 0.03}, "versions": {"carrierflex": "9.8"}}
    (tmp_path / "pin_fit.json").write_text(json.dumps(pin_fit))
    description = main(tmp_path / "pin_fit.json")
    assert (description.kind, description.software) == ("result 'pin-fit'", "carrierflex 9.8")
    assert description.figures["worst"] == "0.5"
    gap = {"gap": {"best": "tilt", "causes": [1, 2]}, "inputs": {"seed": 1}, "versions": {}}
    (tmp_path / "papers_gap.json").write_text(json.dumps(gap))
    description = main(tmp_path)
    assert description.kind.startswith("folder with papers_gap.json: causes that explain the gap")
    assert (description.figures["best"], description.figures["causes"]) == ("tilt", "2 entries")
    assert "gap" not in description.figures
    diagnosis = {"format": "carrierflex-diagnosis", "headline": "h", "software": "carrierflex 9"}
    (tmp_path / "diagnosis.json").write_text(json.dumps(diagnosis))
    assert main(tmp_path).kind == "folder with diagnosis.json: diagnosis"


@pytest.mark.parametrize("name", ["carrier_lc1_to_lc4", "stage_lc1", "mounting_2011"])
def test_every_command_that_is_named_exists(name):
    description = main(shipped_case(name))
    assert description.commands
    for line in description.commands:
        assert command_in(line.split()[1:]) in COMMANDS


def test_all_formats_name_commands_that_exist():
    for _, lines in describe_file._FORMATS.values():
        for line in lines:
            assert command_in(line.split()) in COMMANDS, line


def test_an_encrypted_archive_is_refused_by_name(tmp_path):
    path = tmp_path / "a.fmu"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", "<fmiModelDescription/>")
    content = bytearray(path.read_bytes())
    for signature, flags in ((b"PK\x03\x04", 6), (b"PK\x01\x02", 8)):
        content[content.index(signature) + flags] |= 1
    path.write_bytes(content)
    with pytest.raises(ValueError, match=r"a\.fmu: not an FMU \(.*encrypted"):
        main(path)


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.json", b'{"x": 1}', "JSON that no command writes"),
        ("a.toml", b"x = 1\n", "TOML of no kind that a command takes"),
        ("a.fmu", b"PK\x03\x04", "not an FMU"),
        ("a.png", b"GIF89a", "not a picture"),
        ("a.html", b"<html></html>", "a page without a title"),
        ("a.op4", b"\x00\x01", "a.op4: "),
        ("a.h5", b"\x89HDF\r\n\x1a\n" + bytes(40), "not an HDF5 file"),
        ("a.vtu", b"<VTKFile>", "not a mesh (.vtu)"),
        ("a.step", b"ISO-10303-21;", "a.step: "),
    ],
)
def test_a_damaged_or_foreign_file_is_refused_by_its_name(tmp_path, name, content, message):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(ValueError, match=r"\S") as refusal:
        main(tmp_path / name)
    assert message in str(refusal.value)
    assert str(tmp_path / name) in str(refusal.value)
    assert "\n" not in str(refusal.value)


def test_an_empty_folder_is_none_of_ours(tmp_path):
    with pytest.raises(ValueError, match=r"a folder with none of campaign\.toml"):
        main(tmp_path)


def test_bodies_of_other_programs_are_told_by_mass_and_pilots(tmp_path):
    reduction = craig_bampton(bar((1, 1, 1)), 1)
    (tmp_path / "plate.SID_FEM").write_text(sample())
    write_exudyn(bar((1, 1, 1)), reduction, tmp_path / "bar.hdf5")
    for name, pilots in (("plate.SID_FEM", "1: node_1"), ("bar.hdf5", "2: bar_start, bar_end")):
        description = main(tmp_path / name)
        assert description.kind == "reduced body of another program"
        assert description.figures["pilots"] == pilots
        assert description.commands == (
            f"carrierflex export {tmp_path / name} --format FORMAT --out FILE",
        )
