"""With CI=true a skipped test fails and says why; one that is expected to fail does not."""

import pytest

from tests.conftest import fail_skipped


def report(outcome, **more):
    longrepr = ("tests/test_page.py", 7, "Skipped: chromium is not installed")
    return pytest.TestReport(
        "tests/test_page.py::test_page", ("", 7, ""), {}, outcome, longrepr, "call", **more
    )


def test_a_skipped_test_fails_with_its_reason():
    result = report("skipped")
    fail_skipped(result)
    assert result.failed
    assert "chromium is not installed" in str(result.longrepr)


@pytest.mark.parametrize("outcome", [report("passed"), report("skipped", wasxfail="known")])
def test_other_outcomes_stay(outcome):
    before = outcome.outcome
    fail_skipped(outcome)
    assert outcome.outcome == before
