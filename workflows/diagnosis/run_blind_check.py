"""How often a diagnosis is right.

Campaigns whose missing effect is sealed, diagnosed, and only then opened.

Writes seals.json before the first diagnosis, a diagnosis.json for each case, then labels.json,
blind_check.json and blind_check.md. A good answer: every wanted figure is met by a full run
(docs/blind_check.md).
"""

import functools
from collections.abc import Sequence
from concurrent.futures import Executor
from contextlib import AbstractContextManager
from datetime import datetime
from pathlib import Path
from typing import Any, Literal

from rich.console import Console

from carrierflex.blind_check.case_plans import case_plans, full_size
from carrierflex.blind_check.labels import KINDS
from carrierflex.blind_check.scoring.judging import Judged, judged_cases
from carrierflex.blind_check.scoring.result import BlindCheck
from carrierflex.blind_check.scoring.scoring import Score, score
from carrierflex.blind_check.sealing.check import diagnosed, opened, sealed_check
from carrierflex.blind_check.truth.campaigns import write_case
from carrierflex.files.json_files import plain, save_json
from carrierflex.files.versions import software_name
from carrierflex.files.whole_files import whole_file
from carrierflex.workflows.diagnosis.diagnose_case import diagnose_case
from carrierflex.workflows.screen.score_tables import score_page
from carrierflex.workflows.support.executors import other_processes, work_executor
from carrierflex.workflows.support.outputs import prepared_folder
from carrierflex.workflows.support.progress import Stages

Kind = Literal["carrier", "mounting", "element", "all"]


def main(
    *,
    out: Path,
    kind: Sequence[Kind] = ("all",),
    cases: int | None = None,
    seed: int = 1,
    workers: int = 1,
    scheduler: str | None = None,
    keep: bool = True,
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
    workers : int
        Processes that write and diagnose cases.
    scheduler : str
        Address of a Dask scheduler (tcp://host:8786) for the same, instead of workers; its workers
        see the folder.
    keep : bool
        Keep the campaigns and draw the reports.
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
    plans = [plan for name, size in sizes.items() for plan in case_plans(name, size, seed)]
    folder = prepared_folder(out).resolve()
    stages = Stages(3, quiet)
    with stages.stage("writing and sealing the cases"), _processes(workers, scheduler) as executor:
        request = {"seed": seed, "cases": sizes}
        sealed = sealed_check(plans, folder, write_case, executor, check=request, note=stages.note)
    Console(quiet=quiet, highlight=False).print(
        f"digest of {len(plans)} seals: {sealed.published.digest}", soft_wrap=True
    )
    # Fresh processes: those that wrote the cases have held labels.
    with stages.stage("diagnosing"), _processes(workers, scheduler) as executor:
        diagnose = functools.partial(diagnose_case, report=keep)
        verdicts = diagnosed(sealed, diagnose, executor, keep=keep, note=stages.note)
    with stages.stage("opening the labels"):
        judged = judged_cases(opened(sealed), verdicts)
        result = score(judged)
        command = " ".join(
            ["carrierflex blind-check", *(f"--kind {name}" for name in kinds)]
            + ([f"--cases {cases}"] if cases is not None else [])
            + [f"--seed {seed}"]
        )
        _write(folder, result, judged, command=command, digest=sealed.published.digest)
    return BlindCheck(result, sealed.published.digest)


def _processes(workers: int, scheduler: str | None) -> AbstractContextManager[Executor]:
    """Executor in other processes, even if it is only one: this one holds the labels."""
    if workers == 1 and scheduler is None:
        return other_processes(1)
    return work_executor(workers, scheduler)


def _write(
    out: Path, result: Score, judged: Sequence[Judged], *, command: str, digest: str
) -> None:
    date, software = f"{datetime.now():%Y-%m-%d}", software_name()
    head = {"format": "carrierflex-blind-check", "version": 1, "software": software, "date": date}
    figures: dict[str, Any] = {
        "met": result.met,
        "figures": plain(result.figures),
        "confusion": plain(result.confusion),
    }
    rows = [
        {
            **{
                name: getattr(case.label, name)
                for name in ("case", "family", "effects", "gap_over_floor", "rho")
            },
            **{
                "verdict": case.verdict.document["verdict"],
                "named": case.named,
                "right": case.is_right,
            },
            **{"reason": case.verdict.document.get("reason"), "seconds": case.verdict.seconds},
        }
        for case in judged
    ]
    save_json(
        out / "blind_check.json",
        head | {"command": command, "digest": digest} | figures | {"cases": rows},
    )
    page = score_page(result, command=command, date=date, digest=digest, software=software)
    with whole_file(out / "blind_check.md") as file:
        file.write_text(page, encoding="utf-8")
