"""Every test that the record of the findings names exists."""

import re
from pathlib import Path

RECORD = Path("validation/records/findings.md")


def test_every_test_of_the_record_exists():
    root = Path(__file__).parents[2]
    named = re.findall(r"`([\w/]+\.py)::(test_\w+)`", (root / RECORD).read_text(encoding="utf-8"))
    assert len(named) > 80
    for file, test in named:
        assert f"def {test}(" in (root / "tests" / file).read_text(encoding="utf-8"), test
