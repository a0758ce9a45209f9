"""The page "Which tool, which command" holds every format that is read or written."""

import importlib.util
import inspect
import sys
import types
from pathlib import Path
from typing import get_args

import pytest

from carrierflex.identification.logs.log_files import _READERS
from carrierflex.identification.logs.log_formats import LOG_FORMATS, NOT_READ
from carrierflex.reduction.exports import export_formats
from carrierflex.reduction.exports.export_formats import EXPORT_FORMATS
from carrierflex.reduction.imports import foreign_bodies
from carrierflex.workflows.reduction import export_body

ROOT = Path(__file__).parents[2]


@pytest.fixture
def page(monkeypatch):
    """The page, by the hook of the site without mkdocs."""
    for name in ("mkdocs", "mkdocs.structure", "mkdocs.structure.files"):
        module = types.ModuleType(name)
        module.File = module.Files = object
        monkeypatch.setitem(sys.modules, name, module)
    spec = importlib.util.spec_from_file_location("site_pages", ROOT / "tools" / "site_pages.py")
    site_pages = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(site_pages)
    return site_pages.tools_page()


def test_every_format_that_is_read_or_written_is_on_the_page(page):
    for log_format in LOG_FORMATS:
        assert all(f"`{suffix}`" in page for suffix in log_format.suffixes)
        assert not log_format.extra or f"carrierflex[{log_format.extra}]" in page
    assert all(f"| {what} | {why} | {do} |" in page for what, why, do in NOT_READ)
    assert all(f"| {export.tools} | `{export.name}` |" in page for export in EXPORT_FORMATS)
    for export in EXPORT_FORMATS:
        suffixes = ", ".join(f"`{suffix}`" for suffix in export.reads)
        assert not export.reads or f"| {suffixes} | {export.taken} | {export.tried} |" in page
    assert all(f"| {why} | {do} |" in page for _, _, why, do in export_formats.NOT_READ)
    rows = [line for line in page.splitlines() if line.startswith("| ")]
    lists = (LOG_FORMATS, NOT_READ, EXPORT_FORMATS, export_formats.NOT_READ)
    assert len(rows) == sum(map(len, lists)) + 1 + 4


def test_the_lists_are_what_the_commands_know():
    formats = inspect.signature(export_body.main, eval_str=True).parameters["format"].annotation
    assert [export.name for export in EXPORT_FORMATS] == list(get_args(formats))
    assert set(foreign_bodies._READERS) == {
        export.name for export in EXPORT_FORMATS if export.reads
    }
    suffixes = [suffix for export in EXPORT_FORMATS for suffix in export.reads]
    refused = [suffix for listed, *_ in export_formats.NOT_READ for suffix in listed]
    assert len({*suffixes, *refused}) == len(suffixes) + len(refused)
    assert {".parquet", *_READERS} == {s for log_format in LOG_FORMATS for s in log_format.suffixes}
