"""Every file of a diagnosis is the same wherever its sets of effects are fitted."""

import os
import signal
import subprocess
import sys
import threading
import time

import pytest

from carrierflex.identification.campaign.campaign_files import write_campaign
from carrierflex.workflows.diagnosis.diagnose_campaign import main
from tests.diagnosis.element.element_campaigns import displacement_campaign
from tests.workflows.checked_documents import checked_document

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    """Campaign of an element with dry friction that its baseline does not have."""
    folder = tmp_path_factory.mktemp("elsewhere") / "campaign"
    write_campaign(displacement_campaign(lambda q, v: 40.0 * (v > 0.0) - 40.0 * (v < 0.0)), folder)
    return folder


@pytest.fixture(scope="module")
def here(campaign, tmp_path_factory):
    """Content of diagnosis.json from this process."""
    out = tmp_path_factory.mktemp("here")
    main(campaign, out=out, report=False, quiet=True)
    return content(out)


def content(out):
    """Content of diagnosis.json without what names the moment."""
    document = checked_document(out / "diagnosis.json")
    return {key: value for key, value in document.items() if key not in ("date", "software")}


def test_processes_give_the_same_numbers(campaign, here, tmp_path):
    main(campaign, out=tmp_path, report=False, workers=2, quiet=True)
    assert content(tmp_path) == here


@pytest.mark.acceptance
def test_one_thread_and_two_give_the_same_numbers(campaign, here, tmp_path):
    program = [sys.executable, "-P", "-m", "carrierflex.workflows.command_line"]
    for threads in ("1", "2"):
        names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
        out = tmp_path / threads
        subprocess.run(
            [*program, "diagnose", str(campaign), "--no-report", "--quiet", "--out", str(out)],
            env={**os.environ, **dict.fromkeys(names, threads)},
            check=True,
            stdout=subprocess.DEVNULL,
        )
        assert content(out) == here


@pytest.mark.acceptance
def test_a_cluster_that_loses_a_worker_gives_the_same_numbers(campaign, here, tmp_path):
    from distributed import LocalCluster

    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0") as cluster:
        victim = next(iter(cluster.workers.values())).pid
        killed = []

        def kill_at_work():
            """Kill a worker once it has begun to work."""
            used = 0.0
            while used < 1.0:
                time.sleep(0.02)
                used = processor_seconds(victim) - begin
            os.kill(victim, signal.SIGKILL)
            killed.append(victim)

        begin = processor_seconds(victim)
        killer = threading.Thread(target=kill_at_work, daemon=True)
        killer.start()
        main(campaign, out=tmp_path, report=False, scheduler=cluster.scheduler_address, quiet=True)
    assert killed
    assert content(tmp_path) == here


def processor_seconds(process):
    """Processor time that a process has used [s]."""
    with open(f"/proc/{process}/stat") as file:
        fields = file.read().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
