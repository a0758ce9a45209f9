"""Writing of report.html; the file appears complete or not at all."""

from pathlib import Path

from carrierflex.diagnosis.report.page import ReportSource, report_page
from carrierflex.diagnosis.results import Diagnosis
from carrierflex.files.whole_files import whole_file


def write_report(path: Path, diagnosis: Diagnosis, source: ReportSource) -> None:
    """Write report.html.

    Parameters
    ----------
    path : Path
        File to write; its folder exists.
    diagnosis : Diagnosis
        What was found.
    source : ReportSource
        Inputs and versions.
    """
    text = report_page(diagnosis, source)
    with whole_file(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
