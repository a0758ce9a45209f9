"""What a diagnosis said of one sealed case, read from its folder."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from carrierflex.diagnosis.report.diagnosis_files import DIAGNOSIS_FILE, read_diagnosis
from carrierflex.files.json_files import read_json
from carrierflex.files.shown_values import shortened

#: Written last: a folder that holds it is finished.
TIMES_FILE = "times.json"
#: Verdict of a case whose diagnosis raised an error.
ERROR = "error"


@dataclass(frozen=True)
class Verdict:
    """What a diagnosis said of a case.

    Parameters
    ----------
    document : mapping of str to object
        Content of diagnosis.json; with an error only ``verdict`` and ``reason``.
    seconds : float
        Time from the folder to the files [s].
    """

    document: Mapping[str, Any]
    seconds: float


def is_finished(out: Path) -> bool:
    """Whether a case's folder holds a finished diagnosis."""
    return (out / TIMES_FILE).is_file()


def read_verdict(out: Path) -> Verdict:
    """Read what the diagnosis of a case wrote.

    Raises
    ------
    ValueError
        Where a file is missing or no diagnosis.
    """
    times = read_json(out / TIMES_FILE, "the times of a diagnosis")
    try:
        seconds, error = float(times["seconds"]), times["error"]
    except (KeyError, TypeError, ValueError, OverflowError) as raised:
        raise ValueError(
            f"{out / TIMES_FILE}: no times of a diagnosis: {shortened(str(raised))}"
        ) from raised
    if error is not None:
        return Verdict({"verdict": ERROR, "reason": error}, seconds)
    return Verdict(read_diagnosis(out / DIAGNOSIS_FILE), seconds)
