"""Which faults of a measuring chain are noticed: one row a fault and size, over seeds.

Campaigns of the blind check get one fault each. The faults of a chain are put into campaigns with
nothing missing (:mod:`studies.fault_outcomes`); a good answer: nothing missed. Errors of practice,
and five for which there is no rule, also into campaigns with a cause
(:mod:`studies.fault_answers`); a good answer: all reported, no physics. Writes one JSON file for
every seed, fault by fault, which a later call takes up, and a table in KIND.md.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from carrierflex.blind_check.case_plans import case_plans
from carrierflex.blind_check.labels import NOTHING, SINGLE, CasePlan
from carrierflex.blind_check.truth.campaigns import case_campaign
from carrierflex.files.json_files import read_json, save_json
from carrierflex.identification.estimation.single_thread import single_threaded
from carrierflex.workflows.executors import work_executor
from carrierflex.workflows.fe.default_curves import default_curves
from carrierflex.workflows.outputs import prepared_folder
from carrierflex.workflows.progress import Stages
from studies.case_files import write_table
from studies.fault_answers import ANSWERS, SMALL, fault_answers
from studies.fault_outcomes import HARMLESS, OUTCOMES, Curves, Outcome, fault_outcomes
from studies.fault_table import Fault, faults_of
from studies.practice_faults import practice_faults, unforeseen_faults

#: Cases of a plan that holds some with nothing missing.
_CASES = 60
#: Smallest gap over the floor of a cause beside an error of practice.
_VISIBLE = 3.0

Kind = Literal["carrier", "mounting", "element"]
Table = Literal["chain", "practice", "unforeseen"]
_NOTHING, _CAUSE = "nothing", "cause"


@dataclass(frozen=True)
class FaultRow:
    """A fault of one size: how often it had each of the `OUTCOMES`, and by what."""

    fault: str
    size: str
    counts: tuple[int, ...]
    by: tuple[str, ...]


@dataclass(frozen=True)
class _Task:
    """Faults of one table in one campaign."""

    table: Table
    kind: Kind
    missing: str
    seed: int
    every: int

    @property
    def name(self) -> str:
        """Name of its file, without an ending."""
        if self.table == "chain":
            return f"{self.kind}-{self.seed}"
        return f"{self.table}-{self.kind}-{self.missing}-{self.seed}"


def main(
    *,
    out: Path,
    kind: Kind,
    table: Table = "chain",
    seeds: Sequence[int] = tuple(range(1, 11)),
    every: int = 1,
    workers: int = 1,
    quiet: bool = False,
) -> tuple[FaultRow, ...]:
    """Put every fault into campaigns without one and count what becomes of it.

    Parameters
    ----------
    out : Path
        Folder for the outcomes and the table; faults that stand there are not done again.
    kind : str
        Kind of campaign.
    table : str
        Faults of a measuring chain, errors of practice, or five for which there is no rule.
    seeds : sequence of int
        Seeds of the campaigns.
    every : int
        Take one fault of so many, others with the next seed.
    workers : int
        Processes.
    quiet : bool
        Show no progress.

    Returns
    -------
    tuple of FaultRow
        In the order of the faults.
    """
    folder = prepared_folder(out)
    sorts = (_NOTHING,) if table == "chain" else (_NOTHING, _CAUSE)
    tasks = [_Task(table, kind, missing, seed, every) for seed in seeds for missing in sorts]
    files = {task: folder / f"{task.name}.json" for task in tasks}
    stages = Stages(len(tasks), quiet)
    with work_executor(workers) as executor:
        running = {
            task: executor.submit(_write_outcomes, task, file) for task, file in files.items()
        }
        for task in tasks:
            with stages.stage(task.name):
                running[task].result()
    outcomes = {task: _read_outcomes(file) for task, file in files.items()}
    if table == "chain":
        rows = tuple(_rows([row for of_task in outcomes.values() for row in of_task], OUTCOMES))
        write_table(folder / f"{kind}.md", _table(kind, rows, OUTCOMES))
        return rows
    rows = tuple(
        row
        for missing in sorts
        for row in _rows(
            [one for task in tasks if task.missing == missing for one in outcomes[task]],
            ANSWERS,
            f", {missing}",
        )
    )
    total = tuple(sum(counts) for counts in zip(*(row.counts for row in rows), strict=True))
    lines = _table(kind, (*rows, FaultRow("all", "", total, ())), ANSWERS)
    write_table(folder / f"{table}-{kind}.md", lines)
    return rows


def _write_outcomes(task: _Task, path: Path) -> None:
    """Outcomes of the faults that do not stand yet in the file of one task."""
    curves = default_curves() if task.kind == "carrier" else None
    faults = _faults(task, curves)
    outcomes = _read_outcomes(path) if path.is_file() else []
    if len(outcomes) == len(faults):
        return
    with single_threaded():
        clean, label = case_campaign(_plan(task))
        first = len(outcomes)
        made = (
            fault_outcomes(clean, faults, task.seed, curves, first=first)
            if task.table == "chain"
            else fault_answers(clean, label, faults, task.seed, curves, first=first)
        )
        for outcome in made:
            outcomes.append(outcome)
            save_json(path, outcomes)


def _faults(task: _Task, curves: Curves) -> tuple[Fault, ...]:
    if task.table == "chain":
        faults = faults_of(task.kind)
    elif task.table == "practice":
        faults = practice_faults(task.kind, curves)
    else:
        faults = unforeseen_faults()
    return faults[task.seed % task.every :: task.every]


def _read_outcomes(path: Path) -> list[Outcome]:
    expected = "outcomes of faults"
    try:
        return [
            Outcome(row["fault"], row["size"], row["outcome"], tuple(row["by"]))
            for row in read_json(path, expected)
        ]
    except (KeyError, TypeError) as error:
        raise ValueError(f"{path}: not {expected}; remove it to make them again") from error


def _plan(task: _Task) -> CasePlan:
    """Case of a check that the faults are put into; of the chain's faults the first."""
    plans = case_plans(task.kind, _CASES, task.seed)
    if task.missing == _NOTHING:
        fitting = [plan for plan in plans if plan.family == NOTHING]
    else:
        fitting = [plan for plan in plans if plan.family == SINGLE and plan.ratio >= _VISIBLE]
    return fitting[0 if task.table == "chain" else task.seed % len(fitting)]


def _rows(
    outcomes: Sequence[Outcome], columns: Sequence[str], note: str = ""
) -> Iterator[FaultRow]:
    for fault, size in dict.fromkeys((row.fault, row.size) for row in outcomes):
        of_fault = [row for row in outcomes if (row.fault, row.size) == (fault, size)]
        results = [row.outcome for row in of_fault]
        counts = tuple(results.count(outcome) for outcome in columns)
        # What moved by how much stands in the files of the seeds.
        texts = (
            text for row in of_fault if row.outcome not in (HARMLESS, SMALL) for text in row.by
        )
        by = {text.partition(" by ")[0]: None for text in texts}
        yield FaultRow(fault, size + note, counts, tuple(by))


def _table(kind: str, rows: Sequence[FaultRow], columns: Sequence[str]) -> Iterator[str]:
    yield f"| {kind}: fault | size | {' | '.join(columns)} | by |"
    yield "|---" * (len(columns) + 3) + "|"
    for row in rows:
        counts = " | ".join(map(str, row.counts))
        yield f"| {row.fault} | {row.size} | {counts} | {', '.join(row.by) or '-'} |"


if __name__ == "__main__":
    import cyclopts

    cyclopts.run(main)
