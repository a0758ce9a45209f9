"""The README as a newcomer follows it: every command exists, and every file that it reads."""

import re
import shlex
from itertools import pairwise
from pathlib import Path

import pytest

from carrierflex.simulation.carrier.case_files import shipped_case
from carrierflex.workflows import command_line

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
COMMANDS = [
    line.split(" #")[0].strip()
    for block in re.findall(r"```\n(.*?)```", README, flags=re.DOTALL)
    for line in block.splitlines()
]
#: Files that a command writes into its output folder and the README reads from there.
WRITTEN = {"cad": ("carrier.step", "surfaces.toml"), "simulate": ("LC1.csv",)}


def commands():
    """Every ``carrierflex`` command of the README, in the blocks and within sentences."""
    own = re.findall(r"`(carrierflex [^`]+)`", README.replace("\n", " "))
    return [*COMMANDS, *own]


def made_by(line):
    """Files and folders that a command leaves behind."""
    if ">" in line:
        return {line.split(">")[1].strip()}
    words = shlex.split(line)
    written = {after for word, after in pairwise(words) if word == "--out"}
    names = WRITTEN.get(words[1], ())
    return written | {f"{folder}/{name}" for folder in written for name in names}


def read_by(line):
    """Files and folders that a command takes: its first argument and those of some options."""
    words = shlex.split(line)
    first = [words[2]] if len(words) > 2 and not words[2].startswith("--") else []
    options = ("--carrier", "--shaft", "--pin", "--variants", "--step", "--surfaces", "--from")
    return first + [after for word, after in pairwise(words) if word in options]


def test_every_command_of_the_readme_exists_and_finds_the_files_it_reads():
    there = set()
    lines = [line for line in commands() if line.startswith(("carrierflex", "printf"))]
    assert len(lines) > 20
    for line in lines:
        if line.startswith("carrierflex"):
            name = shlex.split(line)[1]
            assert name in command_line._COMMANDS
            for file in read_by(line):
                if name == "simulate" and "." not in file:
                    assert shipped_case(file).is_file()
                else:
                    assert file in there, f"{line}: nothing before it makes {file}"
        there |= made_by(line)


@pytest.mark.parametrize(
    "line", [line for line in dict.fromkeys(commands()) if line.startswith("carrierflex")]
)
def test_every_option_of_the_readme_is_one_of_its_command(line):
    tokens = [token for token in shlex.split(line)[1:] if token != "..."]
    parsed = command_line._application().parse_args(tokens, exit_on_error=False, print_error=False)
    assert parsed[0].__name__ == "main"


@pytest.mark.parametrize("link", sorted(set(re.findall(r"\]\(([^)#:]+)\)", README))))
def test_every_file_that_the_readme_links_exists(link):
    assert (ROOT / link).exists()


def test_every_folder_of_the_repository_that_the_readme_names_exists():
    for path in re.findall(r"`((?:simulation|docs|benchmarks|tests)/[\w./]*)`", README):
        assert (ROOT / path).exists(), path


def test_a_case_that_comes_along_is_simulated_by_its_name_and_another_name_is_refused(command):
    refusal = command("simulate", "carrier_lc9", "--out", "campaign")
    assert refusal.returncode == 2
    assert "expected one of carrier_lc1_to_lc4, mounting_2011" in refusal.stderr
    assert command("simulate", "carrier_lc1_to_lc4", "--out", "campaign").returncode == 0
