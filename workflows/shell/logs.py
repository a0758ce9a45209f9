"""Where what is logged goes: to the screen with --verbose, to the file of --log-file."""

import logging
import re
from collections.abc import Callable, Mapping
from pathlib import Path

_PROJECT = "carrierflex"
#: How a log begins: time, level and a logger of this project.
_FIRST_LINE = re.compile(rb"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d,\d{3} [A-Z]+ carrierflex[.\w]*: ")
_LONGEST_HEAD = 200
#: Marks a record whose text stands on the screen in another way: progress, results, the last line.
SHOWN: Mapping[str, bool] = {"shown": True}


def show_errors() -> None:
    """Show what is logged as an error, of libraries too."""
    _to_screen(logging.getLogger(), logging.ERROR, lambda record: not _is_shown(record))


def say_more() -> None:
    """Show what the packages of this project log."""
    log = logging.getLogger(_PROJECT)
    # Errors have their handler already.
    _to_screen(
        log, logging.INFO, lambda record: record.levelno < logging.ERROR and not _is_shown(record)
    )
    log.setLevel(logging.INFO)


def log_into(path: Path) -> None:
    """Add all that this project logs, progress and results too, to a file.

    Raises
    ------
    OSError
        Where it cannot be written, or holds something else than a log of this program.
    """
    from carrierflex.files.whole_files import check_file_writable

    check_file_writable(path)
    _refuse_other_content(path)
    handler = logging.FileHandler(path, encoding="utf-8")
    handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(name)s: %(message)s"))
    log = logging.getLogger(_PROJECT)
    log.addHandler(handler)
    log.setLevel(logging.DEBUG)


def _refuse_other_content(path: Path) -> None:
    """Lines at the end of a measurement would destroy it."""
    if not path.exists():
        return
    if not path.is_file():
        raise OSError(f"--log-file {path}: no file; expected the name of a log file")
    with path.open("rb") as file:
        begin = file.read(_LONGEST_HEAD)
    if begin and not _FIRST_LINE.match(begin):
        raise FileExistsError(
            f"--log-file {path}: exists and is no log of carrierflex; nothing is added to it: "
            "choose another name"
        )


def _to_screen(
    log: logging.Logger, level: int, is_told: Callable[[logging.LogRecord], bool]
) -> None:
    handler = logging.StreamHandler()
    handler.setLevel(level)
    handler.setFormatter(logging.Formatter("%(name)s: %(message)s"))
    handler.addFilter(is_told)
    log.addHandler(handler)


def _is_shown(record: logging.LogRecord) -> bool:
    return getattr(record, "shown", False)
