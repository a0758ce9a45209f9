"""A file that this program did not write is refused before any work, and stays."""

import pytest

from carrierflex.workflows.diagnosis import diagnose_campaign


@pytest.mark.parametrize(
    "name", ["diagnosis.json", "report.json", "report.html", "rim_motion.json", "view.html"]
)
def test_a_diagnosis_replaces_and_removes_no_file_of_others(name, tmp_path, monkeypatch):
    def work(*arguments, **options):
        raise AssertionError("work was begun")

    monkeypatch.setattr(diagnose_campaign, "read_campaign", work)
    (tmp_path / name).write_text("notes of a colleague", encoding="utf-8")
    with pytest.raises(FileExistsError, match=name):
        diagnose_campaign.main(tmp_path / "campaign", out=tmp_path, quiet=True)
    assert (tmp_path / name).read_text(encoding="utf-8") == "notes of a colleague"
