"""diagnose --confusion writes the diagnosis first, then the draws, for every reader of it."""

import pytest

from carrierflex.diagnosis.inference.confusion.results import Answer
from carrierflex.identification.campaign.campaign_files import write_campaign
from carrierflex.workflows.diagnosis import diagnose_campaign
from carrierflex.workflows.support import examination
from tests.diagnosis.element.element_campaigns import displacement_campaign
from tests.workflows.checked_documents import checked_document

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("campaign")
    write_campaign(displacement_campaign(lambda q, v: 5e8 * q**3, n=1500), place)
    return place


def test_draws_are_in_the_file_the_page_and_the_table(folder, tmp_path, monkeypatch):
    answer = Answer("named", ("cubic_stiffness",))
    monkeypatch.setattr(examination, "_answer", lambda campaign, **given: answer)
    found = diagnose_campaign.main(folder, out=tmp_path, confusion=True, quiet=True)
    document = checked_document(tmp_path / "diagnosis.json")
    assert document["confusion"]["diagnoses"] == 12
    assert found.confusion.n_diagnoses == 12
    assert sum(document["confusion"]["rows"][0]["counts"]) == 4
    assert document["evidence"]["candidates"][0] == {
        "effects": [],
        "log_evidence": 0.0,
        "share": pytest.approx(0.0, abs=1e-6),
    }
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert 'id="confusion-table"' in page
    # Every candidate gave the same answer: the answer tells nothing.
    assert "about as often as cubic stiffness (4 and 4 of 4)" in page


def test_an_interrupted_command_leaves_the_diagnosis(folder, tmp_path, monkeypatch):
    def interrupted(campaign, **given):
        raise KeyboardInterrupt

    monkeypatch.setattr(examination, "_answer", interrupted)
    with pytest.raises(KeyboardInterrupt):
        diagnose_campaign.main(folder, out=tmp_path, confusion=True, quiet=True)
    document = checked_document(tmp_path / "diagnosis.json")
    assert document["verdict"].startswith("named")
    assert document["confusion"] is None
    assert 'id="confusion-table"' not in (tmp_path / "report.html").read_text(encoding="utf-8")
