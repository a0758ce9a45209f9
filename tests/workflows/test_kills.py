"""Commands killed at random moments: nothing damaged, nothing lost, no litter after the next run.

``make acceptance`` kills 200 times before the end (KILLS: another number) and tells a table.
"""

import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from dataclasses import dataclass, field

import pytest

from carrierflex.fe.curve_files import read_curves
from carrierflex.identification.campaign.campaign_files import read_campaign
from carrierflex.reduction.body_files import read_body
from carrierflex.simulation.carrier.case_files import shipped_case

pytestmark = pytest.mark.acceptance

KILLS = int(os.environ.get("KILLS", "200"))
#: Tries for every kill: on a busy machine a command may end before it is hit.
TRIES = 4
PROGRAM = [sys.executable, "-P", "-m", "carrierflex.workflows.command_line"]
#: Most are SIGKILL, which no program can answer.
SIGNALS = (*[signal.SIGKILL] * 6, signal.SIGTERM, signal.SIGINT)
#: Command lines by name; `campaign` and `pin_before.h5` stand in the folder before.
COMMANDS = {
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
    "gear-life": ["study", "gear-life", "--out", "life"],
    "blind-check": [
        "blind-check", "--kind", "element", "--cases", "2", "--out", "checked",
    ],
}  # fmt: skip


@dataclass
class Tally:
    """What one command's kills did."""

    counts: Counter[str] = field(default_factory=Counter)
    examples: list[str] = field(default_factory=list)

    def add(self, column, names):
        self.counts[column] += len(names)
        self.examples += [f"{column}: {name}" for name in names]


def started(name, folder):
    return subprocess.Popen(
        [*PROGRAM, *COMMANDS[name]],
        cwd=folder,
        env={**os.environ, "CARRIERFLEX_CACHE": str(folder / "cache")},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        start_new_session=True,
    )


def standing(folder):
    """Files that a user sees, with their content; the cache may forget what it holds."""
    return {
        path.relative_to(folder): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
        and not any(part.startswith(".") for part in path.parts)
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
    found = []
    for relative in standing(folder):
        path = folder / relative
        read = read_curves if path.name == "deflection_curves.csv" else readers.get(path.suffix)
        try:
            if read is not None:
                read(path)
        except (ValueError, OSError):
            found.append(relative)
    return found


@pytest.fixture(scope="module")
def prepared(tmp_path_factory):
    """Folder in which every command has run once, and how long each takes [s]."""
    folder = tmp_path_factory.mktemp("kills")
    subprocess.run(
        [*PROGRAM, "simulate", str(shipped_case()), "--out", "campaign"], cwd=folder, check=True
    )
    seconds = {}
    for name in COMMANDS:
        begin = time.monotonic()
        process = started(name, folder)
        _, stderr = process.communicate(timeout=1200)
        assert process.returncode in (0, 1), stderr
        seconds[name] = time.monotonic() - begin
        if name == "reduce":
            shutil.copyfile(folder / "pin.h5", folder / "pin_before.h5")
    return folder, seconds


def make_work(name, folder):
    """Take away what would spare a command its work: finished cases, and the cache."""
    if name == "blind-check":
        shutil.rmtree(folder / "checked", ignore_errors=True)
    if name == "batch":
        shutil.rmtree(folder / "fleet", ignore_errors=True)
    if name in ("reduce", "curves"):
        shutil.rmtree(folder / "cache", ignore_errors=True)


def is_killed(process, number, wait):
    """Send a signal after a wait [s]; whether the command was hit before its end."""
    time.sleep(wait)
    if process.poll() is None:
        os.killpg(process.pid, number)
    process.communicate(timeout=600)
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
    tallies = {name: Tally() for name in COMMANDS}
    try:
        for number in range(KILLS):
            name = list(COMMANDS)[number % len(COMMANDS)]
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
    _, stderr = again.communicate(timeout=1200)
    tally.counts["next runs"] += 1
    if again.returncode not in (0, 1):
        tally.add("next run failed", [stderr.decode()])
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
