import json

import numpy as np
import pytest

from carrierflex.diagnosis.diagnose import diagnose
from carrierflex.diagnosis.element.problem import element_problem
from carrierflex.diagnosis.inference.results import VERDICTS
from carrierflex.diagnosis.report.diagnosis_files import (
    FORMAT,
    diagnosis_document,
    read_diagnosis,
    write_diagnosis,
)
from carrierflex.identification.campaign.campaign_files import write_campaign
from carrierflex.workflows.diagnosis import examination
from tests.diagnosis.element.element_campaigns import displacement_campaign


@pytest.fixture(scope="module")
def campaign():
    return displacement_campaign(lambda q, v: 5e8 * q**3, n=1500)


@pytest.fixture(scope="module")
def diagnosis(campaign):
    return diagnose(element_problem(campaign), campaign="twin", kind="element")


def test_file_holds_the_contract(tmp_path, diagnosis):
    write_diagnosis(tmp_path / "diagnosis.json", diagnosis)
    document = read_diagnosis(tmp_path / "diagnosis.json")
    assert document == json.loads(json.dumps(diagnosis_document(diagnosis)))
    assert document["verdict"] in VERDICTS
    assert document["effects"] == ["cubic_stiffness"]
    stiffness = document["parameters"]["cubic_stiffness"]["K3"]
    assert set(stiffness) == {"value", "sources", "std", "unit", "ci95"}
    half_width = 0.5 * (stiffness["ci95"][1] - stiffness["ci95"][0])
    assert np.isclose(half_width, 1.96 * stiffness["std"], rtol=1e-4)
    assert np.isclose(np.mean(stiffness["ci95"]), stiffness["value"])
    assert document["gains"] == "gain errors are not included"
    assert set(document["ranking"][0]) >= {"effects", "held_out_rms"}
    assert set(document["where"][0]) >= {
        "channel_pattern",
        "order",
        "run",
        "share",
        "share_ci95",
        "p_value",
    }
    contract = (
        "rms_before",
        "rms_after",
        "noise_floor",
        "rho",
        "rho_ci95",
        "phi",
        "phi_ci95",
    )
    assert set(document["how_far"]) >= set(contract)
    assert document["how_far"]["held_out"] is True
    assert [path.name for path in tmp_path.iterdir()] == ["diagnosis.json"]


def test_other_and_newer_files_are_refused(tmp_path):
    path = tmp_path / "diagnosis.json"
    with pytest.raises(ValueError, match=r"no such file; expected a diagnosis\.json"):
        read_diagnosis(path)
    for text, message in (
        ("{", r"not JSON .*expected a diagnosis\.json"),
        ("[]", "key 'format' is None"),
        (
            '{"format": "carrierflex-gap-map"}',
            "key 'format' is 'carrierflex-gap-map'; expected 'carrierflex-diagnosis'",
        ),
        (
            f'{{"format": "{FORMAT}", "version": 3}}',
            "key 'version' is 3, written by a newer version; expected 2",
        ),
        (f'{{"format": "{FORMAT}", "version": true}}', "key 'version' is true; expected 2"),
    ):
        path.write_text(text, encoding="utf-8")
        with pytest.raises(ValueError, match=message):
            read_diagnosis(path)


@pytest.mark.long
def test_the_command_writes_the_file_and_ends_with_zero(tmp_path, campaign, command):
    write_campaign(campaign, tmp_path / "campaign")
    done = command("diagnose", "campaign", "--out", "out")
    assert done.returncode == 0, done.stderr
    assert "cubic_stiffness" in done.stdout
    assert read_diagnosis(tmp_path / "out" / "diagnosis.json")["verdict"] == "named"
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        "diagnosis.json",
        "report.html",
        "report.json",
    }


def test_without_a_report_none_is_drawn_and_none_of_an_earlier_diagnosis_stays(
    tmp_path, campaign, diagnosis, command, monkeypatch
):
    monkeypatch.setattr(examination, "diagnose", lambda *args, **options: diagnosis)
    write_campaign(campaign, tmp_path / "campaign")
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "report.html").write_text("page of carrierflex, of an earlier diagnosis")
    assert command("diagnose", "campaign", "--out", "out", "--no-report").returncode == 0
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        "diagnosis.json",
        "report.json",
    }


def test_an_unknown_effect_in_the_baseline_gets_one_line(tmp_path, campaign, command):
    write_campaign(campaign, tmp_path / "campaign")
    document = tmp_path / "campaign" / "campaign.toml"
    document.write_text(
        document.read_text().replace("effects = []", 'effects = ["cubic_stifness"]')
    )
    done = command("diagnose", "campaign", "--out", "out")
    assert done.returncode == 2
    assert "unknown effect 'cubic_stifness'" in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    assert done.stdout == ""
    assert not (tmp_path / "out").exists()
