"""Every executor gives the same results in the same order.

A cluster that loses a worker does too.
"""

import os
import signal
import time
from concurrent.futures.process import BrokenProcessPool

import pytest
from numpy.testing import assert_array_equal

from carrierflex.workflows.executors import other_processes, work_executor
from carrierflex.workflows.shell.threads import THREAD_VARIABLES


def _squared_slowly(number: int) -> tuple[int, int]:
    time.sleep(0.05)
    return number**2, os.getpid()


def _failing(number: int) -> int:
    raise ValueError(f"case {number} is refused")


@pytest.mark.parametrize("workers", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_results_come_in_order_whatever_runs_them(workers):
    with work_executor(workers) as executor:
        assert [square for square, _ in executor.map(_squared_slowly, range(6))] == [
            0,
            1,
            4,
            9,
            16,
            25,
        ]


def _blas_threads() -> set[int]:
    import scipy.linalg  # noqa: F401
    from threadpoolctl import ThreadpoolController

    blas = ThreadpoolController().select(internal_api="openblas").lib_controllers
    return {library.num_threads for library in blas}


@pytest.mark.slow
def test_processes_share_the_cores(monkeypatch):
    """Two processes of two threads each on two cores wait for one another."""
    for name in THREAD_VARIABLES:
        monkeypatch.delenv(name, raising=False)
    with other_processes(os.cpu_count()) as executor:
        assert executor.submit(_blas_threads).result() == {1}


def test_an_error_of_one_call_reaches_the_caller():
    with pytest.raises(ValueError, match="case 3 is refused"), work_executor() as executor:
        list(executor.map(_failing, [3]))


def test_bad_choices_are_refused():
    with pytest.raises(ValueError, match="--workers is 0"), work_executor(0):
        pass
    with pytest.raises(ValueError, match="both given"), work_executor(2, "tcp://127.0.0.1:1"):
        pass


@pytest.mark.parametrize(
    "words",
    [
        "identify campaign --model linear_bushing",
        "papers gap",
        "blind-check",
        "batch campaigns",
        "diagnose campaign",
    ],
)
def test_no_worker_is_refused_before_anything_is_computed_or_written(words, command, tmp_path):
    ended = command(*words.split(), "--out", "out", "--workers", "0")
    assert ended.returncode == 2
    assert ended.stderr == "carrierflex: --workers is 0; expected 1 or more\n"
    assert not list(tmp_path.iterdir())


def test_a_process_that_waits_for_a_call_ends_without_a_word(capfd):
    with other_processes(1) as executor:
        waiting = executor.submit(os.getpid).result()
        os.kill(waiting, signal.SIGINT)
        assert executor.submit(os.getpid).result() == waiting
        os.kill(waiting, signal.SIGTERM)
        with pytest.raises(BrokenProcessPool):
            executor.submit(time.sleep, 10.0).result(timeout=60.0)
    assert capfd.readouterr().err == ""


@pytest.mark.slow
def test_a_scheduler_that_does_not_answer_is_named(monkeypatch):
    monkeypatch.setattr("carrierflex.workflows.executors._CONNECT_TIMEOUT", 0.3)
    with (
        pytest.raises(OSError, match=r"no Dask scheduler answers at tcp://127\.0\.0\.1:1 "),
        work_executor(1, "tcp://127.0.0.1:1"),
    ):
        pass


@pytest.mark.long
@pytest.mark.slow
def test_a_cluster_that_loses_a_worker_gives_the_same_results():
    from distributed import LocalCluster

    with (
        LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0") as cluster,
        work_executor(1, cluster.scheduler_address) as executor,
    ):
        futures = [executor.submit(_squared_slowly, number) for number in range(60)]
        _, victim = futures[0].result()
        os.kill(victim, signal.SIGKILL)
        results = [future.result(timeout=60) for future in futures]
    assert_array_equal([square for square, _ in results], [number**2 for number in range(60)])
    assert len({process for _, process in results}) > 1
