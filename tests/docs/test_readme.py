"""README and pages as a newcomer follows them: every command exists, and every file it reads."""

import re
import shlex
from itertools import pairwise
from pathlib import Path

import pytest

from carrierflex.simulation.carrier.case_files import shipped_case
from carrierflex.workflows import command_line
from carrierflex.workflows.shell.commands import command_in

pytestmark = pytest.mark.docs

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
BY_EXAMPLE = (ROOT / "docs" / "commands.md").read_text(encoding="utf-8")
#: What a newcomer sees at once.
MOST_LINES, MOST_WORDS = 50, 600


def blocks(page):
    """Lines of the code blocks of a page that name no language."""
    result = re.findall(r"```(?:sh|bash|console)?\n(.*?)```", page, flags=re.DOTALL)
    joined = (block.replace("\\\n", " ") for block in result)
    return [line.split(" #")[0].strip() for block in joined for line in block.splitlines()]


#: Files that a command writes into its output folder and the README reads from there.
WRITTEN = {"cad": ("carrier.step", "surfaces.toml"), "simulate": ("LC1.csv",)}


def commands():
    """Every ``carrierflex`` command of the list, in the blocks and within sentences."""
    inline = re.findall(r"`(carrierflex [^`]+)`", BY_EXAMPLE.replace("\n", " "))
    return [*blocks(BY_EXAMPLE), *inline]


def documented():
    """Every ``carrierflex`` command in the blocks of all pages, with the page."""
    for path in [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]:
        for line in blocks(path.read_text(encoding="utf-8")):
            if line.startswith("carrierflex "):
                yield path.name, line


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
    name = command_in(shlex.split(line)[1:]) or ""
    words = shlex.split(line)[name.count(" ") :]
    first = [words[2]] if len(words) > 2 and not words[2].startswith("--") else []
    options = ("--carrier", "--shaft", "--pin", "--variants", "--step", "--surfaces", "--from")
    return first + [after for word, after in pairwise(words) if word in options]


def test_the_readme_is_one_screen_with_three_pictures():
    assert README.count("\n") <= MOST_LINES
    text = re.sub(r"!?\[([^]]*)\]\([^)]*\)", r"\1", README)
    assert len(text.split()) <= MOST_WORDS
    assert README.count("![") == 3


def test_the_readme_says_what_scikit_fem_does_and_how_to_let_it_do_all():
    lines = re.findall(r"`(carrierflex [^`]*--assembly scikit-fem[^`]*)`", README)
    assert lines
    for line in lines:
        tokens = shlex.split(line)[1:]
        command_line.application().parse_args(tokens, exit_on_error=False, print_error=False)


def test_every_command_of_the_list_exists_and_finds_the_files_it_reads():
    there = set()
    lines = [line for line in commands() if line.startswith(("carrierflex", "printf"))]
    assert len(lines) > 20
    for line in lines:
        if line.startswith("carrierflex"):
            name = command_in(shlex.split(line)[1:])
            assert name is not None, line
            for file in read_by(line):
                if name == "simulate" and "." not in file:
                    assert shipped_case(file).is_file()
                else:
                    assert file in there, f"{line}: nothing before it makes {file}"
        there |= made_by(line)


@pytest.mark.parametrize(
    ("page", "line"),
    list(
        dict.fromkeys(
            [
                *(("commands.md", line) for line in commands() if line.startswith("carrierflex")),
                *documented(),
            ]
        )
    ),
)
def test_every_option_of_a_page_is_one_of_its_command(page, line):
    tokens = [token for token in shlex.split(line)[1:] if token != "..."]
    parsed = command_line.application().parse_args(tokens, exit_on_error=False, print_error=False)
    assert parsed[0].__name__ == "main"


def test_every_test_and_case_that_the_papers_page_names_exists():
    page = (ROOT / "docs" / "papers.md").read_text(encoding="utf-8")
    named = re.findall(r"`(test_\w+\.py)(?:::(test_\w+))?`", page)
    assert len(named) > 15
    for file, test in named:
        (path,) = (ROOT / "tests").rglob(file)
        assert f"def {test}(" in path.read_text(encoding="utf-8") if test else path, test
    for case in re.findall(r"`(stage_\w+)\.toml`", page):
        assert shipped_case(case).is_file()


@pytest.mark.parametrize("link", sorted(set(re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", README))))
def test_every_file_that_the_readme_links_exists(link):
    assert (ROOT / link).exists()


def test_every_folder_of_the_repository_that_the_readme_names_exists():
    for path in re.findall(
        r"`((?:simulation|docs|benchmarks|tests)/[\w./]*)`", README + BY_EXAMPLE
    ):
        assert (ROOT / path).exists(), path


def test_a_case_that_comes_along_is_simulated_by_its_name_and_another_name_is_refused(command):
    refusal = command("simulate", "carrier_lc9", "--out", "campaign")
    assert refusal.returncode == 2
    assert "expected one of carrier_lc1_to_lc4, mounting_2011" in refusal.stderr
    assert command("simulate", "carrier_lc1_to_lc4", "--out", "campaign").returncode == 0
