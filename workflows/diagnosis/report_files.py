"""report.json: what the report page is drawn from, beside what diagnosis.json says.

The page of ``carrierflex report`` is that of ``carrierflex diagnose``: both are drawn from this.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

from carrierflex.diagnosis.report.report_data import ReportData
from carrierflex.files.json_files import plain, read_document, save_plain_json
from carrierflex.files.result_reading import restored
from carrierflex.files.result_schemas import json_content, json_table

REPORT_DATA_FILE = "report.json"
FORMAT, VERSION = "carrierflex-report", 1

#: report.json.
REPORT_DATA = json_table(
    "ReportDocument",
    "report.json, written by diagnose and read by report: what the page is drawn from.",
    {},
    format=(Literal["carrierflex-report"], "Kind of the file"),
    version=(Literal[1], "Version of the format"),
    software=(str, "Name and version of this software"),
    data=(Mapping[str, Any], "Answer, outline of the campaign, curves of the pictures"),
)


def write_report_data(path: Path, data: ReportData) -> None:
    """Write report.json; its folder exists."""
    content = json_content(REPORT_DATA, software=data.software, data=data)
    save_plain_json(path, plain(content), indent=None)


def read_report_data(path: Path) -> ReportData:
    """Read report.json.

    Raises
    ------
    ValueError
        Where it is missing, no such file, of a newer version, or holds something else.
    """
    document = read_document(path, f"a {REPORT_DATA_FILE}", FORMAT, VERSION)
    try:
        data: ReportData = restored(ReportData, document["data"])
    except (KeyError, TypeError, ValueError, AttributeError, IndexError) as error:
        reason = f"no key {error}" if isinstance(error, KeyError) else " ".join(str(error).split())
        raise ValueError(
            f"{path}: {reason}; expected a file that diagnose wrote: diagnose the campaign again"
        ) from error
    return data
