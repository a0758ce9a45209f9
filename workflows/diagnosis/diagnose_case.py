"""Diagnosis of one sealed case, as ``carrierflex diagnose`` makes it.

All it is given is the folder of the campaign.

Nothing of the truth is imported here: a process that runs it has never held a label.
"""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from carrierflex.blind_check.references.linear_laws import REFERENCES
from carrierflex.blind_check.sealing.verdicts import ERROR, TIMES_FILE, Verdict
from carrierflex.diagnosis.classes.results import (
    LEADING_CLASS,
    NAMED_CLASS,
    NO_CLASS,
    NOT_VISIBLE,
    NOTHING,
    ClassAnswer,
)
from carrierflex.diagnosis.inference.results import (
    ALIASED,
    AT_NOISE_FLOOR,
    CLASS_NAMED,
    NAMED,
    NONE_OF_THESE,
    NOT_DIAGNOSABLE,
)
from carrierflex.diagnosis.kind.comparison_problem import ComparisonProblem
from carrierflex.diagnosis.kinds import problem_of
from carrierflex.diagnosis.report.diagnosis_files import DIAGNOSIS_FILE, FORMAT, VERSION, class_keys
from carrierflex.files.json_files import read_json, save_json
from carrierflex.identification.campaign.campaign_files import read_campaign
from carrierflex.identification.estimation.single_thread import single_threaded
from carrierflex.workflows.diagnosis.diagnose_campaign import campaign_curves
from carrierflex.workflows.diagnosis.diagnose_campaign import main as diagnose_campaign

_VERDICT_OF_STATE = {
    NOTHING: AT_NOISE_FLOOR,
    NOT_VISIBLE: NOT_DIAGNOSABLE,
    NO_CLASS: NONE_OF_THESE,
    NAMED_CLASS: CLASS_NAMED,
    LEADING_CLASS: CLASS_NAMED,
}

#: What the references answer to a case.
_REFERENCES_FILE = "references.json"


def diagnose_case(
    campaign: Path, out: Path, *, report: bool = True, references: bool = False
) -> None:
    """Diagnose a campaign and write diagnosis.json, report.html and the time it took.

    An input that is refused or a numerical failure is an answer too, and a wrong one: it is kept as
    such and ends no check.

    Parameters
    ----------
    campaign, out : Path
        Folder of the campaign, folder for the files.
    report : bool
        Draw report.html too.
    references : bool
        Write the answers of the references too.
    """
    if references:
        _refer(campaign, out)
    _kept(out, lambda: diagnose_campaign(campaign, out=out, report=report, quiet=True))


def classify_case(campaign: Path, out: Path, *, references: bool = False) -> None:
    """Answer by class alone, without the search for laws: ten times faster, for large checks.

    Writes diagnosis.json with the keys that the score by class reads. A law is named where it
    cannot be told from its class in force space; its parameters are not fitted.

    Parameters
    ----------
    campaign, out : Path
        Folder of the campaign, of a kind that has classes, and folder for the files.
    references : bool
        Write the answers of the references too.
    """
    if references:
        _refer(campaign, out)
    _kept(out, lambda: _classify(campaign, out))


def reference_verdict(out: Path, name: str) -> Verdict:
    """Answer of one reference to a case: the laws that it names.

    Parameters
    ----------
    out : Path
        Folder of the case's diagnosis.
    name : str
        Reference.

    Raises
    ------
    ValueError
        Where the references have not answered it.
    """
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
    table = None
    error = None
    n_samples = 0.0
    try:
        with single_threaded():
            problem = _problem(campaign)
            table = problem.gram_table()
            n_samples = float(problem.cell_counts.sum())
    except (ValueError, ArithmeticError, RuntimeError, KeyError) as raised:
        error = f"{type(raised).__name__}: {raised}"
    for name, reference in REFERENCES.items():
        laws = reference(table, n_samples) if table is not None else ()
        seconds = time.perf_counter() - start
        answers[name] = {"effects": list(laws), "error": error, "seconds": seconds}
    out.mkdir(parents=True, exist_ok=True)
    save_json(out / _REFERENCES_FILE, answers)


def _problem(folder: Path) -> ComparisonProblem:
    """Comparison problem of a campaign, with the curves that a diagnosis takes."""
    measured = read_campaign(folder)
    problem, _ = problem_of(measured, campaign_curves(measured, folder))
    return problem


def _classify(campaign: Path, out: Path) -> None:
    with single_threaded():  # as in diagnose_campaign
        problem = _problem(campaign)
        answer = problem.class_answer()
    # Records too short for classes answer nothing.
    keys = {"verdict": NOT_DIAGNOSABLE} if answer is None else _verdict_keys(answer)
    out.mkdir(parents=True, exist_ok=True)
    document = {"format": FORMAT, "version": VERSION, **keys, **class_keys(answer)}
    save_json(out / DIAGNOSIS_FILE, document)


def _verdict_keys(answer: ClassAnswer) -> dict[str, Any]:
    verdict = _VERDICT_OF_STATE[answer.state]
    laws = [named.law for named in answer.classes if named.law_named and named.law]
    return {
        "verdict": ALIASED if answer.ties else verdict,
        "incomplete": answer.state == LEADING_CLASS,
        "effects": laws if answer.state == NAMED_CLASS and not answer.ties else [],
    }


def _kept(out: Path, diagnosis: Callable[[], object]) -> None:
    """Make a diagnosis and write down its time and, where it failed, why."""
    start = time.perf_counter()
    error = None
    try:
        diagnosis()
    except (ValueError, ArithmeticError, RuntimeError, KeyError) as raised:
        error = f"{type(raised).__name__}: {raised}"
    out.mkdir(parents=True, exist_ok=True)
    save_json(out / TIMES_FILE, {"seconds": time.perf_counter() - start, "error": error})
