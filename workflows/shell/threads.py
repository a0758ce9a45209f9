"""How many threads the libraries of this process work with."""

import os
import sys

#: What libraries read their number of threads from when they are loaded: BLAS of any make, numba,
#: Arrow, VTK. Processes that work for this one take it over.
THREAD_VARIABLES = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "NUMBA_NUM_THREADS",
    "ARROW_IO_THREADS",
    "VTK_SMP_MAX_THREADS",
)


def limit_threads(n_threads: int) -> None:
    """Limit the threads of libraries that are loaded from now on, and of those that are already.

    Raises
    ------
    ValueError
        Where fewer than one is stated.
    """
    if n_threads < 1:
        raise ValueError(f"--threads is {n_threads}; expected 1 or more")
    os.environ |= dict.fromkeys(THREAD_VARIABLES, str(n_threads))
    if "numpy" in sys.modules:
        from threadpoolctl import threadpool_limits

        threadpool_limits(n_threads)
    if "pyarrow" in sys.modules:
        import pyarrow

        pyarrow.set_cpu_count(n_threads)
        pyarrow.set_io_thread_count(n_threads)
