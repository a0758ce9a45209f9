"""Time until help is shown or a mistake is told, beside ``python -c 'import numpy'``.

    python -m benchmarks.start_up [PAIRS]

Whole processes in pairs, one of ours and one of the peer's in turn, so that a machine whose speed
drifts slows both; of all commands the slowest is shown.
"""

import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from benchmarks.ratio import TIME, Ratio, at_least
from benchmarks.refused_lines import with_bad_toml, with_unknown_option, write_bad_files
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
#: Twice the peer's time is half its speed.
_WANTED = at_least(0.5)


def ratios(pairs: int = 5) -> Iterator[Ratio]:
    """Version, help and refusals.

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
        "refused TOML": list(with_bad_toml()),
    }
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_bad_files(folder)
        for case, of_case in lines.items():
            yield _slowest(case, of_case, folder, pairs)


def _slowest(case: str, lines: Sequence[list[str]], folder: Path, pairs: int) -> Ratio:
    measured = []
    for line in lines:
        ours, peer = _medians([_OURS + line, _PEER], folder, pairs)
        measured.append((ours / peer, ours, peer, line))
    _, ours, peer, line = max(measured)
    told = case if len(lines) == 1 else f"{case}, slowest of {len(lines)}"
    return Ratio(told, TIME, ours, "import numpy", peer, _WANTED, note=" ".join(line))


def _medians(commands: Iterable[list[str]], folder: Path, pairs: int) -> list[float]:
    """Median wall time of each command [s], run in turn."""
    seconds: dict[int, list[float]] = {}
    for _ in range(pairs):
        for number, command in enumerate(commands):
            start = time.perf_counter()
            subprocess.run(command, cwd=folder, capture_output=True, check=False)
            seconds.setdefault(number, []).append(time.perf_counter() - start)
    return [statistics.median(own) for own in seconds.values()]


if __name__ == "__main__":
    run_alone(ratios)
