"""Where work that fans out runs.

In this process, in processes of this machine, or on a Dask cluster.
"""

import os
from collections.abc import Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context
from typing import Any

from carrierflex.workflows.interruption import (
    call_or_end,
    end_between_calls,
    end_children,
    interruption_deferred,
)
from carrierflex.workflows.shell.threads import THREAD_VARIABLES, limit_threads

#: Seconds to wait for a scheduler that does not answer.
_CONNECT_TIMEOUT = 10.0


class SerialExecutor(Executor):
    """Standard executor that runs each call at once in this process."""

    def submit(self, function: Any, /, *arguments: Any, **options: Any) -> Future[Any]:
        """Run the call; a future that is done, with its result or its error."""
        future: Future[Any] = Future()
        try:
            future.set_result(function(*arguments, **options))
        except Exception as error:
            future.set_exception(error)
        return future


@contextmanager
def work_executor(workers: int = 1, scheduler: str | None = None) -> Iterator[Executor]:
    """Executor for independent calls.

    Every call is a pure function, so a lost worker's calls are simply run again.

    Parameters
    ----------
    workers : int
        Processes on this machine; 1 runs in this process.
    scheduler : str, optional
        Address of a Dask scheduler (``tcp://host:8786``); then `workers` is not used.

    Yields
    ------
    Executor
        Standard executor; what has not begun is cancelled when the block raises or is interrupted.

    Raises
    ------
    ValueError
        Where fewer than one worker is asked for, or both a number of workers and a scheduler.
    OSError
        Where no scheduler answers at the address.
    ImportError
        Where a scheduler is asked for and Dask is not installed.
    """
    check_workers(workers, scheduler)
    if scheduler is not None:
        with _dask_executor(scheduler) as executor:
            yield executor
        return
    if workers == 1:
        yield SerialExecutor()
        return
    with other_processes(workers) as executor:
        yield executor


def check_workers(workers: int, scheduler: str | None = None) -> None:
    """Refuse what :func:`work_executor` refuses, before anything is computed or written.

    Raises
    ------
    ValueError
        As there.
    """
    if workers < 1:
        raise ValueError(f"--workers is {workers}; expected 1 or more")
    if scheduler is not None and workers != 1:
        raise ValueError("--workers and --scheduler are both given; expected one of them")


class _Processes(ProcessPoolExecutor):
    """Processes of this machine that end, and leave nothing unfinished, where they are told to."""

    def __init__(self, workers: int) -> None:
        # Fresh processes: forked ones inherit the locks of running threads (MKL, gmsh).
        context = get_context("spawn")
        n_threads = max(1, (os.cpu_count() or 1) // workers)
        super().__init__(workers, mp_context=context, initializer=_begin, initargs=(n_threads,))

    def submit(self, function: Any, /, *arguments: Any, **options: Any) -> Future[Any]:
        """Run the call in one of the processes."""
        with interruption_deferred():
            return super().submit(call_or_end, function, *arguments, **options)


def _begin(n_threads: int) -> None:
    """Begin a process that shares the cores with others: fewer threads, where none are stated."""
    end_between_calls()
    if not any(name in os.environ for name in THREAD_VARIABLES):
        limit_threads(n_threads)


@contextmanager
def other_processes(workers: int) -> Iterator[Executor]:
    """Executor in other processes of this machine, even if it is only one.

    Parameters
    ----------
    workers : int
        Number of processes.

    Yields
    ------
    Executor
        Standard executor; where the block is interrupted, its processes end at once.
    """
    executor = _Processes(workers)
    try:
        yield executor
    except BaseException as error:
        executor.shutdown(wait=False, cancel_futures=True)
        if isinstance(error, KeyboardInterrupt):
            end_children()
        raise
    executor.shutdown()


@contextmanager
def _dask_executor(address: str) -> Iterator[Executor]:
    try:
        from distributed import Client
    except ImportError as error:
        raise ImportError(
            "--scheduler needs the package distributed (pip install 'carrierflex[cluster]')"
        ) from error
    try:
        client = Client(address, timeout=_CONNECT_TIMEOUT, set_as_default=False)
    except (OSError, TimeoutError, ValueError) as error:
        raise OSError(
            f"no Dask scheduler answers at {address} within {_CONNECT_TIMEOUT:.0f} s: {error}"
        ) from error
    try:
        yield client.get_executor()
    finally:
        client.close()
