"""One browser for the pages of a file: to start one takes as long as to look at four pages."""

import pytest

from tests.diagnosis.report.browser import browser


@pytest.fixture(scope="module")
def window(tmp_path_factory):
    with browser(tmp_path_factory.mktemp("profile")) as opened:
        yield opened
