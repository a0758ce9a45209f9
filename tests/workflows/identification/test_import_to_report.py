"""From a logger's files to a report, by three commands and one edited map."""

import pytest

from carrierflex.identification.campaign.campaign_files import write_campaign
from carrierflex.workflows.diagnosis.diagnose_campaign import main as diagnose_campaign
from tests.identification.logs.loggers import LOGGERS
from tests.identification.logs.test_loggers import clean_campaign, imported
from tests.workflows.checked_documents import checked_document

pytestmark = pytest.mark.long

#: Answered within seconds.
QUICK = "overloaded element"


def answer(folder, out):
    diagnose_campaign(folder, out=out, report=False, quiet=True)
    document = checked_document(out / "diagnosis.json")
    classes = [entry["id"] for entry in document.get("classes") or []]
    return document["verdict"], document["effects"], classes


def answers(name, tmp_path):
    """Answers to the clean campaign and to the files of a logger."""
    clean = clean_campaign(LOGGERS[name])
    write_campaign(clean, tmp_path / "clean")
    expected = answer(tmp_path / "clean", tmp_path / "a")
    return expected, answer(imported(name, clean, tmp_path), tmp_path / "b")


@pytest.mark.acceptance
@pytest.mark.parametrize("name", [name for name in LOGGERS if name != QUICK])
def test_the_answer_to_the_files_of_a_logger_is_that_to_the_clean_campaign(name, tmp_path):
    expected, result = answers(name, tmp_path)
    assert result == expected


def test_the_answer_to_one_logger_is_that_to_the_clean_campaign(tmp_path):
    expected, result = answers(QUICK, tmp_path)
    assert result == expected
    assert result[0] in ("named", "named_with_remainder")
