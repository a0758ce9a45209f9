"""What is quick stays quick: help and refused options import no library of the work.

Modules are counted, not seconds; ``benchmarks/start_up.py`` measures those.
"""

import json
import os
import subprocess
import sys

import pytest

from benchmarks.refused_lines import with_bad_toml, with_unknown_option, write_bad_files
from carrierflex.workflows.shell.commands import COMMANDS

#: Runs one command line after another in one process and tells the exit codes and what was loaded.
PROGRAM = """
import contextlib, io, json, sys
from carrierflex.workflows.command_line import main
codes = []
for arguments in json.loads(sys.argv[1]):
    sys.argv = ["carrierflex", *arguments]
    said, shown = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(shown), contextlib.redirect_stderr(said):
        try:
            main()
            code = 0
        except SystemExit as end:
            code = end.code or 0
    codes.append([code, said.getvalue()])
print(json.dumps([codes, sorted(sys.modules)]))
"""
WORK = {"scipy", "numba", "gmsh", "skfem", "pandas", "matplotlib", "pyvista", "h5py", "jinja2"}
WORK |= {"nicegui", "fastapi", "uvicorn"}


def run_in_one_process(lines, folder):
    """Exit code and words of every line, and the libraries that were loaded."""
    done = subprocess.run(
        [sys.executable, "-P", "-c", PROGRAM, json.dumps(lines)],
        check=True,
        cwd=folder,
        capture_output=True,
        text=True,
        env={**os.environ, "COLUMNS": "200"},
    )
    codes, modules = json.loads(done.stdout)
    return codes, set(modules)


@pytest.mark.long
def test_help_of_every_command_and_a_refused_option_load_no_library_of_the_work(tmp_path):
    lines = [["--version"], ["--help"], ["diagnoze"]]
    lines += [[*name.split(), "--help"] for name in COMMANDS]
    lines += with_unknown_option()
    outcomes, loaded = run_in_one_process(lines, tmp_path)
    codes = [code for code, _ in outcomes]
    assert codes[:3] == [0, 0, 2]
    assert codes[3:] == [0] * len(COMMANDS) + [2] * len(COMMANDS), outcomes
    assert loaded & WORK == set()


@pytest.mark.long
def test_a_wrong_toml_of_every_command_is_refused_in_one_line(tmp_path):
    write_bad_files(tmp_path)
    lines = list(with_bad_toml())
    assert {line[0] for line in lines} >= {"run", "mesh", "simulate", "check", "diagnose", "import"}
    outcomes, _ = run_in_one_process(lines, tmp_path)
    for line, (code, words) in zip(lines, outcomes, strict=True):
        assert code == 2, (line, words)
        assert "bad" in words, (line, words)
        assert words.count("\n") == 1


@pytest.mark.parametrize(
    "line",
    [
        ["curves", "--parameters=bad.toml", "--out", "out"],
        ["check", "bad_campaign_carrier"],
        ["check", "--quiet", "bad_campaign_carrier"],
        ["mesh", "--out", "a.msh", "--log-file", "log", "--parameters", "bad.toml"],
    ],
)
def test_a_wrong_file_is_told_wherever_it_stands_in_the_line(line, command, tmp_path):
    write_bad_files(tmp_path)
    done = command(*line)
    assert done.returncode == 2
    assert "unknown key 'no_such_key'" in done.stderr
    assert not (tmp_path / "log").exists() or "no_such_key" in (tmp_path / "log").read_text()
