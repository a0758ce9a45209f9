"""A command that is asked to end, or killed, loses nothing that stands; its litter goes."""

import os
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from carrierflex.identification.campaign.campaign_files import read_campaign, write_campaign
from carrierflex.simulation.carrier.case_files import shipped_case
from tests.identification.synthetic_campaigns import carrier_campaign

COMMAND = [sys.executable, "-P", "-m", "carrierflex.workflows.command_line"]


def hidden(folder):
    return sorted(path.name for path in folder.rglob(".*"))


def children(process):
    return Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()


def is_running(process):
    try:
        return "zombie" not in Path(f"/proc/{process}/status").read_text()
    except OSError:
        return False


def test_simulate_does_not_replace_a_measurement(tmp_path, command):
    folder = tmp_path / "measured"
    write_campaign(carrier_campaign(), folder)
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    for case in ("mounting_2011", "carrier_lc1_to_lc4"):
        result = command("simulate", shipped_case(case), "--out", folder)
        assert result.returncode == 2
        assert "measured/campaign.toml: no table [simulated]" in result.stderr.splitlines()[-1]
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before


@pytest.mark.parametrize("case", ["mounting_2011", "carrier_lc1_to_lc4", "stage_lc1"])
def test_a_place_that_cannot_be_written_is_told_before_the_work(command, case):
    result = command("simulate", shipped_case(case), "--out", "/proc/x/y")
    assert result.returncode == 2
    assert "/proc/x: cannot write into this output folder" in result.stderr


def test_bushings_are_not_fitted_for_a_place_that_cannot_be_written(tmp_path, command, monkeypatch):
    command("simulate", shipped_case("mounting_2011"), "--out", "c")
    monkeypatch.setattr("carrierflex.workflows.identification.identify_bushings._fitted", None)
    (tmp_path / "file").touch()
    result = command("identify", "c", "--model", "linear_bushing", "--out", "file/out")
    assert result.returncode == 2
    assert "file/out: cannot write into this output folder" in result.stderr


@pytest.mark.parametrize("arguments", [("simulate", "case"), ("identify", "c", "--model", "m1")])
def test_a_full_disk_names_the_file_and_leaves_whole_files(tmp_path, command, arguments):
    case = shipped_case()
    command("simulate", case, "--out", "c")
    arguments = [case if word == "case" else word for word in arguments]
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    # The largest file allowed stands in for a full disk: records and pictures are larger.
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, limits[1]))
    try:
        result = command(*arguments, "--out", "out")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert result.returncode == 2
    assert "cannot be written (File too large)" in result.stderr
    assert "out/" in result.stderr
    assert hidden(tmp_path) == []
    assert all(path.stat().st_size < 20_000 for path in tmp_path.glob("out/*"))


@pytest.mark.long
@pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, 143), (signal.SIGINT, 130)])
def test_a_check_that_is_asked_to_end_ends_with_its_processes(tmp_path, number, code):
    arguments = ["blind-check", "--kind", "element", "--cases", "2", "--out", "out"]
    with subprocess.Popen(
        [*COMMAND, *arguments, "--quiet"], cwd=tmp_path, stderr=subprocess.PIPE, text=True
    ) as process:
        try:
            deadline = time.monotonic() + 600.0
            while not (tmp_path / "out" / "seals.json").exists() and time.monotonic() < deadline:
                time.sleep(0.02)
            # A process that is only being started has no one to tell that it is not wanted.
            while not children(process) and time.monotonic() < deadline:
                time.sleep(0.02)
            time.sleep(2.0)
            workers = children(process)
            process.send_signal(number)
            _, stderr = process.communicate(timeout=600)
        finally:
            process.kill()
    assert process.returncode == code, stderr
    assert stderr.count("\n") == 1, stderr
    assert "finished files are complete and remain" in stderr
    assert workers
    # They are asked to end as well; on a busy machine the last of them ends after the command.
    deadline = time.monotonic() + 60.0
    while any(is_running(worker) for worker in workers) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not any(is_running(worker) for worker in workers)
    assert hidden(tmp_path) == []


@pytest.mark.long
def test_a_killed_simulation_leaves_the_earlier_campaign_and_the_next_one_clears_up(
    tmp_path, command
):
    case = shipped_case("mounting_2011")
    command("simulate", case, "--out", "c")
    before = read_campaign(tmp_path / "c").runs[0].time
    with subprocess.Popen(
        [*COMMAND, "simulate", str(case), "--parquet", "--out", "c"], cwd=tmp_path
    ) as process:
        while not hidden(tmp_path) and process.poll() is None:
            time.sleep(0.002)
        os.kill(process.pid, signal.SIGKILL)
    assert process.returncode == -9
    assert hidden(tmp_path)
    assert len(read_campaign(tmp_path / "c").runs[0].time) == len(before)
    assert command("simulate", case, "--out", "c").returncode == 0
    assert hidden(tmp_path) == []
