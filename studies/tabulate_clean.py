"""How often a campaign without a fault is warned about: 200 of them, by kind and sort.

Writes CASE.json for every campaign, which a later call takes up, and clean.md. A good answer: at
most two per cent with a finding, and no verdict changed, unless into a tie with the truth.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path

from carrierflex.files.json_files import save_json
from carrierflex.identification.estimation.single_thread import single_threaded
from carrierflex.workflows.executors import work_executor
from carrierflex.workflows.fe.default_curves import default_curves
from carrierflex.workflows.outputs import prepared_folder
from carrierflex.workflows.progress import Stages
from studies.case_files import make_missing, read_case, write_table
from studies.clean_campaigns import (
    SORTS,
    CleanCase,
    CleanOutcome,
    clean_cases,
    clean_outcome,
)


def main(
    *, out: Path, seed: int = 1, workers: int = 1, quiet: bool = False
) -> tuple[CleanOutcome, ...]:
    """Check 200 campaigns without a fault.

    Parameters
    ----------
    out : Path
        Folder for the outcomes and the table; campaigns that stand there are not done again.
    seed : int
        Seed of the campaigns.
    workers : int
        Processes.
    quiet : bool
        Show no progress.

    Returns
    -------
    tuple of CleanOutcome
        Campaigns with a finding.
    """
    folder = prepared_folder(out)
    cases = list(clean_cases(seed))
    files = [folder / f"{seed}-{number:03d}.json" for number in range(len(cases))]
    stages = Stages(1, quiet)
    with stages.stage("checking the campaigns"), work_executor(workers) as executor:
        make_missing(cases, files, _write_outcome, executor, stages)
    outcomes = [_read_outcome(file) for file in files]
    write_table(folder / "clean.md", _table(outcomes))
    return tuple(outcome for outcome in outcomes if outcome.findings)


def _write_outcome(case: CleanCase, path: Path) -> None:
    curves = default_curves() if case.plan.kind == "carrier" else None
    with single_threaded():
        outcome = clean_outcome(case, curves)
    save_json(path, outcome)


def _read_outcome(path: Path) -> CleanOutcome:
    return read_case(
        path,
        "the outcome of a campaign",
        lambda row: CleanOutcome(
            row["case"],
            row["kind"],
            row["sort"],
            tuple(row["findings"]),
            row["change"],
            row["is_tie"],
        ),
    )


def _table(outcomes: Sequence[CleanOutcome]) -> Iterator[str]:
    columns = ("tried", "with a finding", "verdicts changed", "into a tie with the truth")
    yield f"| kind | campaigns with | {' | '.join(columns)} | findings |"
    yield "|---" * 7 + "|"
    kinds = dict.fromkeys(outcome.kind for outcome in outcomes)
    groups = [
        (
            kind,
            sort,
            [case for case in outcomes if (case.kind, case.sort) == (kind, sort)],
        )
        for kind in kinds
        for sort in SORTS
    ]
    for kind, sort, members in [*groups, ("all", "all", list(outcomes))]:
        reported = [case for case in members if case.findings]
        changed = sum(bool(case.change) for case in members)
        tied = sum(case.is_tie for case in members)
        names = ", ".join(sorted({name for case in reported for name in case.findings})) or "-"
        counts = (len(members), len(reported), changed, tied)
        yield f"| {kind} | {sort} | {' | '.join(map(str, counts))} | {names} |"


if __name__ == "__main__":
    import cyclopts

    cyclopts.run(main)
