"""What is quick stays quick: help and refusals import no library of the work.

Modules are counted, not seconds; ``benchmarks/start_up.py`` measures those.
"""

import importlib
import inspect
import json
import os
import subprocess
import sys
import typing

import pytest

from benchmarks.refused_lines import with_bad_toml, with_unknown_option, write_bad_files
from carrierflex.identification.campaign.campaign_files import read_campaign, write_campaign
from carrierflex.workflows.shell.commands import COMMANDS
from carrierflex.workflows.shell.early_refusals import refuse_early
from carrierflex.workflows.shell.written_signatures import written_command
from tests.identification.synthetic_campaigns import carrier_campaign, run_case

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
FILES = {"numpy", "pydantic", "pyarrow", "pint"}
#: Looks for plugins of pydantic, of which there are none; reads options.
PLUGINS = {"importlib.metadata"}
OPTIONS = {"cyclopts"}


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
    lines += [[name, "--help"] for name in COMMANDS]
    lines += with_unknown_option()
    told, loaded = run_in_one_process(lines, tmp_path)
    codes = [code for code, _ in told]
    assert codes[:3] == [0, 0, 2]
    assert codes[3:] == [0] * len(COMMANDS) + [2] * len(COMMANDS), told
    assert loaded & (WORK | FILES) == set()


@pytest.mark.long
def test_a_refused_toml_of_every_command_loads_no_library_of_the_work(tmp_path):
    write_bad_files(tmp_path)
    lines = list(with_bad_toml())
    assert {line[0] for line in lines} >= {"run", "mesh", "simulate", "check", "diagnose", "import"}
    told, loaded = run_in_one_process(lines, tmp_path)
    for line, (code, words) in zip(lines, told, strict=True):
        assert code == 2, (line, words)
        assert "bad" in words, (line, words)
        assert words.count("\n") == 1
    assert loaded & WORK == set()


@pytest.mark.long
def test_a_refused_toml_loads_no_library_of_arrays(tmp_path):
    write_bad_files(tmp_path)
    _, loaded = run_in_one_process(list(with_bad_toml()), tmp_path)
    assert loaded & (WORK | FILES | PLUGINS | OPTIONS) == {"pydantic"}


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


def test_a_refused_campaign_is_told_in_the_words_of_its_reader(tmp_path):
    write_bad_files(tmp_path)
    for kind in ("carrier", "mounting", "element"):
        folder = tmp_path / f"bad_campaign_{kind}"
        with pytest.raises(ValueError, match="unknown key 'no_such_key'") as slow:
            read_campaign(folder)
        with pytest.raises(ValueError, match="unknown key 'no_such_key'") as quick:
            refuse_early({"campaign": folder})
        assert str(quick.value) == str(slow.value)


@pytest.mark.parametrize("name", COMMANDS)
def test_what_is_read_of_a_workflow_is_what_it_has(name):
    module = f"carrierflex.workflows.{COMMANDS[name].workflow}"
    main = importlib.import_module(module).main
    written = written_command(module)
    real = inspect.signature(main)
    assert list(written.signature.parameters) == list(real.parameters)
    hints = typing.get_type_hints(main, include_extras=True)
    for key, option in written.signature.parameters.items():
        assert option.kind is real.parameters[key].kind
        assert option.default == real.parameters[key].default
        assert option.annotation == hints[key]
    assert written.docstring == inspect.getdoc(main)


def test_a_plan_takes_a_campaign_in_place_of_a_case(tmp_path):
    write_campaign(carrier_campaign([run_case("LC1", duration=6.0)]), tmp_path / "campaign")
    refuse_early({"case": tmp_path / "campaign"})
    document = tmp_path / "campaign" / "campaign.toml"
    document.write_text(f"no_such_key = 1\n{document.read_text()}", encoding="utf-8")
    with pytest.raises(ValueError, match="unknown key 'no_such_key'"):
        refuse_early({"case": tmp_path / "campaign"})
