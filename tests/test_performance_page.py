"""The tables of docs/performance.md follow from docs/performance.json."""

import json

import pytest

from benchmarks.page import PAGE, RECORD, main, page_text, with_results
from benchmarks.ratio import TIME, Absent, Failed, Ratio, at_least
from benchmarks.report import Report


def results(name, *rows, quick=False):
    """Content of a file of one benchmark."""
    report = Report(quick)
    for row in rows:
        report.add(name, row)
    report.end(name, 1.0)
    return json.loads(json.dumps(report.content()))


def test_the_page_is_what_its_record_says():
    page = PAGE.read_text(encoding="utf-8")
    assert page_text(page, json.loads(RECORD.read_text(encoding="utf-8"))) == page


def test_a_run_takes_the_place_of_its_own_benchmarks_alone():
    old = with_results({}, results("many_runs", Ratio("old", TIME, 1.0)))
    record = with_results(old, results("stage_speed", Ratio("a stage", TIME, 2.0)))
    assert list(record) == ["stage_speed", "many_runs"]
    record = with_results(record, results("many_runs", Ratio("new", TIME, 3.0)))
    assert [row["case"] for row in record["many_runs"]["rows"]] == ["new"]


def test_a_line_holds_what_is_required_beside_what_was_measured():
    rows = [
        Ratio("a | body", TIME, 2.0, "a peer", 6.0, at_least(4), "of three"),
        Absent("CalculiX", "no command ccx"),
        Failed("ValueError: broken"),
    ]
    page = page_text(
        PAGE.read_text(encoding="utf-8"), with_results({}, results("many_runs", *rows))
    )
    assert "| a / body (of three) | wall time | 2 s | a peer: 6 s | 3 | at least 4 | no |" in page
    assert "| CalculiX | absent | no command ccx |" in page
    assert "ValueError: broken" in page


def test_a_quick_run_is_refused(tmp_path, capsys):
    quick = results("many_runs", Ratio("", TIME, 1.0), quick=True)
    with pytest.raises(ValueError, match="quick"):
        with_results({}, quick)
    file = tmp_path / "bench.json"
    file.write_text(json.dumps(quick))
    before = PAGE.read_bytes(), RECORD.read_bytes()
    assert main([str(file)]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert (PAGE.read_bytes(), RECORD.read_bytes()) == before
