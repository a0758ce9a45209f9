"""The gallery: short scripts, each with its picture, no two of one command and kind."""

import runpy
import sys
from pathlib import Path

import pytest
from matplotlib.image import imread

from carrierflex.workflows.shell.commands import COMMANDS

pytestmark = pytest.mark.docs

ROOT = Path(__file__).parents[2]
TOOL = runpy.run_path(str(ROOT / "tools" / "make_gallery.py"))
ENTRIES = TOOL["entries"]()
FEWEST, MOST_LINES = 16, 48


def test_every_entry_is_a_short_script_of_a_command_and_kind_of_its_own():
    assert len(ENTRIES) >= FEWEST
    assert len({(entry.command, entry.kind) for entry in ENTRIES}) == len(ENTRIES)
    for entry in ENTRIES:
        assert entry.command in COMMANDS, entry.path
        assert entry.kind
        assert entry.path.read_text(encoding="utf-8").count("\n") <= MOST_LINES, entry.path


@pytest.mark.parametrize("entry", ENTRIES, ids=lambda entry: entry.path.stem)
def test_every_entry_has_a_picture_that_shows_something(entry):
    picture = imread(TOOL["PICTURES"] / f"{entry.path.stem}.png")[..., :3]
    assert 0.005 < (picture != picture[0, 0]).any(axis=-1).mean() < 0.98


def test_the_page_shows_every_entry_as_it_is():
    # make gallery writes it anew.
    assert TOOL["PAGE"].read_text(encoding="utf-8") == TOOL["page"]()


@pytest.mark.long
@pytest.mark.parametrize("name", ["printed_tables", "answer_element", "logger_file"])
def test_a_script_runs_and_leaves_its_picture(name, tmp_path, monkeypatch):
    script = ROOT / "docs" / "gallery" / f"{name}.py"
    monkeypatch.setattr(sys, "argv", [str(script), str(tmp_path)])
    runpy.run_path(str(script), run_name="__main__")
    assert [path.name for path in tmp_path.iterdir()] == [f"{name}.png"]
