"""What a diagnosis was found with is let go before it is written."""

import weakref

import pytest

from carrierflex.diagnosis.report import page
from carrierflex.identification.campaign.campaign_files import write_campaign
from carrierflex.workflows.diagnosis import diagnose_campaign, examination
from tests.diagnosis.element.element_campaigns import displacement_campaign

pytestmark = pytest.mark.long


def test_the_problem_and_its_sums_are_gone_when_the_page_is_drawn(tmp_path, monkeypatch):
    write_campaign(displacement_campaign(lambda q, v: 5e8 * q**3, n=1500), tmp_path / "campaign")
    examined, report_page = examination.examined, page.report_page
    problems, alive = [], []

    def remembered(*given):
        result = examined(*given)
        problems.append(weakref.ref(result.problem))
        return result

    def drawn(*given):
        alive.extend(problem() is not None for problem in problems)
        return report_page(*given)

    monkeypatch.setattr(examination, "examined", remembered)
    monkeypatch.setattr(page, "report_page", drawn)
    diagnose_campaign.main(tmp_path / "campaign", out=tmp_path / "out", quiet=True)
    assert alive == [False]
