"""Which faults of a measuring chain are noticed: one row a fault and size, over seeds.

Campaigns of the blind check with nothing missing get one fault each; what counts as told stands in
:mod:`studies.fault_outcomes`. Writes KIND-SEED.json for every seed, fault by
fault, which a later call takes up, and KIND.md. A good answer: nothing missed.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from carrierflex.blind_check.case_plans import case_plans
from carrierflex.blind_check.labels import NOTHING, CasePlan
from carrierflex.blind_check.truth.campaigns import case_campaign
from carrierflex.files.json_files import read_json, save_json
from carrierflex.identification.estimation.single_thread import single_threaded
from carrierflex.workflows.executors import work_executor
from carrierflex.workflows.fe.default_curves import default_curves
from carrierflex.workflows.outputs import prepared_folder
from carrierflex.workflows.progress import Stages
from studies.case_files import write_table
from studies.fault_outcomes import HARMLESS, OUTCOMES, Outcome, fault_outcomes
from studies.fault_table import faults_of

#: Cases of a plan that holds some with nothing missing.
_CASES = 60

Kind = Literal["carrier", "mounting", "element"]


@dataclass(frozen=True)
class FaultRow:
    """A fault of one size: how often it had each of the `OUTCOMES`, and by what."""

    fault: str
    size: str
    counts: tuple[int, ...]
    by: tuple[str, ...]


def main(
    *,
    out: Path,
    kind: Kind,
    seeds: Sequence[int] = tuple(range(1, 11)),
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
    seeds : sequence of int
        Seeds of the campaigns.
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
    files = {seed: folder / f"{kind}-{seed}.json" for seed in seeds}
    stages = Stages(len(seeds), quiet)
    with work_executor(workers) as executor:
        tasks = {
            seed: executor.submit(_write_outcomes, kind, seed, file) for seed, file in files.items()
        }
        for seed in seeds:
            with stages.stage(f"{kind}, seed {seed}"):
                tasks[seed].result()
    outcomes = [outcome for file in files.values() for outcome in _read_outcomes(file)]
    rows = tuple(_rows(kind, outcomes))
    write_table(folder / f"{kind}.md", _table(kind, rows))
    return rows


def _write_outcomes(kind: str, seed: int, path: Path) -> None:
    """Outcomes of the faults that do not stand yet in the file of one seed."""
    faults = faults_of(kind)
    outcomes = _read_outcomes(path) if path.is_file() else []
    if len(outcomes) == len(faults):
        return
    curves = default_curves() if kind == "carrier" else None
    with single_threaded():
        clean = case_campaign(_without_effect(kind, seed))[0]
        for outcome in fault_outcomes(clean, faults, seed, curves, first=len(outcomes)):
            outcomes.append(outcome)
            save_json(path, outcomes)


def _read_outcomes(path: Path) -> list[Outcome]:
    expected = "outcomes of faults"
    try:
        return [
            Outcome(row["fault"], row["size"], row["outcome"], tuple(row["by"]))
            for row in read_json(path, expected)
        ]
    except (KeyError, TypeError) as error:
        raise ValueError(f"{path}: not {expected}; remove it to make them again") from error


def _without_effect(kind: str, seed: int) -> CasePlan:
    """First case of a check with nothing missing."""
    plans = case_plans(kind, _CASES, seed)
    return next(plan for plan in plans if plan.family == NOTHING)


def _rows(kind: str, outcomes: Sequence[Outcome]) -> Iterator[FaultRow]:
    for fault in faults_of(kind):
        of_fault = [row for row in outcomes if (row.fault, row.size) == (fault.name, fault.size)]
        results = [row.outcome for row in of_fault]
        counts = tuple(results.count(outcome) for outcome in OUTCOMES)
        # What moved by how much stands in the files of the seeds.
        texts = (text for row in of_fault if row.outcome != HARMLESS for text in row.by)
        by = {text.partition(" by ")[0]: None for text in texts}
        yield FaultRow(fault.name, fault.size, counts, tuple(by))


def _table(kind: str, rows: Sequence[FaultRow]) -> Iterator[str]:
    yield f"| {kind}: fault | size | {' | '.join(OUTCOMES)} | by |"
    yield "|---" * (len(OUTCOMES) + 3) + "|"
    for row in rows:
        counts = " | ".join(map(str, row.counts))
        yield f"| {row.fault} | {row.size} | {counts} | {', '.join(row.by) or '-'} |"


if __name__ == "__main__":
    import cyclopts

    cyclopts.run(main)
