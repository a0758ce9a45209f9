"""Time until help is shown or a wrong option is reported, beside ``python -c 'import numpy'``.

    python -m benchmarks.start_up [PAIRS]

Whole processes in pairs, one of ours and one of the peer's in turn, so that a machine whose speed
drifts slows both; of all commands the slowest is shown, by wall time and by processor time.
"""

import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from benchmarks.ratio import PROCESSOR_TIME, TIME, Ratio, at_least
from benchmarks.refused_lines import with_unknown_option
from benchmarks.run import run_alone
from carrierflex.workflows.shell.commands import COMMANDS

QUICK = {"pairs": 2}

_OURS = [
    sys.executable,
    "-P",
    "-c",
    "from carrierflex.workflows.command_line import main; main()",
]
_PEER = [sys.executable, "-P", "-c", "import numpy"]
#: Seven times the peer's time: a second where the peer takes 0.15 s.
_WANTED = at_least(1.0 / 7.0)


def ratios(pairs: int = 5) -> Iterator[Ratio]:
    """Version, help and refused options.

    Parameters
    ----------
    pairs
        Runs of each command line and of the peer.
    """
    lines = {
        "--version": [["--version"]],
        "--help": [["--help"]],
        "help of a command": [[name, "--help"] for name in COMMANDS],
        "refused option": list(with_unknown_option()),
    }
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for case, of_case in lines.items():
            yield from _slowest(case, of_case, folder, pairs)


def _slowest(case: str, lines: Sequence[list[str]], folder: Path, pairs: int) -> Iterator[Ratio]:
    """By wall time and by processor time."""
    measured = [(_medians([_OURS + line, _PEER], folder, pairs), line) for line in lines]
    label = case if len(lines) == 1 else f"{case}, slowest of {len(lines)}"
    for number, quantity in enumerate((TIME, PROCESSOR_TIME)):
        times = [(medians[number], peer[number], line) for (medians, peer), line in measured]
        ours, peer, line = max(times, key=lambda entry: entry[0] / entry[1])
        yield Ratio(label, quantity, ours, "import numpy", peer, _WANTED, note=" ".join(line))


def _medians(commands: Iterable[list[str]], folder: Path, pairs: int) -> list[tuple[float, float]]:
    """Median wall time and processor time of each command [s], run in turn."""
    seconds: dict[int, list[tuple[float, float]]] = {}
    for _ in range(pairs):
        for number, command in enumerate(commands):
            seconds.setdefault(number, []).append(_seconds(command, folder))
    return [
        (statistics.median(wall), statistics.median(processor))
        for wall, processor in (zip(*runs, strict=True) for runs in seconds.values())
    ]


def _seconds(command: list[str], folder: Path) -> tuple[float, float]:
    """Wall time and processor time of one process [s]."""
    start = time.perf_counter()
    process = subprocess.Popen(
        command, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    return time.perf_counter() - start, used.ru_utime + used.ru_stime


if __name__ == "__main__":
    run_alone(ratios)
