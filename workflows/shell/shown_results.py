"""A command's result: a table on the screen, or JSON for programs; both into the log file."""

import importlib
import io
import json
import logging
import os
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, TypedDict

from carrierflex.workflows.shell.commands import Command
from carrierflex.workflows.shell.logs import SHOWN
from carrierflex.workflows.shell.shared_options import SharedOptions

#: Exit code where a check failed.
EXIT_FAILED = 1
#: Columns where the output is no terminal: more than any row has.
_WIDTH_OF_A_PIPE = 10_000
#: Longer arrays are told by their shape and range.
_MOST_NUMBERS = 100
#: Options that name what a command reads are left out of what it wrote.
_WRITTEN = ("out", "save_law", "loads", "linearised", "sealed_campaigns")

log = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class Done:
    """A command that has ended: options as given, result, and its start [s since 1970]."""

    name: str
    command: Command
    given: Mapping[str, Any]
    result: Any
    started: float

    @property
    def paths(self) -> dict[str, Path]:
        """Options that name one file or folder."""
        return {key: value for key, value in self.given.items() if isinstance(value, Path)}


def show(done: Done, shared: SharedOptions) -> None:
    """Show the result, and end with exit code 1 where its checks are not met."""
    if shared.json:
        # Late: it needs numpy, for which help does not wait.
        from carrierflex.files.json_files import plain

        print(json.dumps(plain(document(done)), indent=2, ensure_ascii=False))
    if not shared.quiet and not shared.json:
        _print(done)
    if shared.log_file is not None:
        log.info("%s ended\n%s", done.name, _as_text(done), extra=SHOWN)
    if not is_met(done.result):
        sys.exit(EXIT_FAILED)


def is_met(result: Any) -> bool:
    """Whether all checks of a result are met; one without checks counts as met."""
    return bool(getattr(result, "met", True))


def document(done: Done) -> dict[str, Any]:
    """What --json prints: the command's document where it writes one, its figures elsewhere."""
    from carrierflex.files.versions import software_name

    written = sorted(str(path) for path in _written(done))
    file = done.command.document and done.paths.get("out", Path()) / done.command.document
    if file and str(file) in written:
        result = json.loads(file.read_text(encoding="utf-8"))
    else:
        result = figures(done.result)
    return {
        "format": "carrierflex-result",
        "version": 1,
        "software": software_name(),
        "command": done.name,
        "given": figures(done.given),
        "exit_code": 0 if is_met(done.result) else EXIT_FAILED,
        "met": is_met(done.result),
        "seconds": round(time.time() - done.started, 3),
        "written": written,
        "result": result,
    }


def show_refusal(name: str | None, message: str, code: int) -> None:
    """Print what --json prints of a command that was refused or interrupted."""
    from carrierflex.files.versions import software_name

    refusal = {
        "format": "carrierflex-refusal",
        "version": 1,
        "software": software_name(),
        "command": name,
        "exit_code": code,
        "error": message,
    }
    print(json.dumps(refusal, indent=2, ensure_ascii=False))


def figures(value: Any) -> Any:
    """Figures of a result: fields by name; long arrays by shape, smallest and largest value."""
    # Late: a schema or a script is shown without.
    import numpy as np

    if is_dataclass(value) and not isinstance(value, type):
        return {field.name: figures(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, Mapping):
        return {str(key): figures(item) for key, item in value.items()}
    if isinstance(value, np.ndarray) and value.size > _MOST_NUMBERS:
        return _range(value)
    if isinstance(value, (list, tuple)):
        return [figures(item) for item in value]
    if isinstance(value, frozenset):
        return [figures(item) for item in sorted(value)]
    known = (str, int, float, bool, Path, np.generic, np.ndarray, type(None))
    # What is neither a number nor made of numbers (matrices, functions) is told by its kind.
    return value if isinstance(value, known) else type(value).__name__


def _range(array: Any) -> dict[str, Any]:
    described: dict[str, Any] = {"shape": list(array.shape)}
    if array.dtype.kind in "fiu":
        described |= {"smallest": array.min(), "largest": array.max()}
    return described


def _written(done: Done) -> Iterator[Path]:
    """Files that the command wrote, in the folders and files that its options name."""
    for name in _WRITTEN:
        path = done.paths.get(name)
        if path is None:
            continue
        for file in path.rglob("*") if path.is_dir() else [path]:
            # File systems keep times to some milliseconds.
            if file.is_file() and file.stat().st_mtime >= done.started - 0.01:
                yield file


def _renderable(done: Done) -> Any:
    module, function = done.command.table.split(":")
    tables = importlib.import_module(f"carrierflex.workflows.screen.{module}")
    return getattr(tables, function)(done.result)


def _print(done: Done) -> None:
    from rich.console import Console
    from rich.text import Text

    if not sys.stdout.isatty() and "COLUMNS" not in os.environ:
        print(_as_text(done))
        return
    # Names in square brackets are names, no markup.
    console = Console(highlight=False, markup=False)
    shown = _renderable(done)
    # A path longer than the line goes on in the next one; cut off, it would name no file.
    try:
        console.print(shown, soft_wrap=isinstance(shown, Text), crop=False)
    except SystemExit as end:
        # Rich ends the process where nobody reads on; the command line says with which code.
        raise BrokenPipeError from end


def _as_text(done: Done) -> str:
    """The table as plain text of any width."""
    # A pipe has no edge at which a table would be cut, or a schema broken, and none to fill up to.
    from rich.console import Console
    from rich.text import Text

    aside = io.StringIO()
    console = Console(file=aside, record=True, markup=False, width=_WIDTH_OF_A_PIPE)
    shown = _renderable(done)
    console.print(shown, soft_wrap=isinstance(shown, Text))
    return "\n".join(line.rstrip() for line in console.export_text().splitlines())


class Range(TypedDict):
    """A long array."""

    shape: Annotated[Sequence[int], "Shape"]
    smallest: Annotated[float, "Smallest value"]
    largest: Annotated[float, "Largest value"]


class CommandResult(TypedDict):
    """What a command that has ended prints."""

    format: Annotated[Literal["carrierflex-result"], "Kind of the document"]
    version: Annotated[Literal[1], "Version of the format"]
    software: Annotated[str, "Name and version of this software"]
    command: Annotated[str, "Name of the command"]
    given: Annotated[Mapping[str, Any], "Its options as they were given, by name"]
    exit_code: Annotated[Literal[0, 1], "0; 1 where a check is not met"]
    met: Annotated[bool, "Whether all checks are met"]
    seconds: Annotated[float, "Time it took [s]"]
    written: Annotated[Sequence[str], "Files that it wrote"]
    result: Annotated[Any, "Its own document where it writes one; its figures otherwise"]


class CommandRefusal(TypedDict):
    """What a command that was refused, or interrupted, prints."""

    format: Annotated[Literal["carrierflex-refusal"], "Kind of the document"]
    version: Annotated[Literal[1], "Version of the format"]
    software: Annotated[str, "Name and version of this software"]
    command: Annotated[str | None, "Name of the command; null where there is none of that name"]
    exit_code: Annotated[Literal[2, 130, 143], "2 refused, 130 interrupted, 143 terminated"]
    error: Annotated[str, "What is wrong, what was found and what is expected, in one line"]
