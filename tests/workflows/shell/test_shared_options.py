"""What every command takes: quiet, verbose, a log file, threads, JSON; and progress."""

import json
import os
import pty
import subprocess
import sys

import pytest

from carrierflex.workflows.progress import Stages
from carrierflex.workflows.shell.commands import COMMANDS

PROGRAM = [sys.executable, "-P", "-m", "carrierflex.workflows.command_line"]
SHARED = ("--quiet", "--verbose", "--log-file", "--threads", "--json")
MESH = ("mesh", "--size", "0.1", "--out", "a.msh")


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_tells_the_options_that_all_have(command, name):
    shown = command(*name.split(), "--help").stdout
    assert [option for option in SHARED if option not in shown] == []


def test_json_stands_alone_on_standard_output(command, tmp_path):
    done = command(*MESH, "--json")
    document = json.loads(done.stdout)
    assert document["command"] == "mesh"
    assert document["met"] is True
    assert document["written"] == ["a.msh"]
    assert document["result"]["n_tets"] > 100
    assert (tmp_path / "a.msh").is_file()


def test_json_of_a_command_with_a_document_is_that_document(command, tmp_path):
    done = command("papers", "printed-tables", "--out", "out", "--json")
    document = json.loads(done.stdout)
    stored = json.loads((tmp_path / "out" / "printed_tables.json").read_text(encoding="utf-8"))
    assert document["result"] == stored
    assert document["written"] == ["out/printed_tables.json", "out/printed_tables.png"]


def test_quiet_says_nothing_and_an_error_all_the_same(command):
    done = command(*MESH, "--quiet")
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    refused = command("mesh", "--size", "5", "--out", "a.msh", "--quiet")
    assert refused.returncode == 2
    assert "mesh size is 5.0 m" in refused.stderr
    both = command(*MESH, "--quiet", "--verbose")
    assert "--quiet and --verbose are both given; expected one of them" in both.stderr


@pytest.mark.long
def test_a_log_file_holds_progress_result_and_errors_with_their_times(tmp_path):
    for size in ("0.1", "5"):
        line = ["mesh", "--size", size, "--out", "a.msh", "--quiet", "--log-file", "log.txt"]
        subprocess.run([*PROGRAM, *line], cwd=tmp_path, check=False, capture_output=True)
    lines = (tmp_path / "log.txt").read_text(encoding="utf-8").splitlines()
    for words in (
        "[1/2] mesh of the flexible carrier",
        "smallest over largest Jacobian",
        "mesh size is 5.0",
    ):
        assert [line for line in lines if words in line]
    assert lines[0][:2] == "20"
    assert [line for line in lines if " ERROR " in line]


@pytest.mark.long
def test_verbose_tells_what_libraries_are_taken(tmp_path):
    line = ["reduce", "--body", "pin", "--modes", "1", "--size", "0.1", "--out", "a.h5"]
    said = [
        subprocess.run(
            [*PROGRAM, *line, "--no-cache", *more],
            cwd=tmp_path,
            check=True,
            capture_output=True,
            text=True,
        ).stderr
        for more in ([], ["--verbose"])
    ]
    assert "sparse factorisation" not in said[0]
    assert "sparse factorisation" in said[1]


@pytest.mark.long
def test_threads_are_those_of_blas_numba_and_working_processes(tmp_path):
    program = (
        "from carrierflex.workflows.shell.shared_options import SharedOptions\n"
        "SharedOptions(threads=1).apply()\n"
        "import numba, numpy, os, scipy.linalg, threadpoolctl\n"
        "from concurrent.futures import ProcessPoolExecutor\n"
        "from multiprocessing import get_context\n"
        "if __name__ == '__main__':\n"
        "    own = {pool['num_threads'] for pool in threadpoolctl.threadpool_info()}\n"
        "    with ProcessPoolExecutor(1, mp_context=get_context('spawn')) as workers:\n"
        "        theirs = workers.submit(os.getenv, 'OMP_NUM_THREADS').result()\n"
        "    print(own, numba.config.NUMBA_NUM_THREADS, theirs)\n"
    )
    (tmp_path / "program.py").write_text(program, encoding="utf-8")
    free = {key: value for key, value in os.environ.items() if not key.endswith("NUM_THREADS")}
    done = subprocess.run(
        [sys.executable, "-P", "program.py"],
        cwd=tmp_path, check=True, capture_output=True, text=True, env=free,
    )  # fmt: skip
    assert done.stdout.split() == ["{1}", "1", "1"]


def test_threads_below_one_are_refused(command):
    assert "--threads is 0; expected 1 or more" in command(*MESH, "--threads", "0").stderr


def test_a_pipe_gets_a_line_a_stage(command):
    lines = command(*MESH).stderr.splitlines()
    assert [line[:5] for line in lines] == ["[1/2]", "[2/2]"]
    assert all(line.endswith(" s") for line in lines)


def test_a_terminal_gets_a_bar_with_the_time_that_is_left(tmp_path):
    program = (
        "import time\n"
        "from carrierflex.workflows.progress import Stages\n"
        "stages = Stages(2)\n"
        "with stages.stage('first'):\n"
        "    time.sleep(0.3)\n"
        "with stages.stage('second'):\n"
        "    time.sleep(0.3)\n"
        "    stages.note('1 of 4', 0.25)\n"
        "    time.sleep(0.6)\n"
    )
    screen, terminal = pty.openpty()
    environment = {**os.environ, "TERM": "xterm", "COLUMNS": "120"}
    with subprocess.Popen(
        [sys.executable, "-P", "-c", program], stderr=terminal, env=environment, cwd=tmp_path
    ) as process:
        os.close(terminal)
        text = b""
        while process.poll() is None or text == b"":
            try:
                text += os.read(screen, 100_000)
            except OSError:
                break
    os.close(screen)
    shown = text.decode("utf-8")
    assert "second: 1 of 4" in shown
    assert "left" in shown
    assert "\x1b[" in shown


def test_the_time_that_is_left_follows_the_weights(monkeypatch):
    now = [0.0]
    monkeypatch.setattr("time.perf_counter", lambda: now[0])
    stages = Stages(2, quiet=True, weights=(1.0, 3.0))
    assert stages.remaining is None
    with stages.stage("first"):
        now[0] = 2.0
    assert stages.done == 0.25
    assert stages.remaining == 6.0
    with stages.stage("second"):
        now[0] = 3.0
        assert stages.remaining == pytest.approx(5.0)
        now[0] = 5.0
        stages.note("half", 0.5)
        assert stages.done == 0.625
        assert stages.remaining == pytest.approx(3.0)
        now[0] = 6.0
        assert stages.remaining == pytest.approx(2.0)


def test_a_stage_goes_on_at_its_own_speed_the_more_of_it_is_done(monkeypatch):
    now = [0.0]
    monkeypatch.setattr("time.perf_counter", lambda: now[0])
    stages = Stages(3, quiet=True, weights=(1.0, 1.0, 2.0))
    with stages.stage("first"):
        now[0] = 2.0
    with stages.stage("second, slower than thought"):
        now[0] = 4.0
        stages.note("half", 0.5)
        # Four seconds by its own speed, two by the stage before: three; later ones as both.
        assert stages.remaining == pytest.approx(1.0 + 5.0)


def test_no_time_is_shown_as_left_that_nobody_can_know(monkeypatch):
    now = [0.0]
    monkeypatch.setattr("time.perf_counter", lambda: now[0])
    stages = Stages(2, quiet=True)
    with stages.stage("first"):
        now[0] = 2.0
        stages.note("half", 0.5)
        assert stages.remaining is None
    with stages.stage("second"):
        assert stages.remaining is None
        now[0] = 3.0
        stages.note("half", 0.5)
        assert stages.remaining == pytest.approx(1.0)
        now[0] = 9.0
        assert stages.remaining is None


def test_as_many_weights_as_stages_are_asked_for():
    with pytest.raises(ValueError, match="2 weights; expected 3, one a stage"):
        Stages(3, weights=(1.0, 2.0))
