"""A request to end (SIGTERM, of batch systems and containers) is handled like Ctrl-C.

What is unfinished is removed, in the processes that work for this one too.
"""

import os
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

#: Exit codes: 128 + number of the signal, as shells count.
EXIT_INTERRUPTED = 128 + signal.SIGINT
EXIT_TERMINATED = 128 + signal.SIGTERM
#: Seconds that a working process gets to remove what it has not finished; one that compiles
#: hears late.
_PATIENCE = 60.0


class TerminationError(KeyboardInterrupt):
    """The process was asked to end by SIGTERM."""


@contextmanager
def interruptible() -> Iterator[None]:
    """Let Ctrl-C and SIGTERM interrupt the block, whatever a library makes of the interruption.

    Libraries in C may take it for an error of their own: numpy's ``tofile`` told in its place that
    it "expected str, bytes or os.PathLike". A second SIGTERM ends the process at once.

    Raises
    ------
    KeyboardInterrupt
        Where the block was interrupted; :class:`TerminationError` by SIGTERM.
    """
    heard: list[type[KeyboardInterrupt]] = []

    def interrupt(number: int, frame: Any) -> None:
        if number == signal.SIGTERM:
            signal.signal(signal.SIGTERM, signal.SIG_DFL)
        heard.append(TerminationError if number == signal.SIGTERM else KeyboardInterrupt)
        raise heard[-1]

    before = _replaced_handlers(interrupt)
    try:
        yield
    except Exception as error:
        if heard:
            raise heard[-1] from error
        raise
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _replaced_handlers(handler: Callable[[int, Any], None]) -> dict[int, Any]:
    """What handled the two signals before; Ctrl-C that a shell lets a job ignore stays ignored."""
    if threading.current_thread() is not threading.main_thread():
        return {}
    before: dict[int, Any] = {signal.SIGTERM: signal.signal(signal.SIGTERM, handler)}
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        before[signal.SIGINT] = signal.signal(signal.SIGINT, handler)
    return before


@contextmanager
def interruption_deferred() -> Iterator[None]:
    """Let Ctrl-C and SIGTERM interrupt behind the block.

    A process that is only half begun when its parent is interrupted prints an error of its own.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    heard: list[int] = []
    before: dict[signal.Signals, Any] = {}
    for asked in (signal.SIGINT, signal.SIGTERM):
        if signal.getsignal(asked) is not signal.SIG_IGN:
            before[asked] = signal.signal(asked, lambda number, frame: heard.append(number))
    try:
        yield
    finally:
        for asked, handler in before.items():
            signal.signal(asked, handler)
        if heard:
            signal.raise_signal(heard[0])


def end_between_calls() -> None:
    """Let a working process that waits for its next call end without a word when it is told to.

    Nothing is unfinished there. Ctrl-C goes to every process of a terminal: this one waits until
    the one that it works for tells it.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)


def call_or_end(function: Callable[..., Any], /, *arguments: Any, **options: Any) -> Any:
    """Result of a call in a working process, which ends where it is interrupted.

    Otherwise it would go on with the next call.
    """
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with interruptible():
            return function(*arguments, **options)
    except KeyboardInterrupt:
        os._exit(EXIT_INTERRUPTED)
    finally:
        end_between_calls()


def end_children() -> None:
    """Ask the processes that work for this one to end, and wait until they have."""
    # Late: help and refusals have no such processes.
    from multiprocessing import active_children

    children = active_children()
    for child in children:
        child.terminate()
    for child in children:
        child.join(_PATIENCE)
        if child.is_alive():
            child.kill()
