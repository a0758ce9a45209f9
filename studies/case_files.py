"""Files of a study: a case is computed where its file is missing, and read again for the table."""

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import Any, TypeVar

from carrierflex.files.json_files import read_json
from carrierflex.files.whole_files import whole_file
from carrierflex.workflows.executors import work_executor
from carrierflex.workflows.progress import Stages

Case = TypeVar("Case")
Row = TypeVar("Row")


def make_missing(
    cases: Sequence[Case],
    files: Sequence[Path],
    make: Callable[[Case, Path], None],
    executor: Executor,
    stages: Stages,
) -> None:
    """Make every case whose file is missing, and report the progress.

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
        Shows the progress.
    """
    tasks = [
        executor.submit(make, case, file)
        for case, file in zip(cases, files, strict=True)
        if not file.is_file()
    ]
    for number, task in enumerate(tasks):
        task.result()
        stages.note(f"{number + 1} of {len(tasks)}", (number + 1) / len(tasks))


def seeded_cases(
    folder: Path,
    seed: int,
    cases: int,
    make: Callable[[int, Path], None],
    row_of: Callable[[dict[str, Any]], Row],
    *,
    stages: Stages,
    workers: int,
) -> list[Row]:
    """Make the campaigns of a seed that are missing, and read all of them.

    Parameters
    ----------
    folder : Path
        Folder of their files, ``SEED-NUMBER.json``.
    seed, cases : int
        Seed, and number of campaigns.
    make : callable
        Makes the campaign of a number and writes its file.
    row_of : callable
        Makes the case of a file's content.
    stages : Stages
        Shows the progress.
    workers : int
        Processes.

    Raises
    ------
    ValueError
        Where a file holds something else.
    """
    files = [folder / f"{seed}-{number:03d}.json" for number in range(cases)]
    with stages.stage(f"{cases} campaigns"), work_executor(workers) as executor:
        make_missing(range(cases), files, make, executor, stages)
    return [read_case(file, "a campaign of this study", row_of) for file in files]


def read_case(path: Path, expected: str, row_of: Callable[[dict[str, Any]], Row]) -> Row:
    """Read the case that a study wrote.

    Parameters
    ----------
    path : Path
        Its file.
    expected : str
        What the file holds, for the error.
    row_of : callable
        Makes the case of the file's content.

    Raises
    ------
    ValueError
        Where the file holds something else.
    """
    content = read_json(path, expected)
    try:
        return row_of(content)
    except (KeyError, TypeError) as error:
        raise ValueError(f"{path}: not {expected}; remove it to make it again") from error


def write_table(path: Path, lines: Iterable[str]) -> None:
    """Write the lines of a table, all or none.

    Parameters
    ----------
    path : Path
        File.
    lines : iterable of str
        Lines without their ends.
    """
    with whole_file(path) as file:
        file.write_text("\n".join(lines) + "\n", encoding="utf-8")
