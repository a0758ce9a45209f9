"""Time that long commands say is left, beside the time that was left.

    python -m benchmarks.remaining_time [COMMAND ...]

Each command runs once, in a process of its own; five times a second what a terminal would show is
noted. No peer: the truth is the clock. docs/commands.md holds the table; wanted are deviations of
at most 30 % from half way on, and nothing shown rather than more.
"""

import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from carrierflex.simulation.carrier.case_files import shipped_case

#: Shares of a command's duration at which estimate and truth are compared.
SHARES = (0.5, 0.6, 0.7, 0.8, 0.9)
#: Words by command; a later one may read what an earlier one wrote.
LINES: Mapping[str, Sequence[str]] = {
    "simulate": ("simulate", str(shipped_case()), "--out", "campaign"),
    "simulate a stage": ("simulate", str(shipped_case("stage_lc1")), "--out", "stage"),
    "identify": ("identify", "campaign", "--model", "m2", "--out", "identified"),
    "diagnose": ("diagnose", "campaign", "--out", "gap"),
    "curves": ("curves", "--out", "curves", "--no-cache"),
    "reduce": ("reduce", "--body", "carrier", "--out", "c.h5", "--no-cache"),
    "run": ("run", "--out", "job"),
    "blind-check": ("blind-check", "--out", "check", "--kind", "element", "--cases", "12"),
}
#: Runs a command and notes time and estimate [s] of the first set of stages, the command's own.
_PROGRAM = """
import json, sys, threading, time
from pathlib import Path
from carrierflex.workflows import progress
made, noted, begun = [], [], float(sys.argv[1])
initialise = progress.Stages.__init__
def kept(self, *values, **named):
    initialise(self, *values, **named)
    made.append(self)
progress.Stages.__init__ = kept
def look():
    while True:
        if made:
            noted.append((time.time() - begun, made[0].remaining))
        time.sleep(0.2)
threading.Thread(target=look, daemon=True).start()
from carrierflex.workflows.command_line import main
log = Path(sys.argv[2])
sys.argv = ["carrierflex", *sys.argv[3:]]
try:
    main()
finally:
    log.write_text(json.dumps([noted, made[0].seconds]))
"""


@dataclass(frozen=True, eq=False)
class Watched:
    """One command: its duration [s], what it showed when [s], and the time of its stages [s]."""

    seconds: float
    shown: list[tuple[float, float | None]]
    stages: dict[str, float]

    def at(self, share: float) -> tuple[float | None, float]:
        """What was shown last at a share of the duration, and what was left then [s]."""
        now = share * self.seconds
        before = [remaining for when, remaining in self.shown if when <= now]
        return (before[-1] if before else None), self.seconds - now


def watched(line: Sequence[str], folder: Path) -> Watched:
    """Run a command and note what it shows.

    Parameters
    ----------
    line
        Its words.
    folder
        Where it runs.

    Raises
    ------
    subprocess.CalledProcessError
        Where it was refused; a check that is not met is no refusal.
    """
    log = folder / "shown.json"
    begun = time.time()
    done = subprocess.run(
        [sys.executable, "-P", "-c", _PROGRAM, str(begun), str(log), *line],
        cwd=folder,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    seconds = time.time() - begun
    if done.returncode not in (0, 1):
        raise subprocess.CalledProcessError(done.returncode, list(line))
    shown, stages = json.loads(log.read_text())
    return Watched(seconds, shown, stages)


def row(name: str, result: Watched) -> str:
    """Duration and deviations of one command as a line of the table."""
    cells = []
    for share in SHARES:
        said, remaining = result.at(share)
        cells.append("none" if said is None else f"{100.0 * (said / remaining - 1.0):+.0f} %")
    return f"| {name} | {result.seconds:.0f} s | {' | '.join(cells)} |"


def main(names: Sequence[str] = ()) -> None:
    """Print the table, and below it the seconds of every stage.

    Parameters
    ----------
    names
        Commands; all without.
    """
    print(f"| command | lasts | {' | '.join(f'{share:.0%}' for share in SHARES)} |")
    print("|" + "---|" * (2 + len(SHARES)))
    stages = []
    with tempfile.TemporaryDirectory() as folder:
        for name in names or LINES:
            result = watched(LINES[name], Path(folder))
            print(row(name, result), flush=True)
            stages += [f"{name}: {stage}: {of:.2f} s" for stage, of in result.stages.items()]
    print("\n".join(["", *stages]))


if __name__ == "__main__":
    main(sys.argv[1:])
