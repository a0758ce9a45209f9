"""How often a diagnosis is right.

Campaigns whose missing effect is sealed, diagnosed, and only then opened.

Writes seals.json before the first diagnosis, a diagnosis.json for each case, then labels.json,
blind_check.json and blind_check.md. A good answer: every wanted figure is met by a full run
(docs/validation.md).
"""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from rich.console import Console

from carrierflex.blind_check.labels import FAMILIES, KINDS, CasePlan, Label
from carrierflex.files.versions import software_name
from carrierflex.identification.estimation.single_thread import single_threaded
from carrierflex.workflows.executors import check_workers, other_processes, work_executor
from carrierflex.workflows.outputs import prepared_folder
from carrierflex.workflows.progress import Stages

if TYPE_CHECKING:
    from carrierflex.blind_check.scoring.result import BlindCheck, ExportedCheck
    from carrierflex.blind_check.sealing.verdicts import Verdict

Kind = Literal["carrier", "mounting", "element", "all"]
Family = Literal[
    "single",
    "pair",
    "nothing",
    "outside",
    "aliased",
    "one_condition",
    "stage",
    "form",
    "several",
    "model",
    "decay",
]
Noise = Literal["declared", "undeclared", "half"]

_README = """# Sealed campaigns of a blind check

Every folder of `campaigns/` is one measurement campaign beside a baseline simulation (format:
docs/campaign_format.md of carrierflex). In some of them the baseline lacks one effect or several,
in others it lacks nothing. What is missing?

Answers go into one JSON file: its keys are in docs/validation.md, "Others can enter". `seals.json`
fixes the truth of every case: SHA-256 of its label and a salt that are published with the score.

Digest of the seals: {digest}
"""


def main(
    *,
    out: Path,
    kind: Sequence[Kind] = ("all",),
    cases: int | None = None,
    seed: int = 1,
    family: Sequence[Family] = (),
    noise: Noise = "declared",
    workers: int = 1,
    scheduler: str | None = None,
    keep: bool = True,
    references: bool = False,
    sealed_campaigns: Path | None = None,
    score: Path | None = None,
    quiet: bool = False,
) -> BlindCheck | ExportedCheck:
    """Diagnose sealed campaigns and score the answers.

    Parameters
    ----------
    out : Path
        Folder to write: the check; a second run with the same folder continues an interrupted
        check.
    kind : sequence of str
        Kinds of campaign; may be repeated.
    cases : int
        Number of cases of each kind; default: a full check.
    seed : int
        Seed of the cases.
    family : sequence of str
        Only these families of cases; may be repeated. All without, but "form": causes of a carrier
        or mounting in forms of no law, judged by class, and "several": three to five of these at
        once, and "model": carriers off their drawing. Of kind element only "decay", free decays,
        which else end a full check.
    noise : str
        Whether the campaigns declare the noise of their channels (kinds carrier and mounting): all,
        none, or every other one; their figures are given separately.
    workers : int
        Processes that write and diagnose cases.
    scheduler : str
        Address of a Dask scheduler (tcp://host:8786) instead of --workers; its workers must have
        access to the folder.
    keep : bool
        Keep the campaigns and draw the reports.
    references : bool
        Also answer every case by two plain methods, best single law by BIC and sparse regression
        over the library, and compare their figures with those of the diagnosis.
    sealed_campaigns : Path
        Folder to write the sealed campaigns to, without their truth, instead of diagnosing them:
        others answer them. Seals and salts stay in --out.
    score : Path
        Answers (JSON) of any tool to an exported check whose folder is --out: its figures go to
        --out/scores/NAME. Kinds, cases, seed and families are those of the check.
    quiet : bool
        Show no progress and no digest before the diagnoses.

    Returns
    -------
    BlindCheck or ExportedCheck
        Figures beside what is wanted; of an export, where it is.

    Raises
    ------
    ValueError
        Where the folder holds another check, a label is not the sealed one, the answers are no
        answers to this check, or `score` and `sealed_campaigns` are both given.
    OSError
        Where `out` cannot be written.
    """
    check_workers(workers, scheduler)
    if score is not None and sealed_campaigns is not None:
        raise ValueError("--score and --sealed-campaigns are given; expected one of them")
    if score is not None:
        return _scored_answers(score, out)
    kinds = tuple(name for name in KINDS if name in kind or "all" in kind)

    from carrierflex.blind_check.case_plans import DECLARED, full_size
    from carrierflex.blind_check.scoring.result import ExportedCheck
    from carrierflex.blind_check.sealing.check import diagnosed, exported, opened, sealed_check
    from carrierflex.workflows.diagnosis.diagnose_case import diagnose_case
    from carrierflex.workflows.diagnosis.scored_check import scored, write_score

    request: dict[str, Any] = {
        "seed": seed,
        "cases": {name: full_size(name) if cases is None else cases for name in kinds},
    }
    if family:
        request["families"] = list(family)
    if noise != DECLARED:
        request["noise"] = noise
    plans = _plans(request)
    folder = prepared_folder(out).resolve()
    export = sealed_campaigns
    if export is not None:
        _check_export(export)
    # Cases are counted; how long they take to write tells nothing of their diagnoses.
    stages = Stages(3, quiet, (0.1, 1.0, 0.0), timed_from=1) if export is None else Stages(1, quiet)
    with stages.stage("writing and sealing the cases"), _processes(workers, scheduler) as executor:
        sealed = sealed_check(plans, folder, _write_case, executor, check=request, note=stages.note)
    Console(quiet=quiet, highlight=False).print(
        f"digest of {len(plans)} seals: {sealed.published.digest}", soft_wrap=True
    )
    if export is not None:
        exported(sealed, export, _README.format(digest=sealed.published.digest))
        return ExportedCheck(export, len(plans), sealed.published.digest)
    # Fresh processes: those that wrote the cases have held labels.
    with stages.stage("diagnosing"), _processes(workers, scheduler) as executor:
        diagnose = functools.partial(diagnose_case, report=keep, references=references)
        verdicts = diagnosed(sealed, diagnose, executor, keep=keep, note=stages.note)
    with stages.stage("opening the labels"):
        labels = opened(sealed)
        result, rows = scored(labels, verdicts, sealed.published.digest)
        if references:
            result = replace(
                result, reference_checks=_reference_scores(folder, labels, verdicts, result.digest)
            )
        command = _command(kinds, cases, request, references=references)
        write_score(folder, result, rows, command=command)
    return result


def _command(
    kinds: Sequence[str],
    cases: int | None,
    request: Mapping[str, Any],
    *,
    references: bool,
) -> str:
    """Command that makes the same check."""
    words = ["carrierflex blind-check", *(f"--kind {name}" for name in kinds)]
    if cases is not None:
        words.append(f"--cases {cases}")
    words.append(f"--seed {request['seed']}")
    words += [f"--family {name}" for name in request.get("families", ())]
    if "noise" in request:
        words.append(f"--noise {request['noise']}")
    return " ".join([*words, *["--references"] * references])


def _processes(workers: int, scheduler: str | None) -> AbstractContextManager[Executor]:
    """Executor in other processes, even if it is only one: this one holds the labels."""
    if workers == 1 and scheduler is None:
        return other_processes(1)
    return work_executor(workers, scheduler)


def _check_export(folder: Path) -> None:
    """Make sure that an export replaces nothing but an earlier one."""
    from carrierflex.blind_check.sealing.check import SEALS_FILE

    prepared_folder(folder)
    if any(folder.iterdir()) and not (folder / SEALS_FILE).is_file():
        raise ValueError(
            f"--sealed-campaigns {folder}: holds other files; expected a new or empty folder"
        )


def _plans(request: Mapping[str, Any]) -> list[CasePlan]:
    """Plans of what was asked for."""
    from carrierflex.blind_check.case_plans import DECLARED, case_plans, with_noise_declared

    families = tuple(request.get("families", FAMILIES))
    return [
        plan
        for kind, size in request["cases"].items()
        for plan in with_noise_declared(
            case_plans(kind, size, request["seed"], families), request.get("noise", DECLARED)
        )
    ]


def _reference_scores(
    folder: Path, labels: Mapping[str, Label], verdicts: Mapping[str, Verdict], digest: str
) -> dict[str, BlindCheck]:
    """Scores of the references, whose answers are written as any tool's are, ours with them."""
    from carrierflex.blind_check.references.linear_laws import REFERENCES
    from carrierflex.blind_check.sealing.answers import Answers, write_answers
    from carrierflex.workflows.diagnosis.diagnose_case import reference_verdict
    from carrierflex.workflows.diagnosis.scored_check import scored

    answers = folder / "answers"
    answers.mkdir(exist_ok=True)
    write_answers(answers / "carrierflex.json", Answers(software_name(), verdicts))
    checks = {}
    for name in REFERENCES:
        answered = {case: reference_verdict(folder / "diagnoses" / case, name) for case in labels}
        write_answers(answers / f"{name}.json", Answers(name, answered))
        checks[name] = scored(labels, answered, digest)[0]
    return checks


def _write_case(plan: CasePlan, folder: Path) -> Label:
    """Write the campaign of a case, on one thread.

    Its matrices are small: threads wait for one another a thousand times longer than they work
    where other processes have the cores.
    """
    from carrierflex.blind_check.truth.campaigns import write_case

    with single_threaded():
        return write_case(plan, folder)


def _label(plan: CasePlan) -> Label:
    """Label of a case, made once more."""
    from carrierflex.blind_check.truth.campaigns import case_campaign

    with single_threaded():
        return case_campaign(plan)[1]


def _scored_answers(answers: Path, out: Path) -> BlindCheck:
    """Score of the answers of any tool to an exported check."""
    from carrierflex.blind_check.sealing.answers import read_answers
    from carrierflex.blind_check.sealing.check import remade
    from carrierflex.workflows.diagnosis.scored_check import scored, write_score

    labels, published = remade(out, _plans, _label)
    read = read_answers(answers, labels)
    result, rows = scored(labels, read.cases, published.digest)
    # Of "...json" the stem is "..": the folder above.
    folder = out / "scores" / (answers.stem.strip(".") or "answers")
    folder.mkdir(parents=True, exist_ok=True)
    command = f"carrierflex blind-check --score {answers.name}, answers of {read.tool}"
    write_score(folder, result, rows, command=command)
    return result
