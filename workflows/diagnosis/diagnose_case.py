"""Diagnosis of one sealed case, as ``carrierflex diagnose`` makes it.

All it is given is the folder of the campaign.

Nothing of the truth is imported here: a process that runs it has never held a label.
"""

import time
from pathlib import Path

from carrierflex.blind_check.references.linear_laws import REFERENCES
from carrierflex.blind_check.sealing.verdicts import ERROR, TIMES_FILE, Verdict
from carrierflex.diagnosis.inference.results import (
    AT_NOISE_FLOOR,
    NAMED,
)
from carrierflex.diagnosis.kinds import problem_of
from carrierflex.files.json_files import read_json, save_json
from carrierflex.identification.campaign.campaign_files import read_campaign
from carrierflex.identification.estimation.single_thread import single_threaded
from carrierflex.workflows.diagnosis.diagnose_campaign import campaign_curves
from carrierflex.workflows.diagnosis.diagnose_campaign import main as diagnose_campaign
from carrierflex.workflows.diagnosis.report_files import REPORT_DATA_FILE

#: What the references answer to a case.
_REFERENCES_FILE = "references.json"
_FAILURES = (ValueError, ArithmeticError, RuntimeError, KeyError)


def diagnose_case(
    campaign: Path, out: Path, *, report: bool = True, references: bool = False
) -> None:
    """Diagnose a campaign and write diagnosis.json, report.html and the time it took.

    An input that is refused or a numerical failure is an answer too, and a wrong one: it is kept as
    such and ends no check. With `references` the answers of the references are written too.
    """
    if references:
        _refer(campaign, out)
    start = time.perf_counter()
    error = None
    try:
        diagnose_campaign(campaign, out=out, report=report, quiet=True)
    except _FAILURES as raised:
        error = f"{type(raised).__name__}: {raised}"
    out.mkdir(parents=True, exist_ok=True)
    save_json(out / TIMES_FILE, {"seconds": time.perf_counter() - start, "error": error})
    if not report:
        # Of thousands of cases no page is drawn later.
        (out / REPORT_DATA_FILE).unlink(missing_ok=True)


def reference_verdict(out: Path, name: str) -> Verdict:
    """Answer of one reference to a case: the laws that it names; ValueError where it has none."""
    answer = read_json(out / _REFERENCES_FILE, "answers of the references")[name]
    if answer["error"] is not None:
        return Verdict({"verdict": ERROR, "reason": answer["error"]}, answer["seconds"])
    laws = answer["effects"]
    verdict = NAMED if laws else AT_NOISE_FLOOR
    return Verdict({"verdict": verdict, "effects": laws, "aliases": []}, answer["seconds"])


def _refer(campaign: Path, out: Path) -> None:
    """Write what every reference answers; an error is an answer too."""
    start = time.perf_counter()
    answers = {}
    table = error = None
    n_samples = 0.0
    try:
        with single_threaded():
            measured = read_campaign(campaign)
            problem = problem_of(measured, campaign_curves(measured, campaign))
            table = problem.gram_table()
            n_samples = float(problem.cell_counts.sum())
    except _FAILURES as raised:
        error = f"{type(raised).__name__}: {raised}"
    for name, reference in REFERENCES.items():
        laws = reference(table, n_samples) if table is not None else ()
        seconds = time.perf_counter() - start
        answers[name] = {"effects": list(laws), "error": error, "seconds": seconds}
    out.mkdir(parents=True, exist_ok=True)
    save_json(out / _REFERENCES_FILE, answers)
