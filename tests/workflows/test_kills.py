"""Commands killed at random moments: nothing damaged, nothing lost, no litter after the next run.

``make acceptance`` kills 200 times before the end (KILLS: another number; KILLED_COMMANDS: names of
some commands with commas between) and prints a table. Commands run in copies of this process, which
start at once.
"""

import importlib
import json
import os
import random
import shutil
import signal
import sys
import time
import traceback
from collections import Counter
from dataclasses import dataclass, field

import numpy as np
import pytest

from carrierflex.fe.curve_files import read_curves
from carrierflex.identification.campaign.campaign_files import read_campaign
from carrierflex.reduction.body_files import read_body
from carrierflex.simulation.carrier.case_files import shipped_case
from carrierflex.workflows import command_line
from carrierflex.workflows.shell import commands

pytestmark = pytest.mark.acceptance

KILLS = int(os.environ.get("KILLS", "200"))
#: Tries for every kill: on a busy machine a command may end before it is hit.
TRIES = 4
#: Most are SIGKILL, which no program can answer.
SIGNALS = (*[signal.SIGKILL] * 6, signal.SIGTERM, signal.SIGINT)
#: Command lines by name; they take what `prepared` writes, or what a command before them wrote.
COMMANDS = {
    "new-campaign": [
        "new-campaign", "--kind", "element", "--drive", "force", "--from", "log.csv",
        "--out", "map.toml",
    ],
    "import": ["import", "log.csv", "--map", "map_before.toml", "--out", "imported"],
    "simulate carrier": ["simulate", str(shipped_case()), "--out", "carrier"],
    "simulate mounting": ["simulate", str(shipped_case("mounting_2011")), "--out", "mounting"],
    "simulate parquet": [
        "simulate", str(shipped_case("mounting_2011")), "--parquet", "--out", "parquet",
    ],
    "identify": ["identify", "campaign", "--model", "m2", "--out", "identified"],
    "diagnose": ["diagnose", "campaign", "--out", "diagnosed"],
    "batch": ["batch", "campaign", "--out", "fleet"],
    "mesh": ["mesh", "--variant", "flexible", "--size", "0.06", "--out", "carrier.msh"],
    "curves": ["curves", "--size", "0.08", "--out", "curves"],
    "reduce": ["reduce", "--body", "pin", "--size", "0.06", "--modes", "4", "--out", "pin.h5"],
    "export": ["export", "pin_before.h5", "--format", "op4", "--out", "pin.op4"],
    "export simscape": ["export", "pin_before.h5", "--format", "simscape", "--out", "pin.mat"],
    "cad": ["cad", "--out", "cad"],
    "export of another": ["export", "given.op4", "--format", "body", "--out", "given.h5"],
    "gear-life": ["study", "gear-life", "--out", "life"],
    "order-one": ["study", "order-one", "--out", "order_one"],
    "plan": ["plan", "carrier_lc1_to_lc4", "--out", "plan"],
    "cases": ["cases", "--out", "cases"],
    "fmu": ["fmu", "--out", "mounting.fmu"],
    "report": ["report", "diagnosed", "--out", "page.html"],
    "compare": ["compare", "diagnosed", "diagnosed", "--out", "change"],
    "view": ["view", "diagnosed", "--html"],
    "watch": [
        "watch", "records", "--baseline", "diagnosed", "--campaign", "campaign", "--once",
        "--out", "watched",
    ],
    "calibrate": ["calibrate", "campaign", "--size", "0.09", "--out", "calibration"],
    "loads": ["loads", "campaign", "--body", "carrier.h5", "--draws", "600", "--out", "loads"],
    "blind-check": [
        "blind-check", "--kind", "element", "--cases", "2", "--out", "checked",
    ],
}  # fmt: skip
CHOSEN = set(os.environ.get("KILLED_COMMANDS", ",".join(COMMANDS)).split(","))


@dataclass
class Tally:
    """What one command's kills did."""

    counts: Counter[str] = field(default_factory=Counter)
    examples: list[str] = field(default_factory=list)

    def add(self, column, names):
        self.counts[column] += len(names)
        self.examples += [f"{column}: {name}" for name in names]


class Copy:
    """A command in a copy of this process, in a session of its own."""

    def __init__(self, line, folder):
        self.errors = folder.parent / f"{folder.name} errors"
        self.returncode = None
        self.pid = os.fork()
        if self.pid == 0:
            self._run(line, folder)

    def _run(self, line, folder):
        os.setsid()
        os.chdir(folder)
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        os.dup2(os.open(self.errors, os.O_WRONLY | os.O_CREAT | os.O_TRUNC), 2)
        sys.stdout, sys.stderr = open(1, "w", closefd=False), open(2, "w", closefd=False)
        os.environ["CARRIERFLEX_CACHE"] = str(folder / "cache")
        sys.argv = ["carrierflex", *line]
        code = 0
        try:
            command_line.main()
        except SystemExit as end:
            code = end.code if isinstance(end.code, int) else int(end.code is not None)
        except BaseException:
            code = 99
            traceback.print_exc()
        sys.stderr.flush()
        os._exit(code)

    def poll(self):
        """Exit code, negative of a signal; None while it runs."""
        if self.returncode is None:
            pid, status = os.waitpid(self.pid, os.WNOHANG)
            if pid:
                self.returncode = os.waitstatus_to_exitcode(status)
        return self.returncode

    def wait(self, seconds=1200.0):
        """What it printed as errors when it has ended."""
        end = time.monotonic() + seconds
        while self.poll() is None:
            assert time.monotonic() < end, "no end"
            time.sleep(0.01)
        return self.errors.read_text(errors="replace")


def started(name, folder):
    return Copy(COMMANDS[name], folder)


def standing(folder):
    """Files that a user sees, with their content; the cache may forget what it holds."""
    return {
        path.relative_to(folder): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
        and not any(name.startswith(".") for name in path.parts)
        and path.relative_to(folder).parts[0] != "cache"
    }


def litter(folder):
    return [path for path in folder.rglob(".*") if path.name.startswith((".part-", ".old-"))]


def damage(folder):
    """Files that cannot be read as what they are."""
    readers = {
        ".json": lambda path: json.loads(path.read_text()),
        ".h5": read_body,
        ".toml": lambda path: path.name != "campaign.toml" or read_campaign(path.parent),
        ".png": lambda path: path.read_bytes()[-12:].index(b"IEND"),
        ".html": lambda path: path.read_text().index("</html>"),
        ".msh": lambda path: path.read_text(encoding="latin-1").rindex("$End"),
        ".step": lambda path: path.read_text().index("END-ISO-10303-21"),
    }
    result = []
    for relative in standing(folder):
        path = folder / relative
        read = read_curves if path.name == "deflection_curves.csv" else readers.get(path.suffix)
        try:
            if read is not None:
                read(path)
        except (ValueError, OSError):
            result.append(relative)
    return result


def finished(line, folder):
    """Run a command to its end; how long that takes [s]."""
    begin = time.monotonic()
    process = Copy(line, folder)
    errors = process.wait()
    assert process.returncode in (0, 1), errors
    return time.monotonic() - begin


@pytest.fixture(scope="module")
def prepared(tmp_path_factory):
    """Folder in which every command has run once, and how long each takes [s]."""
    folder = tmp_path_factory.mktemp("kills")
    for command in commands.COMMANDS.values():
        importlib.import_module(f"carrierflex.workflows.{command.workflow}")
    finished(["simulate", str(shipped_case()), "--out", "campaign"], folder)
    write_log(folder / "log.csv")
    (folder / "records").mkdir()
    shutil.copyfile(folder / "campaign" / "LC1.csv", folder / "records" / "LC1.csv")
    if CHOSEN & {"loads"}:
        line = "reduce --body carrier --variant flexible --size 0.09 --modes 4 --out carrier.h5"
        finished(line.split(), folder)
    seconds = {}
    for name in COMMANDS:
        if name not in CHOSEN and name not in ("new-campaign", "reduce", "diagnose"):
            continue
        seconds[name] = finished(COMMANDS[name], folder)
        if name == "new-campaign":
            shutil.copyfile(folder / "map.toml", folder / "map_before.toml")
        if name == "reduce":
            shutil.copyfile(folder / "pin.h5", folder / "pin_before.h5")
            line = "export pin_before.h5 --format op4 --out given.op4"
            finished(line.split(), folder)
    return folder, seconds


def write_log(path):
    time_s = 0.01 * np.arange(400)
    columns = (time_s, 1e3 * np.sin(5.0 * time_s), 2.0 * np.sin(5.0 * time_s - 0.1))
    rows = [";".join(map(repr, map(float, row))) for row in zip(*columns, strict=True)]
    path.write_text("Time;Force;Displacement\ns;N;mm\n" + "\n".join(rows) + "\n")


def make_work(name, folder):
    """Take away what would spare a command its work: finished cases, and the cache."""
    if name == "new-campaign":
        (folder / "map.toml").unlink(missing_ok=True)
    # A picture of the diagnosis that is replaced goes with it.
    if name == "diagnose":
        (folder / "diagnosed" / "view.html").unlink(missing_ok=True)
    # What a measurement is, and what a user may have changed, is not written twice.
    if name in ("import", "cases"):
        shutil.rmtree(folder / {"import": "imported"}.get(name, name), ignore_errors=True)
    if name == "blind-check":
        shutil.rmtree(folder / "checked", ignore_errors=True)
    if name == "batch":
        shutil.rmtree(folder / "fleet", ignore_errors=True)
    if name == "watch":
        shutil.rmtree(folder / "watched", ignore_errors=True)
    if name in ("reduce", "curves"):
        shutil.rmtree(folder / "cache", ignore_errors=True)


def is_killed(process, number, wait):
    """Send a signal after a wait [s]; whether the command was hit before its end."""
    time.sleep(wait)
    if process.poll() is None:
        os.killpg(process.pid, number)
    errors = process.wait()
    # A refusal is no kill: 130 and 143 are those of signals that are answered.
    assert process.returncode < 0 or process.returncode in (0, 1, 130, 143), errors
    return process.returncode not in (0, 1)


def kill_once(name, folder, seconds, rng):
    """Files before and after a command that was killed; None where it always ended before."""
    for _ in range(TRIES):
        make_work(name, folder)
        before = standing(folder)
        begin = time.monotonic()
        process = started(name, folder)
        if is_killed(process, rng.choice(SIGNALS), rng.uniform(0.2, 0.95) * seconds[name]):
            return before, standing(folder)
        # The first run compiled: this one was quicker.
        seconds[name] = min(seconds[name], time.monotonic() - begin)
    return None


def test_nothing_is_damaged_or_lost_and_litter_goes(prepared, capsys):
    folder, seconds = prepared
    rng = random.Random(1)
    tallies = {name: Tally() for name in COMMANDS if name in CHOSEN}
    try:
        for number in range(KILLS):
            name = list(tallies)[number % len(tallies)]
            kill_and_look(tallies[name], name, number, folder, seconds, rng)
    finally:
        # Also of a run that is ended before its time.
        show(tallies, capsys)
    total = sum((tally.counts for tally in tallies.values()), Counter())
    examples = [text for tally in tallies.values() for text in tally.examples]
    assert total["killed before the end"] >= 0.9 * KILLS
    assert examples == []


def kill_and_look(tally, name, number, folder, seconds, rng):
    """Kill a command once and count what that did."""
    files = kill_once(name, folder, seconds, rng)
    tally.counts["tried"] += 1
    if files is None:
        return
    before, after = files
    tally.counts["killed before the end"] += 1
    tally.add("lost", before.keys() - after.keys())
    tally.add("damaged", damage(folder))
    tally.counts["with litter"] += bool(litter(folder))
    # Every tenth kill, and each that left something, is followed by the command once more.
    if not litter(folder) and number % 10:
        return
    again = started(name, folder)
    errors = again.wait()
    tally.counts["next runs"] += 1
    if again.returncode not in (0, 1):
        tally.add("next run failed", [errors])
    tally.add("litter after the next run", litter(folder))
    # What stood when it was killed still stands; answers that were finished are kept as such.
    now = standing(folder)
    tally.add("lost", after.keys() - now.keys())
    answers = [path for path in after if is_answer(path)]
    tally.add("lost", [path for path in answers if now.get(path) != after[path]])


def is_answer(path):
    """Whether a file is the finished answer of a case, which a check takes up."""
    return path.parts[0] == "checked" and path.name == "diagnosis.json"


def show(tallies, capsys):
    columns = (
        *("tried", "killed before the end", "damaged", "lost", "with litter", "next runs"),
        *("next run failed", "litter after the next run"),
    )
    with capsys.disabled():
        print("\n| command | " + " | ".join(columns) + " |")
        for name, tally in tallies.items():
            print(f"| {name} | " + " | ".join(str(tally.counts[c]) for c in columns) + " |")
