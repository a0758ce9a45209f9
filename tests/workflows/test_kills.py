"""Commands killed at random moments: nothing damaged, nothing lost, no litter after the next run.

``make acceptance`` kills 200 times (KILLS: another number) and tells a table.
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

import pytest

from carrierflex.fe.curve_files import read_curves
from carrierflex.identification.campaign.campaign_files import read_campaign
from carrierflex.reduction.body_files import read_body
from carrierflex.simulation.carrier.case_files import shipped_case

pytestmark = pytest.mark.acceptance

KILLS = int(os.environ.get("KILLS", "200"))
PROGRAM = [sys.executable, "-P", "-m", "carrierflex.workflows.command_line"]
SIGNALS = (signal.SIGKILL, signal.SIGKILL, signal.SIGTERM, signal.SIGINT)
#: Command lines by name; `campaign` and `body` stand in the folder before.
COMMANDS = {
    "simulate carrier": ["simulate", str(shipped_case()), "--out", "carrier"],
    "simulate mounting": ["simulate", str(shipped_case("mounting_2011")), "--out", "mounting"],
    "simulate parquet": [
        "simulate", str(shipped_case("mounting_2011")), "--parquet", "--out", "parquet",
    ],
    "identify": ["identify", "campaign", "--model", "m2", "--out", "identified"],
    "diagnose": ["diagnose", "campaign", "--out", "diagnosed"],
    "mesh": ["mesh", "--variant", "flexible", "--size", "0.06", "--out", "carrier.msh"],
    "reduce": ["reduce", "--body", "pin", "--size", "0.06", "--modes", "4", "--out", "pin.h5"],
    "export": ["export", "pin_before.h5", "--format", "op4", "--out", "pin.op4"],
    "cad": ["cad", "--out", "cad"],
    "blind-check": [
        "blind-check", "--kind", "element", "--cases", "1", "--no-keep", "--out", "checked",
    ],
}  # fmt: skip


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
    """Files that a user sees, with their content."""
    return {
        path.relative_to(folder): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file() and not any(part.startswith(".") for part in path.parts)
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
    for path in sorted(folder.rglob("*")):
        if not path.is_file() or any(part.startswith(".") for part in path.parts):
            continue
        read = read_curves if path.name == "deflection_curves.csv" else readers.get(path.suffix)
        try:
            if read is not None:
                read(path)
        except (ValueError, OSError):
            found.append(path.name)
    return found


@pytest.fixture(scope="module")
def prepared(tmp_path_factory):
    """Folder in which every command has run once, and how long each took [s]."""
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


def test_nothing_is_damaged_or_lost_and_litter_goes(prepared, capsys):
    folder, seconds = prepared
    rng = random.Random(1)
    counts: dict[str, Counter[str]] = {name: Counter() for name in COMMANDS}
    for number in range(KILLS):
        name = list(COMMANDS)[number % len(COMMANDS)]
        if name == "blind-check":
            shutil.rmtree(folder / "checked", ignore_errors=True)
        if name == "reduce":
            shutil.rmtree(folder / "cache", ignore_errors=True)
        before = standing(folder)
        process = started(name, folder)
        begin = time.monotonic()
        time.sleep(rng.uniform(0.2, 0.9) * seconds[name])
        if process.poll() is not None:
            # The first run compiled, or the machine was busy.
            seconds[name] = min(seconds[name], time.monotonic() - begin)
        number_sent = rng.choice(SIGNALS)
        try:
            os.killpg(process.pid, number_sent)
        except ProcessLookupError:
            pass
        process.communicate(timeout=600)
        count = counts[name]
        count["killed"] += 1
        count["before the end"] += process.returncode not in (0, 1)
        after = standing(folder)
        if name not in ("blind-check", "reduce"):
            count["lost"] += len(before.keys() - after.keys())
        count["damaged"] += len(damage(folder))
        count["litter"] += bool(litter(folder))
        if number >= KILLS - 2 * len(COMMANDS) or litter(folder):
            again = started(name, folder)
            again.communicate(timeout=1200)
            count["next run failed"] += again.returncode not in (0, 1)
            count["litter after the next run"] += len(litter(folder))
    columns = (
        *("killed", "before the end", "damaged", "lost", "litter"),
        *("next run failed", "litter after the next run"),
    )
    with capsys.disabled():
        print(f"\n{'command':20s}" + "".join(f"{column:>27s}" for column in columns))
        for name, count in counts.items():
            print(f"{name:20s}" + "".join(f"{count[column]:27d}" for column in columns))
    total = sum(counts.values(), Counter())
    assert total["before the end"] > 0
    for column in ("damaged", "lost", "next run failed", "litter after the next run"):
        assert total[column] == 0, column
