"""``import carrierflex as cf``: what the commands give, in memory."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
from numpy.testing import assert_allclose

import carrierflex as cf
from carrierflex.identification.campaign.campaign_files import read_campaign
from carrierflex.reduction.body_files import read_body
from carrierflex.workflows.diagnosis import diagnose_campaign
from tests.identification.synthetic_campaigns import carrier_campaign

PAGE = Path(__file__).parents[3] / "docs" / "python.md"
COARSE = 0.08


@pytest.fixture
def empty_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    yield tmp_path
    assert not list(tmp_path.iterdir())


def test_names_are_those_of_the_page_and_come_late():
    text = PAGE.read_text(encoding="utf-8")
    functions = [name for name in cf.__all__ if name[0].islower()]
    assert all(f"`{name}(" in text for name in functions)
    assert {*re.findall(r"cf\.(\w+)", text)} <= {*cf.__all__}
    assert {*cf.__all__} <= {*dir(cf)}
    script = "import sys, carrierflex; print('numpy' in sys.modules)"
    loaded = subprocess.run([sys.executable, "-P", "-c", script], capture_output=True, text=True)
    assert loaded.stdout == "False\n"
    with pytest.raises(AttributeError, match="has no attribute 'curve'"):
        cf.curve  # noqa: B018


@pytest.mark.long
def test_curves_have_their_peaks_and_leave_nothing(empty_folder):
    curves = cf.deflection_curves(size=COARSE)
    assert "delta_s: 6 peaks" in repr(curves)
    assert "delta_f: 3 peaks" in repr(curves)
    table = curves.to_dataframe()
    assert_allclose(table["delta_f"], curves["delta_f"].axial)
    assert list(table) == ["delta_s", "delta_f", "g_s", "g_f"]
    assert "<svg" in curves._repr_html_()


def test_a_body_is_certified_and_written_where_asked(tmp_path):
    body = cf.reduced_body("pin", size=0.05, modes=6)
    assert body.certificate.met
    assert "certificate: met" in repr(body)
    assert body.to_dataframe()["name"].tolist() == [check.name for check in body.certificate.checks]
    again = read_body(body.write(tmp_path / "pin.h5"))
    assert_allclose(again.K, body.model.K, rtol=0.0, atol=0.0)
    with pytest.raises(ValueError, match="up_to is 500 and modes is 6; expected one of them"):
        cf.reduced_body("pin", up_to=500.0, modes=6)


def test_what_is_written_is_read_again(tmp_path):
    records = cf.simulated_campaign("carrier_lc1_to_lc4")
    again = cf.measured_campaign(records.write(tmp_path / "campaign"))
    assert_allclose(again.to_dataframe("LC3"), records.to_dataframe("LC3"), rtol=1e-14)
    assert_allclose(again.curves["delta_f"].axial, records.curves["delta_f"].axial, rtol=1e-14)


def test_a_simulated_campaign_stays_in_memory(empty_folder):
    records = cf.simulated_campaign("carrier_lc1_to_lc4")
    assert [run.name for run in records.campaign.runs] == ["LC1", "LC2", "LC3", "LC4"]
    table = records.to_dataframe("LC2")
    assert_allclose(table["torque"], records.campaign.runs[1].inputs["torque"])
    assert table.index.name == "time"
    assert len(records.plot("LC2").axes[0].lines) == len(records.campaign.channels)
    with pytest.raises(ValueError, match="run 'LC9' is not in the campaign"):
        records.to_dataframe("LC9")
    with pytest.raises(ValueError, match="case 'lc9' does not come with the package"):
        cf.simulated_campaign("lc9")


@pytest.mark.acceptance
def test_the_lines_of_the_page_run(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (block,) = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    exec(compile(block, str(PAGE), "exec"), {})
    assert (tmp_path / "report.html").is_file()
    assert "6 peaks" in capsys.readouterr().out


@pytest.mark.acceptance
def test_a_diagnosis_is_that_of_the_command(tmp_path):
    records = cf.Records(carrier_campaign(), None)
    folder = records.write(tmp_path / "campaign")
    answer = cf.diagnosed(folder)
    by_command = diagnose_campaign.main(folder, out=tmp_path / "out", report=False, quiet=True)
    assert answer.verdict == by_command.verdict
    assert answer.effects == by_command.attribution.effects
    assert answer.result.reduction.rho == by_command.reduction.rho
    assert repr(answer).startswith(f"Diagnosed({by_command.verdict}: ")
    values = answer.to_dataframe()
    assert set(values["effect"]) == set(by_command.attribution.parameters)
    assert answer.verdict in answer._repr_html_()
    assert "</html>" in answer.write_report(tmp_path / "r.html").read_text(encoding="utf-8")
    assert read_campaign(folder).name == answer.result.campaign
