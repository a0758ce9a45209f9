"""Places that are full, clocks that jump, names and locales that are not UTF-8."""

import json
import os
import subprocess
import sys
import time
from itertools import count

import pytest

from carrierflex.identification.campaign.campaign_files import read_campaign, write_campaign
from carrierflex.simulation.carrier.case_files import shipped_case
from tests.diagnosis.element.element_campaigns import displacement_campaign

PROGRAM = [sys.executable, "-P", "-m", "carrierflex.workflows.command_line"]
#: In a name space of its own: a small file system, the command, and what is left there.
SMALL = """
import json, os, pathlib, subprocess, sys
place, *command = sys.argv[1:]
subprocess.run(["mount", "-t", "tmpfs", "-o", "size=5m", "none", place], check=True)
(pathlib.Path(place) / "theirs").write_bytes(bytes(4_900_000))
ended = subprocess.run(command, capture_output=True, text=True)
left = [str(p.relative_to(place)) for p in pathlib.Path(place).rglob("*") if p.is_file()]
print(json.dumps([ended.returncode, ended.stderr, left]))
"""
UNSHARED = ["unshare", "--user", "--map-root-user", "--mount"]


def on_small_disk(folder, command, environment):
    """Exit code, stderr and files left of a command, `folder` on a file system of 5 MB.

    Most of it is full.
    """
    folder.mkdir()
    try:
        ended = subprocess.run(
            [*UNSHARED, sys.executable, "-c", SMALL, str(folder), *command],
            cwd=folder.parent,
            env={**os.environ, **environment},
            capture_output=True,
            text=True,
        )
    except OSError as error:
        pytest.skip(f"no name spaces here: {error}")
    if not ended.stdout and ended.returncode:
        pytest.skip(f"no mounts here: {ended.stderr}")
    return json.loads(ended.stdout)


@pytest.mark.long
@pytest.mark.parametrize("variable", ["", "TMPDIR", "CARRIERFLEX_CACHE"])
def test_a_full_disk_is_told_where_results_go_and_ends_no_command_elsewhere(tmp_path, variable):
    folder = tmp_path / "small"
    out = tmp_path / "out" if variable else folder / "out"
    command = [*PROGRAM, "simulate", str(shipped_case()), "--out", str(out)]
    environment = {variable: str(folder)} if variable else {}
    code, stderr, remaining = on_small_disk(folder, command, environment)
    assert not any(".part-" in name or ".old-" in name for name in remaining)
    if variable:
        assert code == 0, stderr
    else:
        assert code == 2
        assert stderr.count("carrierflex: ") == 1
        assert "out/" in stderr
        assert "No space left on device" in stderr
        assert remaining == ["theirs"]


@pytest.mark.long
def test_a_clock_that_jumps_changes_no_campaign_and_loses_none(tmp_path, command, monkeypatch):
    case = shipped_case("mounting_2011")
    assert command("simulate", case, "--out", "before").returncode == 0
    now = time.time
    jumps = count()
    # Ten years back and forth at every look at the clock.
    monkeypatch.setattr(time, "time", lambda: now() + 3e8 * (-1.0) ** next(jumps))
    for _ in range(2):
        assert command("simulate", case, "--out", "jumped").returncode == 0
    assert command("simulate", case, "--out", "before").returncode == 0
    names = sorted(path.name for path in (tmp_path / "before").iterdir())
    assert sorted(path.name for path in (tmp_path / "jumped").iterdir()) == names
    for name in names:
        written = (tmp_path / "jumped" / name).read_bytes()
        assert written == (tmp_path / "before" / name).read_bytes()
    assert [path for path in tmp_path.rglob(".*")] == []


@pytest.mark.acceptance
def test_a_folder_whose_name_is_not_text_is_diagnosed_on_an_ascii_terminal(tmp_path):
    folder = os.fsencode(tmp_path) + b"/m\xff\xc3"
    os.mkdir(folder)
    folder_name = os.fsdecode(folder)
    write_campaign(displacement_campaign(lambda q, v: 0.0 * q), tmp_path / "plain")
    os.rename(tmp_path / "plain", os.path.join(folder_name, "campaign"))
    ended = subprocess.run(
        [*PROGRAM, "diagnose", "campaign", "--quiet", "--out", "out"],
        cwd=folder_name,
        env={**os.environ, "LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"},
        capture_output=True,
    )
    assert ended.returncode == 0, ended.stderr
    with open(os.path.join(folder_name, "out", "diagnosis.json"), encoding="utf-8") as file:
        assert json.load(file)["verdict"]
    with open(os.path.join(folder_name, "out", "report.html"), encoding="utf-8") as file:
        assert "</html>" in file.read()
    assert len(read_campaign(tmp_path.joinpath(folder_name) / "campaign").runs) > 0
