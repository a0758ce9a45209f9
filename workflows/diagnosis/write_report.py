"""Write the report page of a diagnosis anew.

The page of ``carrierflex diagnose``, drawn by this version of the program from what that command
left in its folder; nothing is fitted again. A good answer: a page with the numbers of
diagnosis.json.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from carrierflex.files.json_files import save_text
from carrierflex.files.whole_files import check_file_writable, refuse_foreign


@dataclass(frozen=True, eq=False)
class WrittenReport:
    """A report page that was written."""

    path: Annotated[Path, "The page"]
    campaign: Annotated[str, "Name of the campaign"]
    headline: Annotated[str, "What the diagnosis says first"]


def main(diagnosis: Path, *, out: Path) -> WrittenReport:
    """Write the report page of a diagnosis again, without a new fit.

    Parameters
    ----------
    diagnosis : Path
        diagnosis.json that diagnose wrote, or its folder; report.json beside it holds the curves
        of the pictures.
    out : Path
        File to write: the page as HTML, which needs no network to be read.

    Returns
    -------
    WrittenReport
        Page, campaign and headline.

    Raises
    ------
    ValueError
        Where a file is missing, damaged, of a newer version, or of another diagnosis.
    OSError
        Where `out` cannot be written.
    """
    from carrierflex.diagnosis.report.diagnosis_files import DIAGNOSIS_FILE, read_diagnosis
    from carrierflex.diagnosis.report.page import report_page
    from carrierflex.diagnosis.report.verdict_words import verdict_heading
    from carrierflex.workflows.diagnosis.report_files import REPORT_DATA_FILE, read_report_data

    check_file_writable(out)
    refuse_foreign(out, "<title>Diagnosis: ", "carrierflex")
    path = diagnosis / DIAGNOSIS_FILE if diagnosis.is_dir() else diagnosis
    document = read_diagnosis(path)
    data_file = path.with_name(REPORT_DATA_FILE)
    data = read_report_data(data_file)
    stated = [document.get(key) for key in ("campaign", "verdict", "reason")]
    if stated != [data.diagnosis.campaign, data.diagnosis.verdict, data.diagnosis.reason]:
        raise ValueError(
            f"{data_file}: is of campaign '{data.diagnosis.campaign}', {data.diagnosis.verdict}, "
            f"and {path.name} of '{document.get('campaign')}', {document.get('verdict')}; "
            "expected the two files of one diagnosis: diagnose the campaign again"
        )
    save_text(out, report_page(data))
    return WrittenReport(out, data.diagnosis.campaign, verdict_heading(data.diagnosis))
