"""Tutorials from end to end: every block of a page in turn, in an empty folder.

What a page says comes out: lines of its ``text`` blocks stand on the screen, its headline in files.
"""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

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
    steps = [PREAMBLE]
    for language, block in re.findall(r"```(sh|python)\n(.*?)```", text, flags=re.DOTALL):
        steps.append(block if language == "sh" else f"python - <<'END'\n{block}END\n")
    return "".join(steps)


def expected_lines(page):
    """Lines of what a page says the screen shows."""
    blocks = re.findall(r"```text\n(.*?)```", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    return [line.split() for line in "".join(blocks).splitlines()]


def is_same(printed, expected):
    """Equal words; numbers within half a per cent, half widths of two digits within a tenth."""
    if len(printed) != len(expected):
        return False
    before = ["", *expected]
    return all(
        is_same_word(*words, 0.1 if previous in ("±", "+-") else 5e-3)
        for words, previous in zip(zip(printed, expected, strict=True), before, strict=False)
    )


def is_same_word(printed, expected, tolerance):
    first, second = (word.strip(",[]") for word in (printed, expected))
    try:
        return abs(float(first) - float(second)) <= tolerance * abs(float(second))
    except ValueError:
        return printed == expected


def carrier_is_tilted(folder):
    """0.595 mrad in the mean of the load cases, about an axis at 60 degrees."""
    answer = json.loads((folder / "diagnosis" / "diagnosis.json").read_text(encoding="utf-8"))
    tilt = answer["parameters"]["carrier_tilt"]
    assert answer["effects"][0] == "carrier_tilt"
    assert_allclose(
        tilt["phi_PLC"]["value"], (0.58e-3 + 0.55e-3 + 0.60e-3 + 0.65e-3) / 4, rtol=5e-3
    )
    assert_allclose(tilt["theta_PLC"]["value"], np.deg2rad(60.0), atol=2e-3)
    page = (folder / "diagnosis" / "report.html").read_text(encoding="utf-8")
    assert "Part of the gap (10 % of its RMS above the noise) is unexplained" in page


def mount_is_cubic(folder):
    answer = json.loads((folder / "diagnosis" / "diagnosis.json").read_text(encoding="utf-8"))
    assert (answer["verdict"], answer["effects"]) == ("named", ["cubic_stiffness"])
    assert answer["warnings"] == []
    low, high = answer["parameters"]["cubic_stiffness"]["K3"]["ci95"]
    assert low < 5e8 < high
    page = (folder / "diagnosis" / "report.html").read_text(encoding="utf-8")
    assert "<h1>The gap is explained by cubic stiffness.</h1>" in page


def bushings_are_those_of_the_case(folder):
    result = json.loads((folder / "bushings" / "identification.json").read_text(encoding="utf-8"))
    for name, truth in {"K1": 17.6e6, "K3": 65.05e9, "K5": 1.55e15, "C0": 1.0e5}.items():
        low, high = result["shared"][name]["ci95"]
        assert low < truth < high, name
    assert_allclose(result["runs"]["load_case"]["rms"], 2e-6, rtol=0.02)


#: What the headline of a page comes to.
HEADLINES = {
    "own_measurement": carrier_is_tilted,
    "one_element": mount_is_cubic,
    "mounting": bushings_are_those_of_the_case,
}


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
        # Without a terminal's width: no line of a table is folded.
        env={**{k: v for k, v in os.environ.items() if k != "COLUMNS"}, "PYTHON": sys.executable},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "Warning" not in done.stderr
    outputs = re.search(r"It leaves (.*?)\.\n", page.read_text(encoding="utf-8"), flags=re.DOTALL)[
        1
    ]
    for name in re.findall(r"`([^`]+)`", outputs):
        assert (tmp_path / name).exists(), name
    screen = [line.split() for line in done.stdout.splitlines()]
    expected = expected_lines(page)
    assert len(expected) >= 3
    for line in expected:
        assert any(is_same(shown, line) for shown in screen), " ".join(line)
    HEADLINES.get(page.stem, lambda folder: None)(tmp_path)
