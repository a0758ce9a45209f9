"""From a campaign to the page that its report links to."""

import sys

import pytest

from carrierflex.identification.campaign.campaign_files import write_campaign
from carrierflex.workflows.view3d.rim_motion_files import read_rim_motion
from tests.diagnosis.carrier.carrier_twin import LOADS, twin_campaign
from tests.workflows.checked_documents import checked_document

#: Few candidates, to be quick.
FEW = ("--effects", "torque_tilt", "--effects", "face_runout")


@pytest.fixture
def campaign(tmp_path):
    write_campaign(twin_campaign("torque_tilt", loads=LOADS[:3]), tmp_path / "campaign")


@pytest.mark.long
def test_a_diagnosis_writes_the_rim_and_the_page_that_its_report_links_to(
    campaign, command, tmp_path
):
    pytest.importorskip("k3d")
    ended = command("diagnose", "campaign", *FEW, "--out", "out", "--view")
    assert ended.returncode == 0, ended.stderr
    out = tmp_path / "out"
    names = {"diagnosis.json", "report.html", "report.json", "rim_motion.json", "view.html"}
    assert {path.name for path in out.iterdir()} == names
    assert 'href="view.html"' in (out / "report.html").read_text(encoding="utf-8")
    checked_document(out / "rim_motion.json")
    motion = read_rim_motion(out / "rim_motion.json")
    assert motion.effects == ("torque_tilt",)
    assert {signal.run for signal in motion.signals} == {"run1", "run2", "run3"}
    ended = command("view", "out", "--html", "--out", "again.html")
    assert ended.returncode == 0, ended.stderr
    assert f"{motion.signals[0].run}, {motion.signals[0].channel}: with effects" in ended.stdout
    # Without a page nothing of an earlier gap stays but what a page is drawn from.
    ended = command("diagnose", "campaign", *FEW, "--out", "out", "--no-report")
    assert ended.returncode == 0, ended.stderr
    assert {path.name for path in out.iterdir()} == {"diagnosis.json", "report.json"}


def test_a_page_that_cannot_be_written_is_refused_before_the_work(campaign, command, monkeypatch):
    ended = command("diagnose", "campaign", "--out", "out", "--view", "--no-report")
    assert ended.returncode == 2
    assert "--view belongs to the report; expected it without --no-report" in ended.stderr
    monkeypatch.setitem(sys.modules, "k3d", None)
    ended = command("diagnose", "campaign", "--out", "out", "--view")
    assert ended.returncode == 2
    assert 'pip install "carrierflex[view]"' in ended.stderr
    assert "reading" not in ended.stderr
