"""Memory of arrays that were let go, given back to the system.

The GNU C library keeps what was freed between arrays that live, for the next ones. Long work on
large records frees arrays of all sizes.
"""

import ctypes
import functools
import gc
import time
from collections.abc import Callable

#: Seconds between two times: each takes some hundredths.
_BETWEEN = 10.0


def return_freed_memory() -> None:
    """Give freed memory back to the system, where its C library can."""
    trim = _trim()
    if trim is not None:
        trim(0)


def return_unused_memory() -> None:
    """Let go of what only points to itself, as a problem and results it keeps, and give it back."""
    gc.collect()
    return_freed_memory()


def returning_freed_memory(note: Callable[[str], None]) -> Callable[[str], None]:
    """Progress that gives freed memory back between steps, every ten seconds at most.

    Parameters
    ----------
    note : callable
        Told each step.

    Returns
    -------
    callable
        Takes its place.
    """
    last = time.monotonic()

    def noted(text: str) -> None:
        nonlocal last
        note(text)
        if time.monotonic() - last > _BETWEEN:
            return_freed_memory()
            last = time.monotonic()

    return noted


@functools.cache
def _trim() -> Callable[[int], int] | None:
    """``malloc_trim`` of the GNU C library; None with another."""
    try:
        trim: Callable[[int], int] = ctypes.CDLL(None).malloc_trim
    except (AttributeError, OSError, TypeError):
        return None
    return trim
