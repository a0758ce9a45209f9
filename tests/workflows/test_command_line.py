"""The command as a user meets it: exit codes, one-line errors, nothing left behind.

Every exit code is seen once from a process of its own; the other refusals run in this one.
"""

import errno
import importlib
import importlib.metadata
import inspect
import os
import signal
import subprocess
import sys
import time

import pytest

from carrierflex.files.versions import installed, software_name
from carrierflex.workflows.shell.commands import COMMANDS, RENAMED

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


def test_help_lists_the_commands(tmp_path):
    result = carrierflex("--help", cwd=tmp_path)
    assert result.returncode == 0
    for name in ("run", "mesh", "curves", "reduce", "simulate", "identify"):
        assert name in result.stdout


def test_help_of_a_command_explains_units(command):
    result = command("mesh", "--help")
    assert result.returncode == 0, result.stderr
    assert "[m]" in result.stdout


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
def test_impossible_parameters_get_one_line_and_leave_nothing(tmp_path, command, text, message):
    (tmp_path / "stage.toml").write_text(text, encoding="utf-8")
    line = refused(command("run", "--parameters", "stage.toml", "--out", "out"))
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


def test_version_help_and_refusal_of_a_command_load_no_workflow(tmp_path):
    program = (
        "import sys\nfrom carrierflex.workflows.command_line import main\ntry:\n    main()\n"
        "except SystemExit:\n    pass\n"
        "heavy = {'numpy', 'scipy', 'numba', 'gmsh', 'pydantic', 'pandas', 'skfem'}\n"
        "sys.exit(f'loaded {heavy & set(sys.modules)}' if heavy & set(sys.modules) else 0)"
    )
    for argument in ("--version", "--help", "diagnoze"):
        subprocess.run([sys.executable, "-c", program, argument], check=True, cwd=tmp_path)


def test_a_misspelt_command_is_told_the_nearest_name(command):
    assert 'unknown command "diagnoze"; did you mean "diagnose"?' in refused(command("diagnoze"))
    assert 'did you mean "study torsion"?' in refused(command("study", "torsoin"))
    assert 'did you mean "study torsion"?' in refused(command("torsoin"))
    assert "expected one of run, cases, parameters" in refused(command("xyz"))


@pytest.mark.parametrize("name", RENAMED)
def test_a_renamed_command_or_option_tells_its_new_name(command, name):
    if name.startswith("--"):
        assert f"{name} is now {RENAMED[name]} (" in refused(command("check", "c", name, "1"))
    else:
        assert RENAMED[name] in COMMANDS
        assert f'"{name}" is now "{RENAMED[name]}"' in refused(command(name, "--out", "o"))


@pytest.mark.parametrize("name", COMMANDS)
def test_the_help_of_a_command_is_that_of_its_workflow_and_its_table_exists(name):
    registered = COMMANDS[name]
    workflow = importlib.import_module(f"carrierflex.workflows.{registered.workflow}").main
    assert inspect.getdoc(workflow).splitlines()[0] == registered.help
    module, function = registered.table.split(":")
    assert callable(
        getattr(importlib.import_module(f"carrierflex.workflows.screen.{module}"), function)
    )


def test_unknown_variant_option_and_suffix_are_refused(tmp_path, command):
    assert 'Choose from: "stiff", "flexible"' in refused(
        command("mesh", "--variant", "x", "--out", "a.msh")
    )
    assert "--sise" in refused(
        command("mesh", "--variant", "stiff", "--sise", "1", "--out", "a.msh")
    )
    assert "expected one of .msh" in refused(
        command("mesh", "--variant", "stiff", "--out", "a.stl")
    )
    assert "mesh size is 5.0 m" in refused(
        command("mesh", "--variant", "stiff", "--size", "5", "--out", "a.msh")
    )
    assert not list(tmp_path.iterdir())


def test_unwritable_output_folder_is_refused(tmp_path, command):
    (tmp_path / "file").write_text("", encoding="utf-8")
    line = refused(command("run", "--out", "file/out"))
    assert "cannot write into this output folder" in line


def test_missing_library_is_told_in_one_line(tmp_path):
    # A package of that name that does not load stands in for a shared library that is not there.
    (tmp_path / "gmsh.py").write_text(
        "raise OSError('libGLU.so.1: cannot open shared object file')", encoding="utf-8"
    )
    result = subprocess.run(
        [*COMMAND, "mesh", "--variant", "stiff", "--out", "a.msh"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": f"{tmp_path}{os.pathsep}{os.environ['PYTHONPATH']}"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert "libGLU.so.1" in refused(result)


def test_missing_input_files_are_refused(tmp_path, command):
    assert "no such file" in refused(
        carrierflex(
            "mesh", "--variant", "stiff", "--parameters", "p.toml", "--out", "a.msh", cwd=tmp_path
        )
    )
    refused(command("identify", "nowhere", "--model", "m1", "--out", "out"))
    refused(command("simulate", "nowhere.toml", "--out", "out"))
    assert not list(tmp_path.iterdir())


@pytest.mark.long
def test_interrupted_run_says_so_and_leaves_whole_files_only(tmp_path):
    with subprocess.Popen(
        [*COMMAND, "run", "--out", "out", "--size", "0.06"],
        cwd=tmp_path,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        try:
            # Seconds on a quiet machine; a busy one may take its time.
            deadline = time.monotonic() + 600.0
            while (
                not (tmp_path / "out" / "deflection_curves.csv").exists()
                and time.monotonic() < deadline
            ):
                time.sleep(0.05)
            process.send_signal(signal.SIGINT)
            _, stderr = process.communicate(timeout=600)
        finally:
            process.kill()
    assert process.returncode == 130, stderr
    *stages, last = stderr.strip().splitlines()
    assert last == "carrierflex: interrupted; finished files are complete and remain"
    assert all(line.startswith("[") for line in stages)
    assert (tmp_path / "out" / "deflection_curves.csv").exists()
    assert not [path for path in tmp_path.rglob("*") if path.name.startswith(".")]


@pytest.mark.long
@pytest.mark.slow
def test_mesh_command_writes_the_file_it_was_asked_for(tmp_path):
    result = carrierflex(
        "mesh", "--variant", "flexible", "--size", "0.06", "--out", "carrier.inp", cwd=tmp_path
    )
    assert result.returncode == 0, result.stderr
    assert [line[:5] for line in result.stderr.splitlines()] == ["[1/2]", "[2/2]"]
    assert "smallest over largest Jacobian" in result.stdout
    assert "TYPE=C3D10\n" in (tmp_path / "carrier.inp").read_text(encoding="utf-8")


def test_the_version_lists_what_is_installed_and_what_is_not(monkeypatch):
    there = importlib.metadata.version

    def version(name):
        if name == "k3d":
            raise importlib.metadata.PackageNotFoundError(name)
        return there(name)

    monkeypatch.setattr("carrierflex.files.versions.version", version)
    first, *others = installed().splitlines()
    assert first == software_name()
    assert f"numpy {there('numpy')}" in others
    assert "k3d not installed (view --html)" in others


def test_a_reader_that_has_read_enough_is_no_error(tmp_path):
    with subprocess.Popen(
        [*COMMAND, "cases"], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as process:
        process.stdout.close()
        stderr = process.stderr.read()
    assert (process.returncode, stderr) == (141, b"")


def test_a_command_whose_output_is_closed_does_its_work(tmp_path):
    ended = subprocess.run(
        ["sh", "-c", 'exec "$@" >&- 2>&-', "sh", *COMMAND, "cases", "mounting_2011", "--out", "."],
        cwd=tmp_path,
        check=False,
    )
    assert ended.returncode == 0
    assert 'kind = "mounting"' in (tmp_path / "mounting_2011.toml").read_text()


def test_too_little_memory_is_refused_before_the_work(tmp_path):
    limited = ["sh", "-c", 'ulimit -v 600000; exec "$@"', "sh", *COMMAND, "schema", "map"]
    ended = subprocess.run(limited, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert "memory is limited to 614 MB by `ulimit -v`; expected at least 1500" in refused(ended)


@pytest.mark.parametrize(
    "error",
    [
        MemoryError("Unable to allocate 7.3 GiB for an array"),
        MemoryError(),
        ImportError("libgmsh.so: failed to map segment from shared object"),
        OSError(errno.ENOMEM, "Cannot allocate memory"),
    ],
)
def test_memory_that_is_refused_blames_no_file(tmp_path, command, monkeypatch, error):
    def lacking(*arguments, **options):
        raise error

    (tmp_path / "sound.toml").write_text("")
    monkeypatch.setattr("carrierflex.geometry.parameter_files.read_toml", lacking)
    line = refused(command("parameters", "--parameters", "sound.toml", "--out", "a.toml"))
    assert line.startswith("carrierflex: memory does not suffice")
    assert "ulimit -v" in line
    assert "sound.toml" not in line
