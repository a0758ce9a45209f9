"""The study of carriers and mountings counts cases with the library's laws, and takes up others."""

import pytest

from studies import tabulate_law_intervals


@pytest.mark.long
def test_intervals_of_a_carrier_are_counted_once(tmp_path):
    options = {"out": tmp_path, "seed": 8, "cases": 4, "without_effect": 1, "quiet": True}
    result = tabulate_law_intervals.main(**options)
    assert result
    names = {hit.name for case in result for hit in case.hits}
    assert {"carrier_tilt.phi_PLC", "carrier_tilt.theta_PLC"} <= names
    # In units of the curve of another carrier: no true value.
    assert "flexible_pins.rho_f" not in names
    table = (tmp_path / "intervals.md").read_text(encoding="utf-8")
    assert "| baseline |" in table
    assert "| baseline, directions |" in table
    times = {file: file.stat().st_mtime_ns for file in tmp_path.glob("*.json")}
    again = tabulate_law_intervals.main(**options)
    assert [case.hits for case in again] == [case.hits for case in result]
    assert times == {file: file.stat().st_mtime_ns for file in tmp_path.glob("*.json")}
