"""The study of statements counts what is diagnosed, and takes up what is there."""

import pytest

from studies import tabulate_statements


@pytest.mark.long
def test_nulls_whose_periods_repeat_agree_and_are_counted_once(tmp_path):
    options = {"out": tmp_path, "sort": "nothing", "seed": 8, "cases": 2, "quiet": True}
    result = tabulate_statements.main(**options)
    assert [one.verdict for one in result] == ["at_noise_floor"] * 2
    table = (tmp_path / "nothing.md").read_text(encoding="utf-8")
    assert "| all | all | 2 | 2 | 0 | 0 | 0 | 0 | 0 | 0 | at_noise_floor 2 |" in table
    times = {file: file.stat().st_mtime_ns for file in tmp_path.glob("*.json")}
    assert tabulate_statements.main(**options) == result
    assert times == {file: file.stat().st_mtime_ns for file in tmp_path.glob("*.json")}


def test_a_level_is_near_within_15_percent():
    levels = [
        tabulate_statements.Statement("coulomb", "noise", 9.0, "named", x, 10.0, x - 1.5, x + 1.5)
        for x in (8.4, 8.6, 11.6)
    ]
    assert [one.is_near for one in levels] == [False, True, False]
    assert [one.is_in_interval for one in levels] == [False, True, False]


def test_a_kind_without_cases_of_a_sort_is_refused(tmp_path):
    with pytest.raises(ValueError, match="--kind is carrier; expected element"):
        tabulate_statements.main(out=tmp_path, sort="friction", kind="carrier")
