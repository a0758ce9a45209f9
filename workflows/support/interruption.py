"""A request to end (SIGTERM, of batch systems and containers) is handled like Ctrl-C.

What is unfinished is removed, in the processes that work for this one too.
"""

import os
import signal
import threading
from collections.abc import Callable
from typing import Any

#: Exit codes: 128 + number of the signal, as shells count.
EXIT_INTERRUPTED = 128 + signal.SIGINT
EXIT_TERMINATED = 128 + signal.SIGTERM
#: Seconds that a working process gets to remove what it has not finished; one that compiles
#: hears late.
_PATIENCE = 60.0


class TerminationError(KeyboardInterrupt):
    """The process was asked to end by SIGTERM."""


def interrupt_on_sigterm() -> None:
    """Let SIGTERM interrupt this process as Ctrl-C does; a second one ends it at once."""
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGTERM, _interrupt)


def _interrupt(number: int, frame: Any) -> None:
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    raise TerminationError


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
    interrupt_on_sigterm()
    try:
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
