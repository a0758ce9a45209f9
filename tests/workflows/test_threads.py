"""Every number that a command writes is the same from one thread and from two.

Bodies are held by their own tests: entries of degenerate pairs may differ
(``tests/workflows/reduction/test_threads.py``).
"""

import json
import math
import os
import subprocess
import sys

import pytest

from carrierflex.simulation.carrier.case_files import shipped_case

pytestmark = pytest.mark.acceptance

PROGRAM = [sys.executable, "-P", "-m", "carrierflex.workflows.command_line"]
LIBRARIES = ("OMP", "OPENBLAS", "MKL", "NUMBA")
#: Command lines by name; each works in the folder in which those before it have worked.
COMMANDS = {
    "simulate carrier": ["simulate", str(shipped_case()), "--out", "carrier"],
    "simulate mounting": ["simulate", str(shipped_case("mounting_2011")), "--out", "mounting"],
    "identify m2": ["identify", "carrier", "--model", "m2", "--out", "identified"],
    "identify bushings": [
        "identify", "mounting", "--model", "linear_bushing", "--out", "bushings",
    ],
    "diagnose": ["diagnose", "carrier", "--no-report", "--out", "diagnosed"],
    "curves": ["curves", "--size", "0.08", "--out", "curves"],
    "couplings": ["study", "couplings", "--size", "0.08", "--out", "coupled"],
    "torsion": ["study", "torsion", "--size", "0.08", "--out", "torsion"],
    "gear-life": ["study", "gear-life", "--out", "life"],
    "blind-check": [
        "blind-check", "--kind", "element", "--cases", "2", "--seed", "5",
        "--out", "checked",
    ],
}  # fmt: skip
#: What names the moment, the machine or the time that was needed.
OF_THE_MOMENT = (
    "date", "written", "software", "versions", "seconds", "simulation_seconds", "inputs",
    "digest", "salt",
)  # fmt: skip
#: Files of random salts and of times.
OF_THE_MOMENT_FILES = ("salts.json", "seals.json", "times.json")
#: Sums in another order differ by rounding; what is zero is rounding itself [m, rad].
RELATIVE, ROUNDING = 1e-9, 1e-14


def written(folder, threads):
    """All JSON files by name, after every command has run."""
    folder.mkdir()
    names = [f"{library}_NUM_THREADS" for library in LIBRARIES]
    environment = {**os.environ, **dict.fromkeys(names, str(threads))}
    for name, arguments in COMMANDS.items():
        done = subprocess.run(
            [*PROGRAM, *arguments, "--quiet"],
            cwd=folder,
            env=environment,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, (name, done.stderr)
    return {
        str(path.relative_to(folder)): json.loads(path.read_text(encoding="utf-8"))
        for path in sorted(folder.rglob("*.json"))
        if path.name not in OF_THE_MOMENT_FILES
    }


def is_time(entry):
    """Whether a row of a table is about processor or wall time."""
    return str(entry.get("unit", "")) == "s" or "second" in str(entry.get("name", ""))


def differences(one, two, where=""):
    """Every place at which two documents are not the same."""
    if isinstance(one, dict) and isinstance(two, dict):
        if one.keys() != two.keys():
            yield where, sorted(one), sorted(two)
            return
        for key in one:
            if key not in OF_THE_MOMENT and not is_time(one):
                yield from differences(one[key], two[key], f"{where}/{key}")
    elif isinstance(one, list) and isinstance(two, list) and len(one) == len(two):
        size = max((abs(v) for v in one if isinstance(v, float)), default=0.0)
        for k, (first, second) in enumerate(zip(one, two, strict=True)):
            of_list = isinstance(first, float) and isinstance(second, float)
            if not (of_list and abs(first - second) <= RELATIVE * size + ROUNDING):
                yield from differences(first, second, f"{where}/{k}")
    elif isinstance(one, float) and isinstance(two, float):
        if not math.isclose(one, two, rel_tol=RELATIVE, abs_tol=ROUNDING):
            yield where, one, two
    elif one != two:
        yield where, one, two


def test_one_thread_and_two_write_the_same_numbers(tmp_path):
    one = written(tmp_path / "one", 1)
    two = written(tmp_path / "two", 2)
    assert one.keys() == two.keys()
    assert len(one) >= len(COMMANDS) - 2
    result = {name: list(differences(one[name], two[name])) for name in one}
    assert not any(result.values()), {name: rows[:5] for name, rows in result.items() if rows}
