"""The command as a user meets it: exit codes, one-line errors, nothing left behind."""

import os
import signal
import subprocess
import sys
import time

import pytest

COMMAND = [sys.executable, "-m", "carrierflex.workflows.command_line"]


def carrierflex(*arguments, cwd):
    environment = {**os.environ, "COLUMNS": "200"}
    return subprocess.run(
        [*COMMAND, *map(str, arguments)],
        cwd=cwd,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )


def refused(result):
    assert result.returncode == 2, result.stderr
    lines = result.stderr.strip().splitlines()
    assert len(lines) == 1, result.stderr
    assert lines[0].startswith("carrierflex: ")
    return lines[0]


def test_help_lists_the_commands_and_explains_units(tmp_path):
    result = carrierflex("--help", cwd=tmp_path)
    assert result.returncode == 0
    for name in ("run", "mesh", "curves", "reduce", "simulate", "identify"):
        assert name in result.stdout
    assert "[m]" in carrierflex("mesh", "--help", cwd=tmp_path).stdout


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "[carrier]\npin_hole_diameter = 0.3\n",
            "pin_hole_diameter is 0.3 m: the hole reaches radius 0.458 m",
        ),
        (
            "[carrier]\nouter_radius = 0.4\n",
            "outer_radius is 0.4 m: the rim ends inside the sensor radius",
        ),
        (
            "[carrier]\nplanet_clearance_radius = 0.28\n",
            "planet_clearance_radius is 0.28 m: the webs touch the planet",
        ),
        ("[carrier]\nouter_radios = 0.4\n", "unknown key 'outer_radios'"),
        ("[hub]\nlength = 0.4\n", "unknown key 'hub'"),
        ("carrier = \n", "not a TOML file"),
    ],
)
def test_impossible_parameters_get_one_line_and_leave_nothing(tmp_path, text, message):
    (tmp_path / "stage.toml").write_text(text, encoding="utf-8")
    line = refused(carrierflex("run", "--parameters", "stage.toml", "--out", "out", cwd=tmp_path))
    assert message in line
    assert not (tmp_path / "out").exists()


def test_all_mistakes_of_a_file_are_told_in_one_line(tmp_path):
    text = "[carrier]\nouter_radios = 0.4\nplate_gap = -1\n[pin]\ndiameter = 'wide'\n"
    (tmp_path / "stage.toml").write_text(text, encoding="utf-8")
    command = ("mesh", "--variant", "stiff", "--parameters", "stage.toml", "--out", "a.msh")
    line = refused(carrierflex(*command, cwd=tmp_path))
    assert line == (
        "carrierflex: 3 problems in stage.toml: "
        "(1) [carrier]: key 'plate_gap' is -1; expected a positive number; "
        "(2) [carrier]: unknown key 'outer_radios'; did you mean 'outer_radius'?; "
        "(3) [pin]: key 'diameter' is 'wide'; expected a positive number"
    )


def test_a_command_that_reads_no_toml_does_not_load_pydantic():
    program = (
        "import sys; from carrierflex.workflows.command_line import _application; _application(); "
        "sys.exit('pydantic' in sys.modules)"
    )
    subprocess.run([sys.executable, "-c", program], check=True)


def test_unknown_variant_option_and_suffix_are_refused(tmp_path):
    assert 'Choose from: "stiff", "flexible"' in refused(
        carrierflex("mesh", "--variant", "x", "--out", "a.msh", cwd=tmp_path)
    )
    assert "--sise" in refused(
        carrierflex("mesh", "--variant", "stiff", "--sise", "1", "--out", "a.msh", cwd=tmp_path)
    )
    assert "expected one of .msh" in refused(
        carrierflex("mesh", "--variant", "stiff", "--out", "a.stl", cwd=tmp_path)
    )
    assert "mesh size is 5.0 m" in refused(
        carrierflex("mesh", "--variant", "stiff", "--size", "5", "--out", "a.msh", cwd=tmp_path)
    )
    assert not list(tmp_path.iterdir())


def test_unwritable_output_folder_is_refused(tmp_path):
    (tmp_path / "file").write_text("", encoding="utf-8")
    line = refused(carrierflex("run", "--out", "file/out", cwd=tmp_path))
    assert "cannot write into this output folder" in line


def test_missing_library_is_told_in_one_line(tmp_path):
    # A package of that name that does not load stands in for a shared library that is not there.
    (tmp_path / "gmsh.py").write_text(
        "raise OSError('libGLU.so.1: cannot open shared object file')", encoding="utf-8"
    )
    result = subprocess.run(
        [*COMMAND, "mesh", "--variant", "stiff", "--out", "a.msh"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert "libGLU.so.1" in refused(result)


def test_missing_input_files_are_refused(tmp_path):
    assert "no such file" in refused(
        carrierflex(
            "mesh", "--variant", "stiff", "--parameters", "p.toml", "--out", "a.msh", cwd=tmp_path
        )
    )
    refused(carrierflex("identify", "nowhere", "--model", "m1", "--out", "out", cwd=tmp_path))
    refused(carrierflex("simulate", "nowhere.toml", "--out", "out", cwd=tmp_path))
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_interrupted_run_says_so_and_leaves_whole_files_only(tmp_path):
    process = subprocess.Popen(
        [*COMMAND, "run", "--out", "out", "--size", "0.05"],
        cwd=tmp_path,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )
    deadline = time.monotonic() + 120.0
    while not (tmp_path / "out" / "deflection_curves.csv").exists() and time.monotonic() < deadline:
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    _, stderr = process.communicate(timeout=120)
    assert process.returncode == 130, stderr
    assert stderr.strip() == "carrierflex: interrupted; files that were finished are whole and stay"
    assert (tmp_path / "out" / "deflection_curves.csv").exists()
    assert not [path for path in tmp_path.rglob("*") if path.name.startswith(".")]


@pytest.mark.slow
def test_mesh_command_writes_the_file_it_was_asked_for(tmp_path):
    result = carrierflex(
        "mesh", "--variant", "flexible", "--size", "0.06", "--out", "carrier.inp", cwd=tmp_path
    )
    assert result.returncode == 0, result.stderr
    assert result.stderr == ""
    assert "worst scaled jacobian" in result.stdout
    assert "TYPE=C3D10\n" in (tmp_path / "carrier.inp").read_text(encoding="utf-8")
