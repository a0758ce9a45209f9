"""Dense algebra on one thread, beside threads of a sparse factorisation or in long loops."""

import functools
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager

from threadpoolctl import ThreadpoolController

#: Modules that load a BLAS of their own.
_WITH_BLAS = ("numpy", "scipy.linalg", "kvxopt.cholmod")


@contextmanager
def one_dense_thread() -> Iterator[None]:
    """Keep numpy's and scipy's BLAS to one thread.

    Its idle threads go on spinning for a while and take the cores that the next sparse solve, or
    another process, needs: where small products and other work take turns many times, the whole is
    slower with more threads (docs/performance.md). Blocks may overlap in several threads of Python:
    the last one restores what the first one met.
    """
    _LIMIT.enter()
    try:
        yield
    finally:
        _LIMIT.leave()


class _SharedLimit:
    """The limit that all blocks share: it belongs to the process, not to a thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._n_blocks = 0

    def enter(self) -> None:
        """Limit the libraries, where no block has yet."""
        with self._lock:
            if not self._n_blocks:
                blas = _blas(tuple(name in sys.modules for name in _WITH_BLAS))
                self._limit = blas.limit(limits=1)
            self._n_blocks += 1

    def leave(self) -> None:
        """Restore the libraries' threads at the end of the last block."""
        with self._lock:
            self._n_blocks -= 1
            if not self._n_blocks:
                self._limit.restore_original_limits()


@functools.cache
def _blas(loaded: tuple[bool, ...]) -> ThreadpoolController:
    """Threads of the BLAS libraries; to look for them takes a millisecond."""
    return ThreadpoolController().select(internal_api="openblas")


_LIMIT = _SharedLimit()
