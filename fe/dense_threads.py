"""Dense algebra on one thread beside a sparse factorisation that has threads of its own."""

from collections.abc import Iterator
from contextlib import contextmanager

from threadpoolctl import ThreadpoolController


@contextmanager
def one_dense_thread() -> Iterator[None]:
    """Keep numpy's and scipy's BLAS to one thread.

    Its idle threads go on spinning for a while and take the cores that the next sparse solve needs:
    where the two take turns many times, as in an eigenvalue iteration, the whole is slower with
    more threads (docs/performance.md).
    """
    with ThreadpoolController().select(internal_api="openblas").limit(limits=1):
        yield
