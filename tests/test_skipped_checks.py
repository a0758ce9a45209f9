"""With CI=true a skipped test fails and says why; one that is expected to fail does not."""

import pytest

from tests.conftest import fail_skipped


def report(outcome, **more):
    place = ("tests/test_page.py", 7, "Skipped: chromium is not installed")
    return pytest.TestReport(
        "tests/test_page.py::test_page", ("", 7, ""), {}, outcome, place, "call", **more
    )


def test_a_skipped_test_fails_with_its_reason():
    result = report("skipped")
    fail_skipped(result)
    assert result.failed
    assert "chromium is not installed" in str(result.longrepr)


@pytest.mark.parametrize("kept", [report("passed"), report("skipped", wasxfail="known")])
def test_other_outcomes_stay(kept):
    before = kept.outcome
    fail_skipped(kept)
    assert kept.outcome == before
