"""The study of intervals counts cases with true parameters, and takes up what stands."""

import pytest

from studies import tabulate_intervals


@pytest.mark.long
def test_intervals_of_cases_without_an_effect_are_counted_once(tmp_path):
    result = tabulate_intervals.main(out=tmp_path, seed=8, cases=12, without_effect=2, quiet=True)
    assert len(result) >= 2
    for case in result:
        known = {hit.name for hit in case.hits}
        # Each parameter has an interval or is said not to be determined.
        assert not known & set(case.unknown)
    table = (tmp_path / "intervals.md").read_text(encoding="utf-8")
    assert "| m and K1 |" in table
    times = {file: file.stat().st_mtime_ns for file in tmp_path.glob("*.json")}
    again = tabulate_intervals.main(out=tmp_path, seed=8, cases=12, without_effect=2, quiet=True)
    assert again == result
    assert times == {file: file.stat().st_mtime_ns for file in tmp_path.glob("*.json")}
    next(iter(times)).write_text("{}", encoding="utf-8")
    with pytest.raises(ValueError, match="not intervals of a case; remove it to make it again"):
        tabulate_intervals.main(out=tmp_path, seed=8, cases=12, without_effect=2, quiet=True)
