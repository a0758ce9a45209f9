"""A command line as a process of its own: what it says while it works, and its end.

The page runs the lines that it shows, so its files have the bytes that the shell's have.
"""

import asyncio
import re
import shlex
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

#: Words of the program; -P: no file of the work folder is imported.
_PROGRAM = (sys.executable, "-P", "-m", "carrierflex.workflows.command_line")
_STAGE = re.compile(r"\[(\d+)/(\d+)\] (.*)")
_REFUSAL = "carrierflex: "
Table = tuple[str, list[list[str]]]


class Ended(NamedTuple):
    """How a command ended: what it showed, notes, and its one line where it refused."""

    tables: list[Table]
    notes: list[str]
    refusal: str


class CalledLine:
    """Runs one command line at a time in a folder."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._process: asyncio.subprocess.Process | None = None
        self.is_busy = False

    def end(self) -> None:
        """Ask a running command to end; it removes what it has not finished."""
        if self._process is not None and self._process.returncode is None:
            self._process.terminate()

    async def call(self, words: Sequence[str], note: Callable[[str, float | None], None]) -> Ended:
        """Run a command to its end.

        Parameters
        ----------
        words : sequence of str
            Its words without the program's name.
        note : function of (str, float or None)
            Called with what it says, and the share of its stages that has ended.

        """
        self.is_busy = True
        pipe = asyncio.subprocess.PIPE
        try:
            self._process = process = await asyncio.create_subprocess_exec(
                *_PROGRAM, *words, cwd=self._folder, limit=1 << 24,
                stdin=asyncio.subprocess.DEVNULL, stdout=pipe, stderr=pipe,
            )  # fmt: skip
            assert process.stdout is not None
            assert process.stderr is not None
            reading = _notes(process.stderr, note)
            output, notes = await asyncio.gather(process.stdout.read(), reading)
            code = await process.wait()
        finally:
            self.end()
            self._process, self.is_busy = None, False
        refusals = [line.removeprefix(_REFUSAL) for line in notes if line.startswith(_REFUSAL)]
        if code not in (0, 1) and not refusals:
            refusals = [notes.pop() if notes else f"ended with exit code {code}"]
        notes = [line for line in notes if not line.startswith(_REFUSAL)]
        return Ended(_tables_in(output.decode("utf-8", "replace")), notes, "".join(refusals))


async def _notes(
    stream: asyncio.StreamReader, note: Callable[[str, float | None], None]
) -> list[str]:
    """Lines of standard error that are no stages; all are noted."""
    lines = []
    async for raw in stream:
        line = raw.decode("utf-8", "replace").strip()
        if match := _STAGE.fullmatch(line):
            note(match[3], int(match[1]) / int(match[2]))
        elif line:
            lines.append(line)
            note(line, None)
    return lines


def shell_line(words: Sequence[str]) -> str:
    """The line as a shell takes it.

    Examples
    --------
    >>> shell_line(["check", "my campaign"])
    "carrierflex check 'my campaign'"
    """
    return shlex.join(["carrierflex", *words])


def _tables_in(output: str) -> list[Table]:
    r"""Title and rows of the tables that a command shows; columns stand two blanks apart."""
    tables: list[tuple[str, list[str]]] = []
    for line in filter(str.strip, output.splitlines()):
        if "  " in line.strip() and tables:
            tables[-1][1].append(line)
        else:
            tables.append((line.strip(), []))
    return [(title, _cells(lines)) for title, lines in tables]


def _cells(lines: Sequence[str]) -> list[list[str]]:
    width = max(map(len, lines), default=0)
    padded = [line.ljust(width) for line in lines]
    signs = "".join(" " if {line[i] for line in padded} == {" "} else "x" for i in range(width))
    spans = [match.span() for match in re.finditer(r"x+(?: x+)*", signs)]
    return [[line[begin:end].strip() for begin, end in spans] for line in padded]
