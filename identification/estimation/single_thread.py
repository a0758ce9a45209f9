"""Algebra of small matrices in one thread."""

from collections.abc import Iterator
from contextlib import contextmanager

from threadpoolctl import threadpool_limits


@contextmanager
def single_threaded() -> Iterator[None]:
    """Products and factorisations run in one thread, also those of libraries not yet loaded.

    Small matrices in long loops: on a busy machine the threads of a parallel product wait for each
    other ten times longer. The limit reaches loaded libraries only, and SciPy brings a BLAS of its
    own: it is loaded here, else the number of threads would change the last digits.
    """
    import scipy.linalg  # noqa: F401

    with threadpool_limits(limits=1):
        yield
