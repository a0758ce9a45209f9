"""Code blocks of the pages: Python runs, TOML and JSON are what they say. Shell: test_readme."""

import json
import pydoc
import re
import tomllib
from pathlib import Path

import pytest

pytestmark = pytest.mark.docs

ROOT = Path(__file__).parents[2]


def blocks(language):
    """Blocks of a language in all pages but tutorials."""
    for path in sorted((ROOT / "docs").rglob("*.md")):
        if path.parent.name == "tutorials":
            continue
        text = path.read_text(encoding="utf-8")
        result = re.findall(rf"```{language}\n(.*?)```", text, flags=re.DOTALL)
        for number, block in enumerate(result):
            yield pytest.param(block, id=f"{path.stem} {number}")


#: The whole chain takes its time.
CHAIN = "cf.diagnosed("


@pytest.mark.parametrize(
    "block", [block for block in blocks("python") if CHAIN not in block.values[0]]
)
def test_python_runs(block, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    exec(compile(block, "page", "exec"), {"__name__": "page"})


@pytest.mark.long
@pytest.mark.parametrize("block", [block for block in blocks("python") if CHAIN in block.values[0]])
def test_the_chain_runs(block, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    exec(compile(block, "page", "exec"), {"__name__": "page"})
    assert (tmp_path / "report.html").is_file()


@pytest.mark.parametrize("page", sorted((ROOT / "docs").glob("*.md")), ids=lambda page: page.stem)
def test_every_python_name_of_a_page_exists(page):
    names = re.findall(r"`(carrierflex(?:\.\w+)+)`", page.read_text(encoding="utf-8"))
    groups = {"carrierflex.effects"}  # of entry points
    assert not [name for name in names if name not in groups and pydoc.locate(name) is None]


@pytest.mark.parametrize("block", blocks("toml"))
def test_toml_is_toml(block):
    assert tomllib.loads(block)


@pytest.mark.parametrize("block", blocks("json"))
def test_json_is_json(block):
    assert json.loads(block)["format"].startswith("carrierflex-")
