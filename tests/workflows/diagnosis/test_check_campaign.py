"""``carrierflex check`` tells its findings, and its exit code says whether there are any."""

import sys

import pytest

from carrierflex.identification.campaign.campaign_files import write_campaign
from carrierflex.workflows import command_line
from carrierflex.workflows.diagnosis.examination import examined
from tests.diagnosis.element.element_campaigns import force_campaign
from tests.identification.campaign_check.faulty_campaigns import changed, faultless


def exit_code(monkeypatch, *arguments):
    monkeypatch.setattr(sys, "argv", ["carrierflex", *map(str, arguments)])
    try:
        command_line.main()
    except SystemExit as end:
        return end.code or 0
    return 0


@pytest.mark.parametrize(("factor", "code"), [(1.0, 0), (1e6, 1)])
def test_the_exit_code_tells_findings(monkeypatch, capsys, tmp_path, factor, code):
    campaign = changed(faultless("element"), "q", lambda q: factor * q)
    write_campaign(campaign, tmp_path / "campaign")
    assert exit_code(monkeypatch, "check", tmp_path / "campaign") == code
    shown = capsys.readouterr().out
    assert ("um over 1e6" in " ".join(shown.split())) == bool(code)


@pytest.mark.long
def test_a_spring_that_hardens_is_no_run_at_odds(monkeypatch, capsys, tmp_path):
    """Two of three runs are nearly linear; the third alone shows the cube."""
    campaign = force_campaign(lambda q, v: 3e9 * q**3, amplitudes=(0.2, 0.4, 4.0))
    write_campaign(campaign, tmp_path / "campaign")
    baseline = examined(campaign).baseline().warnings
    assert ("wiring/run", "R2") in [(one.id, one.about) for one in baseline]
    assert exit_code(monkeypatch, "check", tmp_path / "campaign") == 0
    assert "at odds" not in capsys.readouterr().out


def test_a_folder_that_is_no_campaign_is_refused(monkeypatch, capsys, tmp_path):
    assert exit_code(monkeypatch, "check", tmp_path) == 2
    assert "campaign.toml" in capsys.readouterr().err
