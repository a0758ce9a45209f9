"""Cases of a study that are made where their files do not stand yet."""

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import TypeVar

from carrierflex.workflows.support.progress import Stages

Case = TypeVar("Case")


def make_missing(
    cases: Sequence[Case],
    files: Sequence[Path],
    make: Callable[[Case, Path], None],
    executor: Executor,
    stages: Stages,
) -> None:
    """Make every case whose file does not stand, and tell how many are made.

    Parameters
    ----------
    cases : sequence
        Cases.
    files : sequence of Path
        Their files.
    make : callable
        Makes a case and writes its file.
    executor : concurrent.futures.Executor
        Where cases are made.
    stages : Stages
        Is told the progress.
    """
    tasks = [
        executor.submit(make, case, file)
        for case, file in zip(cases, files, strict=True)
        if not file.is_file()
    ]
    for number, task in enumerate(tasks):
        task.result()
        stages.note(f"{number + 1} of {len(tasks)}", (number + 1) / len(tasks))
