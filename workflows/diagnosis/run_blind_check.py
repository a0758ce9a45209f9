"""How often is a diagnosis right? Campaigns whose missing effect is sealed, diagnosed, and only then opened.

Writes seals.json before the first diagnosis, a diagnosis.json for each case, then labels.json,
blind_check.json and blind_check.md. A good answer: every wanted figure is met by a full run
(docs/blind_check.md).
"""

from collections.abc import Iterator, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime
from multiprocessing import get_context
from pathlib import Path
from typing import Any, Literal

from rich.console import Console

from carrierflex.blind_check.case_plans import case_plans, full_size
from carrierflex.blind_check.labels import KINDS
from carrierflex.blind_check.scoring.judging import Judged, judged_cases
from carrierflex.blind_check.scoring.scoring import Score, score
from carrierflex.blind_check.sealing.check import diagnosed, opened, sealed_check
from carrierflex.blind_check.truth.campaigns import write_case
from carrierflex.files.whole_files import whole_file
from carrierflex.identification.estimate_files import software_name
from carrierflex.workflows.screen.score_tables import score_page
from carrierflex.workflows.support.executors import work_executor
from carrierflex.workflows.support.outputs import plain, prepared_folder, save_json
from carrierflex.workflows.support.progress import Stages

Kind = Literal["carrier", "mounting", "element", "all"]


@dataclass(frozen=True)
class BlindCheck:
    """Score of a blind check and the digest of its seals."""

    score: Score
    digest: str

    @property
    def met(self) -> bool:
        """Whether no wanted figure is missed."""
        return self.score.met


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
        Keep the campaigns and reports.
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
    kinds = tuple(own for own in KINDS if own in kind or "all" in kind)
    sizes = {own: full_size(own) if cases is None else cases for own in kinds}
    plans = [plan for own, size in sizes.items() for plan in case_plans(own, size, seed)]
    folder = prepared_folder(out).resolve()
    stages = Stages(3, quiet)
    with stages.stage("writing and sealing the cases"), _processes(workers, scheduler) as executor:
        asked = {"seed": seed, "cases": sizes}
        sealed = sealed_check(plans, folder, write_case, executor, check=asked, note=stages.note)
    Console(quiet=quiet, highlight=False).print(
        f"digest of {len(plans)} seals: {sealed.published.digest}", soft_wrap=True
    )
    # Fresh processes: those that wrote the cases have held labels.
    with stages.stage("diagnosing"), _processes(workers, scheduler) as executor:
        verdicts = diagnosed(sealed, executor, keep=keep, note=stages.note)
    with stages.stage("opening the labels"):
        judged = judged_cases(opened(sealed), verdicts)
        found = score(judged)
        command = " ".join(
            ["carrierflex blind-check", *(f"--kind {own}" for own in kinds)]
            + ([f"--cases {cases}"] if cases is not None else [])
            + [f"--seed {seed}"]
        )
        _write(folder, found, judged, command=command, digest=sealed.published.digest)
    return BlindCheck(found, sealed.published.digest)


@contextmanager
def _processes(workers: int, scheduler: str | None) -> Iterator[Executor]:
    """Executor in other processes, even if it is only one: this one holds the labels."""
    if workers != 1 or scheduler is not None:
        with work_executor(workers, scheduler) as executor:
            yield executor
        return
    executor = ProcessPoolExecutor(1, mp_context=get_context("spawn"))
    try:
        yield executor
    except BaseException:
        executor.shutdown(wait=False, cancel_futures=True)
        raise
    executor.shutdown()


def _write(out: Path, found: Score, judged: Sequence[Judged], *, command: str, digest: str) -> None:
    date, software = f"{datetime.now():%Y-%m-%d}", software_name()
    head = {"format": "carrierflex-blind-check", "version": 1, "software": software, "date": date}
    figures: dict[str, Any] = {
        "met": found.met,
        "figures": plain(found.figures),
        "confusion": plain(found.confusion),
    }
    rows = [
        {
            **{
                name: getattr(own.label, name)
                for name in ("case", "family", "effects", "gap_over_floor", "rho")
            },
            **{
                "verdict": own.verdict.document["verdict"],
                "named": own.named,
                "right": own.is_right,
            },
            **{"reason": own.verdict.document.get("reason"), "seconds": own.verdict.seconds},
        }
        for own in judged
    ]
    save_json(
        out / "blind_check.json",
        head | {"command": command, "digest": digest} | figures | {"cases": rows},
    )
    page = score_page(found, command=command, date=date, digest=digest, software=software)
    with whole_file(out / "blind_check.md") as file:
        file.write_text(page, encoding="utf-8")
