"""Diagnosis of one sealed case, as ``carrierflex diagnose`` makes it.

All it is given is the folder of the campaign.

Nothing of the truth is imported here: a process that runs it has never held a label.
"""

import time
from pathlib import Path

from carrierflex.blind_check.sealing.verdicts import TIMES_FILE
from carrierflex.files.json_files import save_json
from carrierflex.workflows.diagnosis.diagnose_campaign import main as diagnose_campaign


def diagnose_case(campaign: Path, out: Path, *, report: bool = True) -> None:
    """Diagnose a campaign and write diagnosis.json, report.html and the time it took.

    An input that is refused or a numerical failure is an answer too, and a wrong one: it is kept as
    such and ends no check.

    Parameters
    ----------
    campaign, out : Path
        Folder of the campaign, folder for the files.
    report : bool
        Draw report.html too.
    """
    start = time.perf_counter()
    error = None
    try:
        diagnose_campaign(campaign, out=out, report=report, quiet=True)
    except (ValueError, ArithmeticError, RuntimeError, KeyError) as raised:
        error = f"{type(raised).__name__}: {raised}"
    out.mkdir(parents=True, exist_ok=True)
    save_json(out / TIMES_FILE, {"seconds": time.perf_counter() - start, "error": error})
