"""Tutorials from end to end: every block of a page in turn, in an empty folder."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = [pytest.mark.docs, pytest.mark.long]

PAGES = sorted((Path(__file__).parents[2] / "docs" / "tutorials").glob("*.md"))
#: What a page must have: own carrier, STEP file, matrices, measurement; one element; mounting.
TUTORIALS = {
    "mounting", "one_element", "own_carrier", "own_matrices", "own_measurement", "own_step_file",
}  # fmt: skip
#: Commands from a logger's file to the first report.
MOST_COMMANDS = 5
PREAMBLE = """set -eu
carrierflex() { "$PYTHON" -P -m carrierflex.workflows.command_line "$@"; }
python() { "$PYTHON" -P "$@"; }
"""


def script(page):
    """The page's blocks as one shell script; Python goes into it as it stands."""
    text = page.read_text(encoding="utf-8")
    parts = [PREAMBLE]
    for language, block in re.findall(r"```(sh|python)\n(.*?)```", text, flags=re.DOTALL):
        parts.append(block if language == "sh" else f"python - <<'END'\n{block}END\n")
    return "".join(parts)


def test_there_is_one_for_every_way_in():
    assert {page.stem for page in PAGES} == TUTORIALS


def test_a_new_user_s_files_become_a_report_in_a_few_commands():
    page = next(page for page in PAGES if page.stem == "own_measurement")
    blocks = re.findall(r"```sh\n(.*?)```", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    lines = [line for line in "".join(blocks).replace("\\\n", " ").splitlines() if line.strip()]
    assert len(lines) <= MOST_COMMANDS
    assert lines[-1].startswith("carrierflex diagnose")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_tutorial_runs_as_it_stands(page, tmp_path):
    done = subprocess.run(
        ["bash", "-c", script(page)],
        cwd=tmp_path,
        env={**os.environ, "PYTHON": sys.executable},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "Warning" not in done.stderr
    left = re.search(r"It leaves (.*?)\.\n", page.read_text(encoding="utf-8"), flags=re.DOTALL)[1]
    for name in re.findall(r"`([^`]+)`", left):
        assert (tmp_path / name).exists(), name
