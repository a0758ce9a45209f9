"""What the command writes into a pipe, and what completes it in a shell."""

import json
import shutil
import subprocess

import pytest

from carrierflex.workflows.shell.commands import COMMANDS
from carrierflex.workflows.simulation.copy_cases import main as copy_cases


@pytest.fixture
def in_a_pipe(command, monkeypatch):
    """The command where no terminal says how wide it is."""
    monkeypatch.delenv("COLUMNS")
    return command


def test_a_schema_in_a_pipe_is_json(in_a_pipe):
    shown = in_a_pipe("schema", "diagnosis").stdout
    assert json.loads(shown)["title"] == "carrierflex: diagnosis"


def test_a_table_in_a_pipe_is_never_cut_nor_filled_up(in_a_pipe):
    lines = in_a_pipe("cases").stdout.splitlines()
    assert [line for line in lines if line != line.rstrip()] == []
    for name, title in copy_cases().titles.items():
        assert [line for line in lines if line.split()[:1] == [name] and title in line]


@pytest.mark.long
@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_a_script_knows_every_command_and_its_options(in_a_pipe, shell):
    script = in_a_pipe("completion", shell).stdout
    assert [name for name in COMMANDS if name.split()[-1] not in script] == []
    for option in ("save-law", "scheduler", "up-to"):
        assert option in script


@pytest.mark.slow
def test_bash_completes_commands_options_and_choices(in_a_pipe, tmp_path):
    bash = shutil.which("bash")
    if bash is None:
        pytest.skip("bash is not installed")
    (tmp_path / "script").write_text(in_a_pipe("completion", "bash").stdout, encoding="utf-8")

    def completed(*words):
        line = f"""source ./script; COMP_WORDS=({" ".join(words)}); COMP_CWORD={len(words) - 1}
            COMP_LINE="${{COMP_WORDS[*]}}"; COMP_POINT=${{#COMP_LINE}}
            $(complete -p carrierflex | sed 's/.*-F \\([^ ]*\\).*/\\1/')
            printf '%s\\n' "${{COMPREPLY[@]}}" """
        command_line = [bash, "--norc", "-c", line]
        ended = subprocess.run(
            command_line, cwd=tmp_path, capture_output=True, text=True, check=True
        )
        return {word.strip() for word in ended.stdout.split()}

    assert completed("carrierflex", "diag") == {"diagnose"}
    assert {"--save-law", "--seed"} <= completed("carrierflex", "diagnose", "--s")
    assert {"m1", "m2"} <= completed("carrierflex", "identify", "--model", "m")
