"""The page anew from the files of a diagnosis: the same page, and files that do not belong."""

import json

import pytest

from carrierflex.diagnosis.diagnose import diagnose
from carrierflex.diagnosis.element.problem import element_problem
from carrierflex.diagnosis.report.diagnosis_files import write_diagnosis
from carrierflex.diagnosis.report.page import report_page
from carrierflex.workflows.diagnosis import write_report
from carrierflex.workflows.diagnosis.report_files import read_report_data, write_report_data
from tests.diagnosis.element.element_campaigns import displacement_campaign
from tests.diagnosis.report.verdict_pages import data_of, with_verdict


@pytest.fixture(scope="module")
def measured():
    campaign = displacement_campaign(lambda q, v: 5e8 * q**3, n=1500)
    return diagnose(element_problem(campaign), campaign="twin", kind="element"), campaign


@pytest.fixture
def folder(measured, tmp_path):
    write_diagnosis(tmp_path / "diagnosis.json", measured[0])
    write_report_data(tmp_path / "report.json", data_of(*measured))
    return tmp_path


@pytest.mark.long
@pytest.mark.parametrize("verdict", ["named", "class_named", "aliased", "not_diagnosable"])
def test_the_page_anew_is_the_page_of_the_diagnosis(verdict, measured, tmp_path):
    diagnosis, campaign = measured
    data = data_of(with_verdict(diagnosis, verdict), campaign)
    write_report_data(tmp_path / "report.json", data)
    assert report_page(read_report_data(tmp_path / "report.json")) == report_page(data)


@pytest.mark.long
def test_the_command_takes_the_file_or_its_folder(folder):
    for source in (folder, folder / "diagnosis.json"):
        written = write_report.main(source, out=folder / "page.html")
        page = written.path.read_text(encoding="utf-8")
        assert f"<h1>{written.headline.split('. ')[0]}.</h1>" in page


def test_a_page_of_two_diagnoses_is_refused(folder, measured):
    write_diagnosis(folder / "diagnosis.json", with_verdict(measured[0], "none_of_these"))
    with pytest.raises(ValueError, match="the two files of one diagnosis: diagnose the campaign"):
        write_report.main(folder, out=folder / "page.html")
    assert not (folder / "page.html").exists()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda data: data.pop("campaign"), "no key 'campaign'"),
        (lambda data: data["campaign"].update(runs=3), "not iterable"),
        (
            lambda data: data["campaign"]["runs"][0].update(samples="many"),
            "expected a whole number",
        ),
    ],
)
def test_a_damaged_file_is_refused_by_name(folder, change, message):
    path = folder / "report.json"
    document = json.loads(path.read_text(encoding="utf-8"))
    change(document["data"])
    path.write_text(json.dumps(document), encoding="utf-8")
    with pytest.raises(
        ValueError, match=rf"report\.json: .*{message}.*diagnose the campaign again"
    ):
        write_report.main(folder, out=folder / "page.html")


def test_a_file_of_others_is_not_replaced(folder):
    page = folder / "page.html"
    page.write_text("<!DOCTYPE html><title>Mine</title>", encoding="utf-8")
    with pytest.raises(FileExistsError, match="is not replaced"):
        write_report.main(folder, out=page)
