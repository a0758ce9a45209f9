"""A file that this program did not write stays as it is, whatever option names it."""

import pytest

from carrierflex.fe.curve_files import write_curves
from carrierflex.workflows.outputs import save_table
from tests.simulation.synthetic_curves import flexible_curve, stiff_curve

MEASUREMENT = b"PAR1 a measurement \x00\x01 PAR1"
COMMANDS = {
    "schema": ("schema", "map", "--out", "theirs"),
    "mesh": ("mesh", "--out", "theirs.msh", "--size", "0.3"),
    "drawing": ("parameters", "--out", "theirs.toml"),
    "view": ("view", "curves.csv", "--out", "theirs.html"),
    "fmu": ("fmu", "--out", "theirs.fmu"),
    "log": ("cases", "--log-file", "theirs.parquet"),
    "log of another program": ("cases", "--log-file", "theirs.log"),
}
CONTENT = {
    "mesh": b"$MeshFormat\n4.1 1 8\n$EndMeshFormat\n",
    "fmu": b"PK\x03\x04modelDescription.xml of another tool",
    "view": b"<html>their page</html>",
    "log of another program": b"2026-01-02 03:04:05,678 INFO other.tool: started\n",
}


@pytest.mark.parametrize("name", COMMANDS)
def test_what_others_wrote_is_not_replaced(name, command, tmp_path):
    curves = {each: stiff_curve() for each in ("delta_s", "g_s")}
    curves |= {each: flexible_curve() for each in ("delta_f", "g_f")}
    write_curves(tmp_path / "curves.csv", curves)
    theirs = tmp_path / COMMANDS[name][-1 if name != "mesh" else 2]
    if name == "drawing":
        theirs = theirs.with_suffix(".png")
    content = CONTENT.get(name, MEASUREMENT)
    theirs.write_bytes(content)
    ended = command(*COMMANDS[name])
    assert ended.returncode == 2
    assert theirs.name in ended.stderr
    assert ended.stderr.count("\n") == 1
    assert theirs.read_bytes() == content
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted({"curves.csv", theirs.name})


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("printed_tables.json", b'{"rows": [1, 2]}'),
        ("printed_tables.json", MEASUREMENT),
        ("printed_tables.png", b"\x89PNG\r\n\x1a\n of another program"),
    ],
)
def test_a_file_in_the_folder_that_others_wrote_stays(command, tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    ended = command("papers", "printed-tables", "--out", ".")
    assert ended.returncode == 2
    assert f"{name}: is there already" in ended.stderr
    assert (tmp_path / name).read_bytes() == content


def test_a_table_and_curves_that_others_wrote_stay(tmp_path):
    for name in ("table.csv", "curves.csv"):
        (tmp_path / name).write_text("t,force\n0,1\n")
    with pytest.raises(FileExistsError, match=r"table\.csv: is there already"):
        save_table(tmp_path / "table.csv", ["angle", "rms"], [[0.0, 1.0]])
    with pytest.raises(FileExistsError, match=r"curves\.csv: is there already"):
        write_curves(tmp_path / "curves.csv", {"delta_s": stiff_curve()})
    save_table(tmp_path / "ours.csv", ["angle", "rms"], [[0.0, 1.0]])
    save_table(tmp_path / "ours.csv", ["angle", "largest"], [[0.0, 2.0]])
    assert "largest" in (tmp_path / "ours.csv").read_text()


def test_a_folder_in_the_place_of_a_file_is_refused_before_the_work(command, tmp_path):
    (tmp_path / "pin.h5").mkdir()
    ended = command("reduce", "--body", "pin", "--size", "0.06", "--out", "pin.h5")
    assert ended.returncode == 2
    assert "pin.h5: is a folder; expected the name of a file to write" in ended.stderr
    assert ended.stderr.count("\n") == 1


@pytest.mark.long
def test_a_folder_of_this_program_is_written_again(command):
    for _ in range(2):
        assert command("papers", "printed-tables", "--out", "out").returncode == 0


@pytest.mark.parametrize("name", ["schema", "fmu"])
def test_what_this_program_wrote_is_replaced(name, command, tmp_path):
    for _ in range(2):
        assert command(*COMMANDS[name]).returncode == 0
    assert (tmp_path / COMMANDS[name][-1]).stat().st_size > 100


def test_a_log_goes_on_where_it_is_one(command, tmp_path):
    (tmp_path / "run.log").touch()
    sizes = []
    for _ in range(2):
        assert command("cases", "--log-file", "run.log").returncode == 0
        sizes.append((tmp_path / "run.log").stat().st_size)
    assert 0 < sizes[0] < sizes[1]
