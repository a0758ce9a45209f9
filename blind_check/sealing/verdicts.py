"""Diagnosis of one sealed case, as ``carrierflex diagnose`` makes it.

All it is given is the folder of the campaign.

Nothing of the truth is imported here: a process that runs it has never held a label.
"""

import json
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from carrierflex.diagnosis.diagnosis_files import read_diagnosis
from carrierflex.workflows.diagnosis.diagnose_campaign import DIAGNOSIS_FILE
from carrierflex.workflows.diagnosis.diagnose_campaign import main as diagnose_campaign
from carrierflex.workflows.support.outputs import save_json

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


def diagnose_case(campaign: Path, out: Path) -> None:
    """Diagnose a campaign and write diagnosis.json, report.html and the time it took.

    An input that is refused or a numerical failure is an answer too, and a wrong one: it is kept as
    such and ends no check.

    Parameters
    ----------
    campaign, out : Path
        Folder of the campaign, folder for the files.
    """
    start = time.perf_counter()
    error = None
    try:
        diagnose_campaign(campaign, out=out, quiet=True)
    except (ValueError, ArithmeticError, RuntimeError, KeyError) as raised:
        error = f"{type(raised).__name__}: {raised}"
    out.mkdir(parents=True, exist_ok=True)
    save_json(out / TIMES_FILE, {"seconds": time.perf_counter() - start, "error": error})


def is_finished(out: Path) -> bool:
    """Whether a case's folder holds a finished diagnosis."""
    return (out / TIMES_FILE).is_file()


def read_verdict(out: Path) -> Verdict:
    """Read what :func:`diagnose_case` wrote.

    Raises
    ------
    ValueError
        Where a file is missing or no diagnosis.
    """
    try:
        times = json.loads((out / TIMES_FILE).read_text(encoding="utf-8"))
        seconds, error = float(times["seconds"]), times["error"]
    except (OSError, json.JSONDecodeError, KeyError, TypeError) as raised:
        raise ValueError(f"{out / TIMES_FILE}: no times of a diagnosis: {raised}") from raised
    if error is not None:
        return Verdict({"verdict": ERROR, "reason": error}, seconds)
    return Verdict(read_diagnosis(out / DIAGNOSIS_FILE), seconds)
