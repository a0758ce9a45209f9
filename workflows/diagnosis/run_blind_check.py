"""How often a diagnosis is right.

Campaigns whose missing effect is sealed, diagnosed, and only then opened.

Writes seals.json before the first diagnosis, a diagnosis.json for each case, then labels.json,
blind_check.json and blind_check.md. A good answer: every wanted figure is met by a full run
(docs/blind_check.md).
"""

import functools
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from contextlib import AbstractContextManager
from datetime import datetime
from pathlib import Path
from typing import Any, Literal

from rich.console import Console

from carrierflex.blind_check.case_plans import case_plans, full_size
from carrierflex.blind_check.labels import FAMILIES, KINDS, Label
from carrierflex.blind_check.scoring.class_judging import (
    CLASS_KINDS,
    ClassJudged,
    cases_judged_by_class,
)
from carrierflex.blind_check.scoring.class_score import class_score
from carrierflex.blind_check.scoring.judging import Judged, judged_cases
from carrierflex.blind_check.scoring.result import BlindCheck
from carrierflex.blind_check.scoring.scoring import score
from carrierflex.blind_check.sealing.check import diagnosed, opened, sealed_check
from carrierflex.blind_check.sealing.verdicts import Verdict
from carrierflex.blind_check.truth.campaigns import write_case
from carrierflex.files.json_files import plain, save_json
from carrierflex.files.versions import software_name
from carrierflex.files.whole_files import whole_file
from carrierflex.workflows.diagnosis.diagnose_case import classify_case, diagnose_case
from carrierflex.workflows.screen.score_tables import score_page
from carrierflex.workflows.support.executors import other_processes, work_executor
from carrierflex.workflows.support.outputs import prepared_folder
from carrierflex.workflows.support.progress import Stages

Kind = Literal["carrier", "mounting", "element", "all"]
Family = Literal["single", "pair", "nothing", "outside", "aliased", "one_condition", "stage"]


def main(
    *,
    out: Path,
    kind: Sequence[Kind] = ("all",),
    cases: int | None = None,
    seed: int = 1,
    family: Sequence[Family] = (),
    workers: int = 1,
    scheduler: str | None = None,
    keep: bool = True,
    classes_only: bool = False,
    quiet: bool = False,
) -> BlindCheck:
    """Diagnose sealed campaigns and score the answers.

    Parameters
    ----------
    out : Path
        Folder of the check; the same folder again goes on where a check was interrupted.
    kind : sequence of str
        Kinds of campaign; may be repeated.
    cases : int
        Cases of each kind; a full check without.
    seed : int
        Seed of the cases.
    family : sequence of str
        Only these families of cases (kinds carrier and mounting); may be repeated. All without.
    workers : int
        Processes that write and diagnose cases.
    scheduler : str
        Address of a Dask scheduler (tcp://host:8786) for the same, instead of workers; its workers
        see the folder.
    keep : bool
        Keep the campaigns and draw the reports.
    classes_only : bool
        Answer by class alone, without the search for laws (kind element).
    quiet : bool
        Show no progress and no digest before the diagnoses.

    Returns
    -------
    BlindCheck
        Figures beside what is wanted.

    Raises
    ------
    ValueError
        Where the folder holds another check, or a label is not the sealed one.
    OSError
        Where `out` cannot be written.
    """
    kinds = tuple(name for name in KINDS if name in kind or "all" in kind)
    sizes = {name: full_size(name) if cases is None else cases for name in kinds}
    families = tuple(family) or FAMILIES
    plans = [
        plan for name, size in sizes.items() for plan in case_plans(name, size, seed, families)
    ]
    folder = prepared_folder(out).resolve()
    stages = Stages(3, quiet)
    with stages.stage("writing and sealing the cases"), _processes(workers, scheduler) as executor:
        request: dict[str, Any] = {"seed": seed, "cases": sizes}
        if family:
            request["families"] = list(family)
        sealed = sealed_check(plans, folder, write_case, executor, check=request, note=stages.note)
    Console(quiet=quiet, highlight=False).print(
        f"digest of {len(plans)} seals: {sealed.published.digest}", soft_wrap=True
    )
    # Fresh processes: those that wrote the cases have held labels.
    with stages.stage("diagnosing"), _processes(workers, scheduler) as executor:
        full = functools.partial(diagnose_case, report=keep)
        diagnose = classify_case if classes_only else full
        verdicts = diagnosed(sealed, diagnose, executor, keep=keep, note=stages.note)
    with stages.stage("opening the labels"):
        labels = opened(sealed)
        by_class = cases_judged_by_class(labels, verdicts)
        effect_labels = _by_effect(labels)
        by_effect = judged_cases(effect_labels, {case: verdicts[case] for case in effect_labels})
        result = BlindCheck(
            score(by_effect) if by_effect else None,
            class_score(by_class) if by_class else None,
            sealed.published.digest,
        )
        command = " ".join(
            ["carrierflex blind-check", *(f"--kind {name}" for name in kinds)]
            + ([f"--cases {cases}"] if cases is not None else [])
            + [f"--seed {seed}"]
            + [f"--family {name}" for name in family]
            + (["--classes-only"] if classes_only else [])
        )
        rows = [*(_row(case) for case in by_effect), *(_class_row(case) for case in by_class)]
        _write(folder, result, rows, command=command)
    return result


def _by_effect(labels: Mapping[str, Label]) -> dict[str, Label]:
    """Labels of the kinds that are judged by effect."""
    return {case: label for case, label in labels.items() if label.kind not in CLASS_KINDS}


def _processes(workers: int, scheduler: str | None) -> AbstractContextManager[Executor]:
    """Executor in other processes, even if it is only one: this one holds the labels."""
    if workers == 1 and scheduler is None:
        return other_processes(1)
    return work_executor(workers, scheduler)


def _write(
    out: Path, result: BlindCheck, rows: Sequence[Mapping[str, Any]], *, command: str
) -> None:
    date, software = f"{datetime.now():%Y-%m-%d}", software_name()
    head = {"format": "carrierflex-blind-check", "version": 2, "software": software, "date": date}
    scores = [own for own in (result.score, result.class_score) if own is not None]
    figures: dict[str, Any] = {
        "met": result.met,
        "figures": plain([figure for own in scores for figure in own.figures]),
        "confusion": plain([row for own in scores for row in own.confusion]),
    }
    if result.class_score is not None:
        figures["by_change_of_form"] = plain(result.class_score.changes)
    save_json(
        out / "blind_check.json",
        head | {"command": command, "digest": result.digest} | figures | {"cases": rows},
    )
    page = score_page(result, command=command, date=date, software=software)
    with whole_file(out / "blind_check.md") as file:
        file.write_text(page, encoding="utf-8")


def _row(case: Judged) -> dict[str, Any]:
    names = ("case", "family", "effects", "gap_over_floor", "rho")
    return {
        **{name: getattr(case.label, name) for name in names},
        **_answer(case.verdict),
        "named": case.named,
        "right": case.is_right,
    }


def _class_row(case: ClassJudged) -> dict[str, Any]:
    names = ("case", "family", "effects", "gap_over_floor", "classes", "drive", "changes")
    document = case.verdict.document
    return {
        **{name: getattr(case.label, name) for name in names},
        **_answer(case.verdict),
        "named": case.laws,
        "answer": case.answer,
        "class_ties": document.get("class_ties", ()),
        "rivals": document.get("class_rivals", {}),
        "outcome": case.outcome,
        "false_laws": case.false_laws,
    }


def _answer(verdict: Verdict) -> dict[str, Any]:
    document = verdict.document
    return {
        "verdict": document["verdict"],
        "reason": document.get("reason"),
        "seconds": verdict.seconds,
    }
