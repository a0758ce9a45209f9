"""How often the measurement that a plan proposes parts causes that a campaign leaves alike.

Draws carrier campaigns at one load, or mountings with a single record, whose cause passes for
another, plans, measures the first proposal on the same machine and diagnoses the enlarged campaign.
Writes KIND-SEED-NUMBER.json for every case, which a later call takes up, and plans.md. A good
answer: at least nine of ten parted, Wilson's interval beside it.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import Any, Literal

from carrierflex.blind_check.scoring.scoring import wilson
from carrierflex.blind_check.truth.campaigns import case_campaign
from carrierflex.files.json_files import save_json
from carrierflex.identification.estimation.single_thread import single_threaded
from carrierflex.workflows.diagnosis.examination import examined
from carrierflex.workflows.diagnosis.plan_campaign import PlanSettings, plan_of
from carrierflex.workflows.executors import work_executor
from carrierflex.workflows.fe.default_curves import default_curves
from carrierflex.workflows.outputs import prepared_folder
from carrierflex.workflows.progress import Stages
from studies.added_measurements import (
    AdditionOutcome,
    Answer,
    alias_case,
    answer_of,
    enlarged_case,
)
from studies.case_files import read_case, write_table

#: Cases drawn at most for every one that counts.
_MOST_DRAWN = 20


def main(
    *,
    out: Path,
    kind: Literal["carrier", "mounting"] = "carrier",
    seed: int = 1,
    cases: int = 24,
    least_gap: float = 0.6,
    largest_gap: float = 3.0,
    workers: int = 1,
    quiet: bool = False,
) -> tuple[AdditionOutcome, ...]:
    """Try the first proposal of a plan on cases whose cause passes for another.

    Parameters
    ----------
    out : Path
        Folder for the outcomes and the table; cases that stand there are not done again.
    kind : str
        Carrier or mounting.
    seed : int
        Seed of the draw.
    cases : int
        Cases that count.
    least_gap, largest_gap : float
        Range of the gap over the floor in the campaign as given.
    workers : int
        Processes.
    quiet : bool
        Show no progress.

    Returns
    -------
    tuple of AdditionOutcome
        The cases that count, in the order of the draw.
    """
    folder = prepared_folder(out)
    counted: list[AdditionOutcome] = []
    drawn = 0
    stages = Stages(1, quiet)
    with stages.stage("planning, measuring and diagnosing"), work_executor(workers) as executor:
        numbers = count(1)
        # Of large gaps the records tell nearly all causes apart by themselves.
        while len(counted) < cases and drawn < _MOST_DRAWN * cases:
            batch = [next(numbers) for _ in range(max(1, workers))]
            tasks = [
                executor.submit(_outcome_in, folder, kind, seed, number, (least_gap, largest_gap))
                for number in batch
            ]
            for task in tasks:
                outcome = task.result()
                drawn += len(counted) < cases
                if not outcome.before.is_alone and len(counted) < cases:
                    counted.append(outcome)
            stages.note(f"{len(counted)} of {cases} cases, {drawn} drawn")
    write_table(folder / "plans.md", _table(counted, drawn))
    return tuple(counted)


def _outcome_in(
    folder: Path, kind: str, seed: int, number: int, gaps: tuple[float, float]
) -> AdditionOutcome:
    """Outcome of one case, from its file where there is one."""
    path = folder / f"{kind}-{seed}-{number:03d}.json"
    if not path.is_file():
        with single_threaded():
            save_json(path, addition_outcome(seed, number, gaps, kind=kind))
    return read_case(path, "the outcome of a case", _outcome_of)


def _outcome_of(row: dict[str, Any]) -> AdditionOutcome:
    """Outcome of the content of its file."""
    before, after = _answer(row.pop("before")), row.pop("after")
    outcome = AdditionOutcome(**row, before=before)
    return replace(outcome, after=_answer(after) if after is not None else None)


def _answer(row: dict[str, Any]) -> Answer:
    return Answer(**{**row, "effects": tuple(row["effects"]), "aliases": tuple(row["aliases"])})


def addition_outcome(
    seed: int, number: int, gaps: tuple[float, float], *, kind: str = "carrier"
) -> AdditionOutcome:
    """One case before and after the first proposal.

    Parameters
    ----------
    seed, number : int
        Seed of the draw and number in it.
    gaps : tuple of float
        Smallest and largest gap over the floor.
    kind : str
        Carrier or mounting.
    """
    case = alias_case(seed, number, gaps, kind=kind)
    curves = default_curves() if kind == "carrier" else None
    given, label = case_campaign(case)
    before = answer_of(examined(given, curves).diagnosis(), label)
    outcome = AdditionOutcome(case.name, case.effects[0], label.gap_over_floor, before)
    if before.is_alone:
        return outcome
    planned = plan_of(given, curves, PlanSettings(), is_measured=True)
    proposal = planned.plan.proposal
    if proposal is None:
        return outcome
    addition = proposal.addition
    proposed = replace(
        outcome,
        proposal=addition.text,
        cost=addition.cost,
        is_sufficient=proposal.is_sufficient,
    )
    enlarged = enlarged_case(case, addition, planned.pool, len(given.runs))
    if enlarged is None:
        return proposed
    return replace(proposed, after=answer_of(examined(enlarged, curves).diagnosis(), label))


def _table(outcomes: Sequence[AdditionOutcome], drawn: int) -> Iterator[str]:
    yield "| case | cause | gap | before | alike | proposal | min | after | alike | parted |"
    yield "|---|---|---|---|---|---|---|---|---|---|"
    for outcome in outcomes:
        after = outcome.after
        cells = (
            outcome.case,
            outcome.effect,
            f"{outcome.gap:.1f}",
            _named(outcome.before),
            ", ".join(outcome.before.aliases) or "-",
            outcome.proposal or "none",
            f"{outcome.cost:.0f}",
            _named(after) if after is not None else "-",
            ", ".join(after.aliases) or "-" if after is not None else "-",
            "yes" if outcome.is_separated else "no",
        )
        yield f"| {' | '.join(cells)} |"
    yield ""
    for words, hits in (
        ("true cause alone before", sum(outcome.before.is_alone for outcome in outcomes)),
        ("true cause named before, alike with others or not",
         sum(outcome.before.is_right for outcome in outcomes)),
        ("true cause alone after the first proposal",
         sum(outcome.is_separated for outcome in outcomes)),
        ("true cause named after it, alike with others or not",
         sum(outcome.after is not None and outcome.after.is_right for outcome in outcomes)),
    ):  # fmt: skip
        low, high = wilson(hits, len(outcomes))
        yield f"- {words}: {hits} of {len(outcomes)} (95 %: {low:.0%} to {high:.0%})"
    yield f"- cases drawn until so many passed for another: {drawn}"


def _named(answer: Answer) -> str:
    return f"{answer.verdict}: {', '.join(answer.effects) or 'nothing'}"


if __name__ == "__main__":
    import cyclopts

    cyclopts.run(main)
